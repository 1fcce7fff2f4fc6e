import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.config.labels import EstimationConfig
from baselines.labels.batches import BatchTrajectory, batches_of, failed_trajectory
from baselines.labels.chain import chain_batches, chain_unassisted, summary_of
from synfeal.geometry.poses import pose_matrix, relative
from tests.support.property_support import table_of

CFG = EstimationConfig(batch_frames=5)


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


@pytest.mark.parametrize(("n_frames", "batch_frames"), [(0, 5), (5, 0)])
def test_impossible_splits_are_refused(n_frames, batch_frames):
    with pytest.raises(
        ValueError, match=f"at least one frame .* >= 1: {n_frames}, {batch_frames}$"
    ):
        batches_of(n_frames, batch_frames)


def test_an_error_as_large_as_the_threshold_is_none():
    truth = straight_truth(6)
    batches = batches_of(6, 5)
    poses = perfect(truth, batches)[0].first_from_cam.copy()
    poses[-1, :3, :3] = Rotation.from_euler("z", 7.0, degrees=True).as_matrix()
    poses[-1, 1, 3] += 0.125
    off = BatchTrajectory(poses, np.ones(6, dtype=bool))
    error_deg = chain_batches(batches, [off], truth, CFG)[1][0].error_before_deg

    def assisted(limit_m, limit_deg):
        limits = {"assist_position_m": limit_m, "assist_orientation_deg": limit_deg}
        cfg = EstimationConfig(batch_frames=5, **limits)
        return chain_batches(batches, [off], truth, cfg)[1][0].assisted

    assert error_deg == pytest.approx(7.0)
    assert not assisted(0.125, error_deg)
    assert assisted(0.124, error_deg)
    assert assisted(0.125, np.nextafter(error_deg, 0.0))


def test_failed_batch_is_assisted_counted_and_interpolated():
    rotation = Rotation.from_euler("z", 3.0 * np.arange(11)[:, None], degrees=True).as_matrix()
    position = np.column_stack([np.arange(11.0) ** 2, np.zeros(11), np.zeros(11)])
    truth = table_of(pose_matrix(rotation, position))
    batches = batches_of(11, 5)
    trajectories = [failed_trajectory(6), perfect(truth, batches)[1]]
    labels, assistance = chain_batches(batches, trajectories, truth, CFG)
    summary = summary_of(assistance)
    assert (summary["assisted"], summary["lost"], summary["filled_frames"]) == (1, 1, 5)
    first = assistance[0]
    assert (first.registered, first.lost, first.assisted) == (0, True, True)
    assert first.error_before_m == pytest.approx(25.0)
    assert first.error_before_deg == pytest.approx(15.0)
    np.testing.assert_allclose(labels.position_m[:6, 0], [0, 5, 10, 15, 20, 25], atol=1e-12)
    turned = Rotation.from_quat(labels.quat_wxyz[:6], scalar_first=True).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(np.degrees(turned), 3.0 * np.arange(6), atol=1e-9)
    np.testing.assert_allclose(labels.position_m[5:], truth.position_m[5:], atol=1e-12)


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
