import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.chain import chain_batches, chain_unassisted, fill_gaps
from baselines.groundtruth.trajectory import (
    BatchTrajectory,
    failed_trajectory,
    read_trajectory,
    write_trajectory,
)
from synfeal.config.models import GroundTruthConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, pose_matrix, quat_wxyz_of, relative

CFG = GroundTruthConfig(batch_frames=5)


def table_of(world_from_cam):
    index = np.arange(len(world_from_cam))
    return PoseTable(index, index // 3, world_from_cam[:, :3, 3], quat_wxyz_of(world_from_cam))


def random_truth(count, seed=0):
    rng = np.random.default_rng(seed)
    rotation = Rotation.random(count, rng=rng).as_matrix()
    return table_of(pose_matrix(rotation, rng.normal(size=(count, 3))))


def straight_truth(count):
    """One metre per frame along x without any turn: positions are exact in floating point."""
    position = np.column_stack([np.arange(count), np.zeros(count), np.zeros(count)])
    return table_of(pose_matrix(np.tile(np.eye(3), (count, 1, 1)), position))


def perfect(truth, batches):
    poses = truth.world_from_cam
    return [
        BatchTrajectory(
            relative(poses[b.start], poses[b.start : b.stop]), np.ones(len(b), dtype=bool)
        )
        for b in batches
    ]


def turned_last(trajectory, angle_deg):
    poses = trajectory.first_from_cam.copy()
    poses[-1, :3, :3] = Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()
    return BatchTrajectory(poses, trajectory.registered)


def moved_last(trajectory, offset_m):
    poses = trajectory.first_from_cam.copy()
    poses[-1, :3, 3] += offset_m
    return BatchTrajectory(poses, trajectory.registered)


def test_the_paper_has_34_batches():
    assert len(batches_of(6000, 250)) + len(batches_of(2500, 250)) == 34


@pytest.mark.parametrize(
    ("n_frames", "spans"),
    [
        (1, []),
        (2, [(0, 2)]),
        (5, [(0, 5)]),
        (6, [(0, 6)]),
        (7, [(0, 6), (5, 7)]),
        (8, [(0, 6), (5, 8)]),
        (11, [(0, 6), (5, 11)]),
    ],
)
def test_short_splits_and_short_last_batches(n_frames, spans):
    assert [(b.start, b.stop) for b in batches_of(n_frames, 5)] == spans


@pytest.mark.parametrize(("n_frames", "batch_frames"), [(0, 5), (5, 0)])
def test_impossible_splits_are_refused(n_frames, batch_frames):
    with pytest.raises(
        ValueError, match=f"at least one frame .* >= 1: {n_frames}, {batch_frames}$"
    ):
        batches_of(n_frames, batch_frames)


@pytest.mark.parametrize("n_frames", [1, 2, 7, 23])
def test_perfect_batches_chain_to_the_truth_without_assistance(n_frames):
    truth = random_truth(n_frames)
    batches = batches_of(n_frames, 5)
    labels, assistance = chain_batches(batches, perfect(truth, batches), truth, CFG)
    position_m, orientation_rad = pose_error(labels.world_from_cam, truth.world_from_cam)
    assert position_m.max() < 1e-12
    assert orientation_rad.max() < 1e-7
    np.testing.assert_array_equal(labels.frame, truth.frame)
    np.testing.assert_array_equal(labels.path, truth.path)
    summary = assistance.to_json()
    assert (summary["assisted"], summary["lost"], summary["filled_frames"]) == (0, 0, 0)
    assert summary["batches"] == len(batches)
    json.dumps(summary, allow_nan=False)


@pytest.mark.parametrize(("offset_m", "assisted"), [(0.19, False), (0.2, False), (0.21, True)])
def test_assistance_above_twenty_centimetres_only(offset_m, assisted):
    truth = straight_truth(11)
    truth = truth.with_poses(truth.world_from_cam - 5 * _unit_x())  # ends its first batch at 0
    batches = batches_of(11, 5)
    trajectories = perfect(truth, batches)
    trajectories[0] = moved_last(trajectories[0], [0, offset_m, 0])
    labels, assistance = chain_batches(batches, trajectories, truth, CFG)
    first, second = assistance.records
    assert first.assisted is assisted
    assert not second.assisted
    assert first.error_before_m == pytest.approx(offset_m, abs=1e-15)
    assert first.error_after_m == pytest.approx(0.0 if assisted else offset_m, abs=1e-15)
    # The next batch starts from the last pose, replaced or not.
    drift = labels.position_m[5:] - truth.position_m[5:]
    expected = [0.0, 0.0 if assisted else offset_m, 0.0]
    np.testing.assert_allclose(drift, np.tile(expected, (6, 1)), atol=1e-14)
    np.testing.assert_allclose(labels.position_m[:5], truth.position_m[:5], atol=1e-14)


def _unit_x():
    shift = np.zeros((4, 4))
    shift[0, 3] = 1.0
    return shift


@pytest.mark.parametrize(("angle_deg", "assisted"), [(9.99, False), (10.01, True), (-10.01, True)])
def test_assistance_above_ten_degrees_only(angle_deg, assisted):
    truth = straight_truth(6)
    batches = batches_of(6, 5)
    trajectories = [turned_last(perfect(truth, batches)[0], angle_deg)]
    labels, assistance = chain_batches(batches, trajectories, truth, CFG)
    record = assistance.records[0]
    assert record.assisted is assisted
    assert record.error_before_deg == pytest.approx(abs(angle_deg))
    last_turn = np.degrees(pose_error(labels.world_from_cam[-1], truth.world_from_cam[-1])[1])
    assert last_turn == pytest.approx(0.0 if assisted else abs(angle_deg), abs=1e-6)


def test_an_error_as_large_as_the_threshold_is_none():
    truth = straight_truth(6)
    batches = batches_of(6, 5)
    off = turned_last(moved_last(perfect(truth, batches)[0], [0, 0.125, 0]), 7.0)
    error_deg = chain_batches(batches, [off], truth, CFG)[1].records[0].error_before_deg

    def assisted(limit_m, limit_deg):
        limits = {"assist_position_m": limit_m, "assist_orientation_deg": limit_deg}
        cfg = GroundTruthConfig(batch_frames=5, **limits)
        return chain_batches(batches, [off], truth, cfg)[1].records[0].assisted

    assert error_deg == pytest.approx(7.0)
    assert not assisted(0.125, error_deg)
    assert assisted(0.124, error_deg)
    assert assisted(0.125, np.nextafter(error_deg, 0.0))


def test_only_the_last_pose_is_replaced():
    truth = straight_truth(6)
    batches = batches_of(6, 5)
    poses = perfect(truth, batches)[0].first_from_cam.copy()
    poses[1:, 1, 3] = 0.5
    trajectory = BatchTrajectory(poses, np.ones(6, dtype=bool))
    labels, assistance = chain_batches(batches, [trajectory], truth, CFG)
    assert assistance.records[0].assisted
    np.testing.assert_allclose(labels.position_m[:, 1], [0, 0.5, 0.5, 0.5, 0.5, 0], atol=1e-14)


def test_failed_batch_is_assisted_counted_and_interpolated():
    rotation = Rotation.from_euler("z", 3.0 * np.arange(11)[:, None], degrees=True).as_matrix()
    position = np.column_stack([np.arange(11.0) ** 2, np.zeros(11), np.zeros(11)])
    truth = table_of(pose_matrix(rotation, position))
    batches = batches_of(11, 5)
    trajectories = [failed_trajectory(6), perfect(truth, batches)[1]]
    labels, assistance = chain_batches(batches, trajectories, truth, CFG)
    summary = assistance.to_json()
    assert (summary["assisted"], summary["lost"], summary["filled_frames"]) == (1, 1, 5)
    first = assistance.records[0]
    assert (first.registered, first.lost, first.assisted) == (0, True, True)
    assert first.error_before_m == pytest.approx(25.0)
    assert first.error_before_deg == pytest.approx(15.0)
    np.testing.assert_allclose(labels.position_m[:6, 0], [0, 5, 10, 15, 20, 25], atol=1e-12)
    turned = Rotation.from_quat(labels.quat_wxyz[:6], scalar_first=True).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(np.degrees(turned), 3.0 * np.arange(6), atol=1e-9)
    np.testing.assert_allclose(labels.position_m[5:], truth.position_m[5:], atol=1e-12)


def test_a_lost_batch_that_stood_still_is_assisted_too():
    truth = straight_truth(1)
    truth = table_of(np.tile(truth.world_from_cam, (3, 1, 1)))
    _, assistance = chain_batches(batches_of(3, 5), [failed_trajectory(3)], truth, CFG)
    assert assistance.records[0].assisted
    assert assistance.records[0].error_before_m == 0.0


def test_gaps_are_interpolated_and_the_end_is_held():
    angle = np.radians([0, 10, 20, 30, 40, 50, 60])
    poses = pose_matrix(
        Rotation.from_euler("x", angle[:, None]).as_matrix(),
        np.column_stack([2.0 * np.arange(7), np.zeros(7), -np.arange(7)]),
    )
    registered = np.array([False, False, True, False, False, True, False])
    broken = poses.copy()
    broken[~registered] = np.eye(4)
    filled = fill_gaps(BatchTrajectory(broken, registered))
    np.testing.assert_allclose(filled[:6], poses[:6], atol=1e-12)
    np.testing.assert_allclose(filled[6], poses[5], atol=1e-12)
    broken[0, :3, 3] = 9.0  # means nothing, and is left alone
    before = broken.copy()
    np.testing.assert_allclose(fill_gaps(BatchTrajectory(broken, registered))[:6], poses[:6])
    np.testing.assert_array_equal(broken, before)


def test_filled_frames_are_counted():
    truth = straight_truth(6)
    poses = perfect(truth, batches_of(6, 5))[0].first_from_cam
    registered = np.array([False, True, False, True, True, True])
    labels, assistance = chain_batches(
        batches_of(6, 5), [BatchTrajectory(poses, registered)], truth, CFG
    )
    record = assistance.records[0]
    assert (record.registered, record.filled, record.lost) == (4, 1, False)
    assert record.assisted  # its first registered frame was placed by the truth
    assert record.error_before_m < 1e-12
    np.testing.assert_allclose(labels.position_m, truth.position_m, atol=1e-12)


def test_what_does_not_fit_together_is_refused():
    truth = straight_truth(11)
    batches = batches_of(11, 5)
    trajectories = perfect(truth, batches)
    short = [failed_trajectory(3), trajectories[1]]
    for parts, estimates, message in (
        (batches, trajectories[:1], "^2 batches but 1 trajectories$"),
        (batches[:1], trajectories[:1], "^the batches end at frame 5, the split at 10$"),
        (batches[1:], trajectories[1:], "^batch 1 starts at 5, not at 0$"),
        (batches, short, "^batch 0: 3 poses, 6 frames$"),
    ):
        with pytest.raises(ValueError, match=message):
            chain_batches(parts, estimates, truth, CFG)
        with pytest.raises(ValueError, match=message):
            chain_unassisted(parts, estimates, truth)
    with pytest.raises(ValueError, match=r"^2 flags for poses of shape \(1, 4, 4\)$"):
        BatchTrajectory(np.eye(4)[None], np.ones(2, dtype=bool))


def test_trajectory_file_round_trip(tmp_path):
    truth = random_truth(8)
    trajectory = perfect(truth, batches_of(8, 10))[0]
    trajectory.registered[[2, 5]] = False
    path = tmp_path / "batch-000.csv"
    write_trajectory(path, trajectory)
    again = read_trajectory(path)
    np.testing.assert_array_equal(again.registered, trajectory.registered)
    np.testing.assert_array_equal(
        again.first_from_cam[:, :3, 3], trajectory.first_from_cam[:, :3, 3]
    )
    np.testing.assert_allclose(again.first_from_cam, trajectory.first_from_cam, atol=1e-14)
    flags = [line.split(",")[:2] for line in path.read_text().splitlines()[1:]]
    assert flags == [[str(k), "0" if k in (2, 5) else "1"] for k in range(8)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "header must be .*, found ''"),
        ("frame,tx\n0,1\n", "header must be"),
        ("frame,registered,tx,ty,tz,qw,qx,qy,qz\n0,1,2\n", "needs 9 numbers"),
        ("frame,registered,tx,ty,tz,qw,qx,qy,qz\n0,1,nan,0,0,1,0,0,0\n", "row 2"),
        ("frame,registered,tx,ty,tz,qw,qx,qy,qz\n1,1,0,0,0,1,0,0,0\n", "frames must count from 0"),
        ("frame,registered,tx,ty,tz,qw,qx,qy,qz\n0,2,0,0,0,1,0,0,0\n", "registered be 0 or 1; est"),
        ("frame,registered,tx,ty,tz,qw,qx,qy,qz\n0,1.5,0,0,0,1,0,0,0\n", "row 2 must begin with"),
        ("frame,registered,tx,ty,tz,qw,qx,qy,qz\n0,1,0,0,0,2,0,0,0\n", "line 2 holds a quat"),
    ],
)
def test_broken_trajectory_files_are_named(tmp_path, text, message):
    path = tmp_path / "batch-000.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        read_trajectory(path)
    assert str(path) in str(caught.value)


def test_missing_trajectory_file_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot be read as a batch trajectory"):
        read_trajectory(tmp_path / "none.csv")
