"""A run becomes a row of the table of recalls."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.training.score import score_run
from reproduction.tables.recall import COLUMNS, SCHEMA, recall_table
from reproduction.tables.side import write_side_table
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import write_pose_table
from synfeal.evaluation.metrics import Bound, pose_errors, within
from synfeal.evaluation.reprojection import (
    CELLS,
    dcre,
    read_cell_depth,
    write_cell_depth,
)
from synfeal.geometry.poses import pose_matrix
from synfeal.records.tables import read_frame
from tests.support.property_support import table_of
from tests.support.report_results import design_of, experiment

CAMERA = CameraConfig(width=128, height=96, horizontal_fov_deg=60.0)


def random_poses(count, spread_m, angle_deg, seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(np.radians(angle_deg) * rng.normal(size=(count, 3)))
    return pose_matrix(turn.as_matrix(), spread_m * rng.normal(size=(count, 3)))


def test_a_run_is_scored_by_the_same_module_and_becomes_a_row(tmp_path):
    truth = random_poses(40, 1.0, 180.0, seed=5)
    predicted = table_of(truth @ random_poses(40, 0.1, 3.0, seed=6))
    design = design_of([experiment("table4_size")])
    write_pose_table(tmp_path / "truth.csv", table_of(truth))
    write_cell_depth(tmp_path / "depth.npy", np.full((40, CELLS[0] * CELLS[1]), 2.0))
    for run in design.runs:
        folder = tmp_path / "runs" / run.directory
        write_pose_table(folder / "predictions.csv", predicted)
        files = (folder / "predictions.csv", *[tmp_path / "truth.csv"] * 3)
        outputs = (folder / "errors.csv", folder / "metrics.json")
        score_run(*files, *outputs, {}, (tmp_path / "depth.npy", CAMERA))
    metrics = json.loads((folder / "metrics.json").read_text())
    errors = pose_errors(predicted, table_of(truth))
    assert metrics["recall_10cm_5deg_true"] == within(errors, Bound(0.10, 5)).mean() > 0
    depth_m = read_cell_depth(tmp_path / "depth.npy", 40)
    expected = np.median(dcre(predicted, table_of(truth), depth_m, CAMERA))
    assert metrics["dcre"] == metrics["dcre_true"] == pytest.approx(expected)
    write_side_table(
        "recall", design, {}, tmp_path, tmp_path / "recall.csv", tmp_path / "recall.tex"
    )
    table = read_frame(tmp_path / "recall.csv", SCHEMA)
    assert len(table) == 5
    for column in COLUMNS:
        assert table[column].iloc[0] == pytest.approx(metrics[column], rel=1e-5)
    assert r"5 cm, 5$^\circ$" in (tmp_path / "recall.tex").read_text()
    assert recall_table(design, tmp_path).shape == table.shape
