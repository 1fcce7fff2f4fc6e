"""Scores with known answers."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.training.score import score_common, score_run
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import InputError
from synfeal.frames import read_records
from tests.property_support import random_table

N = 40


def moved(table, offset_m, angle_rad):
    """Every pose shifted by ``offset_m`` and turned by ``angle_rad`` about its own axis."""
    axes = np.random.default_rng(5).normal(size=(len(table), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turned = Rotation.from_quat(table.quat_wxyz, scalar_first=True) * Rotation.from_rotvec(
        angle_rad * axes
    )
    quat = turned.as_quat(canonical=True, scalar_first=True)
    return PoseTable(table.frame, table.path, table.position_m + offset_m, quat)


@pytest.fixture
def score(tmp_path):
    """Score tables and return metrics and rows of errors."""

    def run(predicted, labels, truth, train):
        tables = {"pred": predicted, "labels": labels, "truth": truth, "train": train}
        for name, table in tables.items():
            write_pose_table(tmp_path / f"{name}.csv", table)
        inputs = [tmp_path / f"{name}.csv" for name in tables]
        outputs = tmp_path / "errors.csv", tmp_path / "metrics.json"
        score_run(*inputs, *outputs, {"model": "posenet"})
        rows = [row for _, row in read_records(outputs[0])]
        return json.loads(outputs[1].read_text()), rows

    return run


def test_known_motions_give_known_errors_against_labels_and_truth(score):
    truth = random_table(N, 1)
    labels = moved(truth, np.array([3.0, 0.0, 4.0]), 0.0)
    predicted = moved(truth, np.array([0.0, 0.0, 0.0]), math.radians(25))
    metrics, errors = score(predicted, labels, truth, truth)
    assert metrics["position_m"] == pytest.approx(5.0)
    assert metrics["position_rms_m"] == pytest.approx(5.0 / math.sqrt(3))
    assert metrics["position_m_true"] == pytest.approx(0.0, abs=1e-12)
    assert metrics["orientation_deg"] == pytest.approx(25.0)
    assert metrics["orientation_deg_true"] == pytest.approx(25.0)
    assert all(float(row["orientation_deg"]) == pytest.approx(25.0) for row in errors)
    assert [int(row["frame"]) for row in errors] == list(range(N))


def test_on_the_common_test_set_each_frame_is_compared_with_its_own_true_pose(tmp_path):
    truth = random_table(N, 1)
    part = moved(truth, np.array([3.0, 0.0, 4.0]), math.radians(25)).at(np.arange(0, N, 8))
    files = [tmp_path / name for name in ("predictions.csv", "truth.csv", "errors.csv")]
    write_pose_table(files[0], part)
    write_pose_table(files[1], truth)
    score_common(*files)
    rows = [row for _, row in read_records(files[2])]
    assert [int(row["frame"]) for row in rows] == [0, 8, 16, 24, 32]
    assert [float(row["position_m"]) for row in rows] == pytest.approx([5.0] * 5)
    assert [float(row["orientation_deg"]) for row in rows] == pytest.approx([25.0] * 5)
    write_pose_table(files[1], truth.first(30))
    with pytest.raises(InputError, match=r"predictions\.csv: has frames that"):
        score_common(*files)
    others = [files[0], *[files[1]] * 3, files[2], tmp_path / "metrics.json"]
    with pytest.raises(InputError, match=r"truth\.csv: its frames are not those"):
        score_run(*others, {})


def test_the_baseline_predicts_the_mean_training_position(score):
    test = random_table(N, 3)
    train = random_table(60, 4)
    distances = np.sort(np.sqrt(((test.position_m - train.position_m.mean(0)) ** 2).sum(1)))
    metrics, _ = score(test, test, test, train)
    assert metrics["baseline_position_m_true"] == pytest.approx(distances[19:21].mean())
    assert metrics["n_train"] == 60


def test_the_mean_pose_and_the_true_poses_are_scored_against_the_labels_too(score):
    """Cameras turned by -20, 0 and 20 degrees about one axis have no rotation for their mean."""
    turns = np.radians([-20.0, 0.0, 20.0] * 5)
    axes = np.array([0.0, 0.0, 1.0])
    quat = Rotation.from_rotvec(turns[:, None] * axes).as_quat(canonical=True, scalar_first=True)
    frame = np.arange(15)
    train = PoseTable(frame, frame, np.tile([1.0, 2.0, 3.0], (15, 1)), quat)
    truth = PoseTable(frame, frame, train.position_m, np.tile([1.0, 0, 0, 0], (15, 1)))
    labels = moved(truth, np.array([0.0, 3.0, 4.0]), math.radians(30))
    metrics, _ = score(truth, labels, truth, train)
    assert metrics["baseline_position_m_true"] == pytest.approx(0, abs=1e-12)
    assert metrics["baseline_orientation_deg_true"] == pytest.approx(0, abs=1e-9)
    assert metrics["baseline_position_m"] == metrics["floor_position_m"] == pytest.approx(5)
    assert metrics["baseline_orientation_deg"] == pytest.approx(30)
    assert metrics["floor_orientation_deg"] == pytest.approx(30)


def test_scoring_needs_no_torch():
    modules = "baselines.training.score, baselines.localizers.registry"
    code = f"import sys, {modules}; print(sorted(sys.modules))"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert "'torch'" not in result.stdout
