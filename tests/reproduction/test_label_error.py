"""Errors of labels against the true poses, where the errors are known."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.config.labels import EstimationConfig
from baselines.labels.batches import (
    BatchTrajectory,
    batches_of,
    failed_trajectory,
    write_trajectory,
)
from baselines.labels.chain import chain_batches, chain_split, chain_unassisted, write_assistance
from baselines.labels.label_error import absolute_errors, relative_error, share_within, spread
from baselines.labels.methods import METHODS, stages_of
from reproduction.design.labels import check_sources
from reproduction.tables.label_error import SCHEMA, label_records
from reproduction.tables.side import write_side_table
from reproduction.tables.speed_vs_error import speeds_of
from synfeal.dataset.pose_table import write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix
from synfeal.records.files import write_json
from synfeal.records.tables import read_records
from tests.support.property_support import table_of
from tests.support.report_results import design_of, experiment

STEP_M, BATCH = 0.1, 10
CFG = EstimationConfig(batch_frames=BATCH)


def straight(n_frames, step_m=STEP_M, turn_deg=0.0):
    """Poses on a straight line along the world's x, turning about it."""
    k = np.arange(n_frames)
    rotation = Rotation.from_euler("x", (turn_deg * k)[:, None], degrees=True).as_matrix()
    return pose_matrix(rotation, np.column_stack([step_m * k, 0 * k, 0 * k]))


def drifting(batches, drift_m):
    """Every batch moves on as the truth does and aside by ``drift_m``, evenly over its frames."""
    trajectories = []
    for batch in batches:
        poses = straight(len(batch))
        poses[:, 1, 3] = np.linspace(0, drift_m, len(batch))
        trajectories.append(BatchTrajectory(poses, np.ones(len(batch), dtype=bool)))
    return trajectories


@pytest.mark.parametrize(
    ("drift_m", "ends_after_m", "assisted"),
    [
        # 15 cm a batch: the second batch ends 30 cm off and is put right, the fourth again.
        (0.15, [0.15, 0.0, 0.15, 0.0], [False, True, False, True]),
        (0.25, [0.0, 0.0, 0.0, 0.0], [True, True, True, True]),
        (0.05, [0.05, 0.10, 0.15, 0.20], [False, False, False, False]),
    ],
)
def test_a_known_drift_gives_the_known_errors_before_and_after(drift_m, ends_after_m, assisted):
    truth = table_of(straight(4 * BATCH + 1))
    batches = batches_of(len(truth), BATCH)
    trajectories = drifting(batches, drift_m)
    labels, record = chain_batches(batches, trajectories, truth, CFG)
    assert [batch.assisted for batch in record] == assisted
    ends = [batch.stop - 1 for batch in batches]
    np.testing.assert_allclose(absolute_errors(labels, truth)[0][ends], ends_after_m, atol=1e-12)
    before_m, before_deg = absolute_errors(chain_unassisted(batches, trajectories, truth), truth)
    # Without assistance the drift grows evenly to four times that of a batch.
    np.testing.assert_allclose(before_m, np.linspace(0, 4 * drift_m, len(truth)), atol=1e-12)
    np.testing.assert_allclose(before_deg, 0, atol=1e-6)
    assert spread(before_m).median == pytest.approx(2 * drift_m)
    assert spread(before_m).max == pytest.approx(4 * drift_m)
    n = 4 * BATCH
    mean_square = (4 * drift_m) ** 2 * (2 * n + 1) / (6 * n)  # of 0, 1/n, ..., 1
    assert spread(before_m).rmse == pytest.approx(np.sqrt(mean_square))


def test_a_lost_batch_stands_still_without_assistance():
    truth = table_of(straight(2 * BATCH + 1))
    batches = batches_of(len(truth), BATCH)
    trajectories = [failed_trajectory(BATCH + 1), drifting(batches, 0.0)[1]]
    before = chain_unassisted(batches, trajectories, truth)
    expected = [0.0] * BATCH + [STEP_M * k for k in range(BATCH + 1)]
    np.testing.assert_allclose(before.position_m[:, 0], expected, atol=1e-12)


@pytest.mark.parametrize("frames", [1, 25])
def test_relative_error_of_a_known_drift(frames):
    truth = table_of(straight(60))
    labels = table_of(straight(60, step_m=1.02 * STEP_M, turn_deg=0.2))
    error = relative_error([(labels, truth)], frames)
    assert error.rmse_m == pytest.approx(0.02 * STEP_M * frames)
    assert error.rmse_deg == pytest.approx(0.2 * frames)
    assert error.per_metre_m == pytest.approx(0.02)
    assert error.per_metre_deg == pytest.approx(0.2 / STEP_M)


def test_relative_error_needs_enough_frames_and_some_way_in_each_sequence():
    short, standing = table_of(straight(25)), table_of(straight(26, step_m=0.0))
    assert relative_error([(short, short)], 25) is None
    assert np.isnan(relative_error([(standing, standing)], 25).per_metre_m)
    assert np.isnan(relative_error([(standing, standing)], 1).per_metre_deg)
    # 26 frames hold one motion over 25 of them; a sequence of 25 adds none.
    one = relative_error([(short, short), (standing, table_of(straight(26)))], 25)
    assert one.rmse_m == pytest.approx(25 * STEP_M)
    assert one.per_metre_m == pytest.approx(1.0)


def test_a_trajectory_that_is_not_of_its_batch_is_named(tmp_path):
    truth, labels, unassisted = (tmp_path / f"{name}.csv" for name in "tlu")
    write_pose_table(truth, table_of(straight(BATCH + 2)))
    files = [tmp_path / "0.csv", tmp_path / "1.csv"]
    write_trajectory(files[0], failed_trajectory(BATCH + 1))
    write_trajectory(files[1], failed_trajectory(3))
    with pytest.raises(InputError) as refusal:
        chain_split(files, truth, labels, unassisted, CFG)
    assert str(refusal.value) == f"{files[1]}: holds 3 poses for 2 frames; estimate it again"
    write_trajectory(files[1], failed_trajectory(2))
    for some in (files[:1], [*files, files[1]]):
        with pytest.raises(ValueError, match="zip"):
            chain_split(some, truth, labels, unassisted, CFG)
    assert not labels.exists()
    assert not unassisted.exists()


def test_the_share_within_limits_includes_the_limits():
    errors = np.array([0.05, 0.05, 0.051, 0.0]), np.array([5.0, 5.1, 0.0, 0.0])
    assert share_within(errors, 0.05, 5.0) == 0.5


@pytest.fixture
def results(tmp_path):
    """Two methods, two batches of the training split and one of the test split, 15 cm drift."""
    root, rows = tmp_path / "toy", []
    folder = root / "labels" / "large_room" / "6k"
    for method in ("sfm", "rgbd-odometry"):
        records = {}
        for split, count in (("train", 21), ("test", 6)):
            write_pose_table(folder / "synfeal" / f"{split}.csv", table_of(straight(count)))
            batches = batches_of(count, BATCH)
            paths = [root / "batches" / f"{method}-{split}-{b.index}.csv" for b in batches]
            for path, estimate in zip(paths, drifting(batches, 0.15), strict=True):
                write_trajectory(path, estimate)
            truth, out = folder / "synfeal" / f"{split}.csv", folder / method
            outputs = out / f"{split}.csv", out / f"{split}-unassisted.csv"
            records[split] = chain_split(paths, truth, *outputs, CFG)
            for batch in batches:
                for stage in stages_of(method):
                    facts = {"odometry_s": 2.0, "loops_s": 5.0, "pairs": 9, "peak_memory_mb": 7.0}
                    at = root / "estimates/large_room/6k" / stage / split
                    write_json(at / f"batch-{batch.index:03d}.json", facts)
        write_assistance(folder / method / "assistance.json", method, records)
        rows.append(experiment("table2_ground_truth", labels=method))
    return root, rows


def write(rows, root, path):
    write_side_table("label_error", design_of(rows), {}, root, path, root / "t.tex")


def test_the_table_holds_what_was_put_into_the_labels(results):
    root, rows = results
    write(rows, root, root / "tables/label_error.csv")
    table = [row for _, row in read_records(root / "tables/label_error.csv", SCHEMA)]
    keys = [(row["method"], row["split"], row["assistance"]) for row in table]
    states = [(s, a) for s in ("train", "test", "total") for a in ("before", "after")]
    assert keys == [(m, *state) for m in ("sfm", "rgbd-odometry") for state in states]
    before, after = table[:2]
    assert (before["frames"], table[4]["frames"]) == ("21", "27")
    assert (before["position_m_max"], before["position_m_median"]) == ("0.3", "0.15")
    # The last pose, 30 cm off, is replaced; the one before it stays 28.5 cm off.
    assert after["position_m_max"] == "0.285"
    assert before["relative_1_m_rmse"] == before["relative_1_m_rmse"] == "0.015"
    assert float(before["relative_1_m_per_m"]) == pytest.approx(0.15)
    assert before["relative_25_m_rmse"] == ""  # 21 frames
    # 0, 1.5, 3 and 4.5 cm of 21 frames; after assistance also the last one.
    assert float(before["share_within_5cm_5deg"]) == pytest.approx(4 / 21, rel=1e-5)
    assert float(after["share_within_5cm_5deg"]) == pytest.approx(5 / 21, rel=1e-5)
    # Shifted by half its drift, a path that drifts evenly is off by half as much at most; what
    # else an alignment by rotations alone leaves is as it was.
    assert float(before["rigid_position_m_max"]) == pytest.approx(0.15)
    assert float(before["rigid_orientation_deg_max"]) == pytest.approx(0, abs=1e-5)
    assert float(before["similarity_position_m_max"]) <= 0.15
    assert "Drift" in (root / "t.tex").read_text()


def test_a_frame_costs_what_its_stages_took_and_each_method_has_a_row(results):
    root, rows = results
    whole = label_records(root, "large_room", "6k", "sfm", "total")[0]
    assert whole["seconds_per_frame"] == pytest.approx(3 * 7.0 / 27)
    alone = label_records(root, "large_room", "6k", "rgbd-odometry", "train")[0]
    # Two batches, the times of odometry and of the method itself, no loop closures.
    assert alone["seconds_per_frame"] == pytest.approx(2 * 2 * 2.0 / 21)
    assert alone["peak_memory_mb"] == 7.0
    write(rows, root, root / "tables/label_error.csv")
    found = speeds_of("labels", ["large_room", "sanctuary"], root)
    assert found.variant.tolist() == ["SfM", "RGB-D odometry alone"]
    assert found.items_per_s[0] == pytest.approx(27 / 21, rel=1e-5)
    assert set(found.scene) == {"large_room"}


@pytest.mark.parametrize("content", [None, "[]", '{"peak_memory_mb": "much"}'])
def test_facts_that_cannot_be_read_are_named(results, content):
    root, rows = results
    path = root / "estimates/large_room/6k/sfm/test/batch-000.json"
    path.unlink()
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=r"batch-000\.json: .*that batch again") as refusal:
        write(rows, root, root / "t.csv")
    assert "\n" not in str(refusal.value)
    assert not (root / "t.csv").exists()


def test_labels_that_nothing_makes_are_refused():
    names = ("synfeal", *METHODS, "orb")
    rows = [experiment("table2_ground_truth", labels=name) for name in names]
    check_sources(rows[:-1], Path("design.csv"))
    with pytest.raises(InputError, match=r"design\.csv: labels 'orb': not one of .*rgbd-toro"):
        check_sources(rows, Path("design.csv"))
