"""Place and scale of SfM models: against known similarities, SciPy's mean rotation and Umeyama."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.labels.sfm.batch import metric_trajectory
from baselines.labels.sfm.gauge import fit_first_poses, mean_rotation, placed
from synfeal.geometry.poses import pose_error, pose_matrix, relative, umeyama_sim3

N_FRAMES = 60
SCALE, TURN = 0.37, Rotation.from_euler("xyz", [20, -50, 110], degrees=True).as_matrix()
SHIFT_M = np.array([4.0, -1.0, 2.5])


def true_poses(straight=True):
    """Poses of a camera that turns while it moves, on a straight path or on a winding one."""
    time = np.linspace(0, 1, N_FRAMES)
    turn = Rotation.from_euler("zyx", np.column_stack([90 * time, 20 * time, 5 * time]), True)
    centre_m = np.column_stack([1 + 1.5 * time, 2 + 0.5 * time, 1.4 + 0.1 * time])
    if not straight:
        centre_m[:, 2] += 0.3 * np.sin(5 * time)
        centre_m[:, 0] += 0.3 * np.cos(7 * time)
    return pose_matrix(turn.as_matrix(), centre_m)


def seen_as_model(world_from_cam):
    """The same cameras in a model: ``x_world = SCALE * TURN @ x_model + SHIFT_M``."""
    rotation = TURN.T @ world_from_cam[:, :3, :3]
    return pose_matrix(rotation, (world_from_cam[:, :3, 3] - SHIFT_M) @ TURN / SCALE)


def about(axis, angle_deg):
    return Rotation.from_rotvec(angle_deg * np.eye(3)["xyz".index(axis)], degrees=True).as_matrix()


@pytest.mark.parametrize("gauge", ["first_poses", "first_camera"])
@pytest.mark.parametrize("straight", [True, False])
def test_an_exact_model_is_put_where_it_belongs(gauge, straight):
    true = true_poses(straight)
    np.testing.assert_allclose(placed(seen_as_model(true), true, gauge), true, atol=1e-12)


def test_umeyama_finds_the_same_similarity_where_the_path_is_not_straight():
    true = true_poses(straight=False)[:44]
    model = seen_as_model(true)
    found = fit_first_poses(model, true)
    scale, rotation, shift_m = umeyama_sim3(model[:, :3, 3], true[:, :3, 3])
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-9)
    np.testing.assert_allclose([found.scale, *found.shift_m], [scale, *shift_m], atol=1e-9)


def test_centres_of_a_straight_path_do_not_decide_where_rotations_do():
    true = true_poses(straight=True)
    with pytest.raises(ValueError, match="collinear"):
        umeyama_sim3(seen_as_model(true)[:, :3, 3], true[:, :3, 3])
    np.testing.assert_allclose(fit_first_poses(seen_as_model(true), true).rotation, TURN)


@pytest.mark.parametrize("angle_deg", [1.0, 30.0])
def test_one_wrong_camera_tilts_its_batch_by_its_whole_error_or_by_a_small_share(angle_deg):
    """43 unit vectors in one direction and one turned by the angle add up to their mean."""
    true = true_poses()
    model = seen_as_model(true)
    model[0, :3, :3] = TURN.T @ about("z", angle_deg) @ true[0, :3, :3]
    angle = np.radians(angle_deg)
    tilts = {
        "first_camera": angle,
        "first_poses": np.arctan2(np.sin(angle), 43 + np.cos(angle)),
    }
    for gauge, tilt in tilts.items():
        _, error_rad = pose_error(placed(model, true, gauge)[1:], true[1:])
        np.testing.assert_allclose(error_rad, tilt, rtol=1e-6)


def test_the_mean_of_noisy_rotations_is_that_of_scipy():
    rng = np.random.default_rng(3)
    source = Rotation.random(30, rng)
    noise = Rotation.from_rotvec(rng.normal(0, 0.2, (30, 3)))
    target = noise * Rotation.from_matrix(TURN) * source
    expected = (target * source.inv()).mean().as_matrix()
    found = mean_rotation(source.as_matrix(), target.as_matrix())
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert np.linalg.det(found) == pytest.approx(1)


@pytest.mark.parametrize("gauge", ["first_poses", "first_camera"])
def test_truth_of_later_frames_is_not_used(gauge):
    true = true_poses()
    other = true.copy()
    other[44:, :3, 3] += 5
    model = seen_as_model(true)
    np.testing.assert_array_equal(placed(model, other, gauge), placed(model, true, gauge))
    other[43, :3, 3] += 5
    if gauge == "first_poses":
        assert np.abs(placed(model, other, gauge) - placed(model, true, gauge)).max() > 0.01


@pytest.mark.parametrize("gauge", ["first_poses", "first_camera"])
def test_without_motion_there_is_no_scale(gauge):
    still = np.repeat(true_poses()[:1], 5, axis=0)
    assert placed(seen_as_model(still), still, gauge) is None
    assert placed(seen_as_model(still)[:1], still[:1], gauge) is None
    one_place = seen_as_model(true_poses())
    one_place[:, :3, 3] = 1.0
    assert placed(one_place, true_poses(), gauge) is None


def test_a_trajectory_is_relative_to_the_true_first_pose_also_where_that_is_not_registered():
    true = true_poses()
    frames = np.arange(7, N_FRAMES, 2)
    trajectory = metric_trajectory(frames, seen_as_model(true)[frames], true)
    np.testing.assert_array_equal(np.flatnonzero(trajectory.registered), frames)
    expected = relative(true[0], true)[frames]
    np.testing.assert_allclose(trajectory.first_from_cam[frames], expected, atol=1e-12)
