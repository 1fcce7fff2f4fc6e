import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from synfeal.geometry.alignment import umeyama_sim3
from synfeal.geometry.poses import (
    interpolate,
    inverse,
    pose_error,
    pose_from_quat,
    pose_matrix,
    position_error_m,
    quat_wxyz_of,
    relative,
)
from synfeal.geometry.rotations import (
    canonical_quat_wxyz,
    matrix_from_quat_wxyz,
    quat_wxyz_from_matrix,
    rotation_angle_rad,
    rotation_from_rpy,
    slerp_quat_wxyz,
)

AXIS = np.array([2.0, -3.0, 6.0]) / 7.0
IDENTITY = [1.0, 0.0, 0.0, 0.0]


def turn(angle_rad, axis=AXIS):
    """Quaternion of a turn by its definition."""
    return np.array([np.cos(angle_rad / 2), *(np.sin(angle_rad / 2) * np.asarray(axis))])


def random_poses(count, seed=0):
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(count, rng=rng).as_matrix()
    return pose_matrix(rotations, rng.normal(size=(count, 3)))


@pytest.mark.parametrize("angle", [1e-12, 1e-8, 1e-3, 1.0, 3.0])
def test_angle_of_a_known_turn_keeps_its_digits(angle):
    assert rotation_angle_rad(IDENTITY, turn(angle)) == pytest.approx(angle, rel=1e-12)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-6])
def test_angle_near_pi_keeps_its_digits(gap):
    angle = rotation_angle_rad(IDENTITY, turn(np.pi - gap))
    assert np.pi - angle == pytest.approx(gap, abs=1e-15)


def test_canonical_half_turns_have_a_positive_leading_component():
    np.testing.assert_array_equal(canonical_quat_wxyz([0, 0, -2.0, 0]), [0, 0, 1, 0])
    np.testing.assert_array_equal(canonical_quat_wxyz([0, -1.0, 0, 0]), [0, 1, 0, 0])


@pytest.mark.parametrize("angle", [1e-10, 0.7, np.pi - 1e-10, np.pi])
def test_matrix_of_a_known_turn_is_rodrigues_formula(angle):
    k = np.array([[0, -AXIS[2], AXIS[1]], [AXIS[2], 0, -AXIS[0]], [-AXIS[1], AXIS[0], 0]])
    expected = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    np.testing.assert_allclose(matrix_from_quat_wxyz(turn(angle)), expected, atol=1e-15)
    back = matrix_from_quat_wxyz(quat_wxyz_from_matrix(expected))
    np.testing.assert_allclose(back, expected, atol=1e-15)


def test_batches_of_any_shape_keep_it():
    quats = np.tile(turn(0.3), (2, 5, 1))
    assert matrix_from_quat_wxyz(quats).shape == (2, 5, 3, 3)
    np.testing.assert_allclose(quat_wxyz_from_matrix(matrix_from_quat_wxyz(quats)), quats)


def test_camera_at_zero_angles_looks_along_world_x_upright():
    world_from_cam = rotation_from_rpy([0.0, 0.0, 0.0])
    np.testing.assert_allclose(world_from_cam @ [0, 0, 1], [1, 0, 0])  # forward
    np.testing.assert_allclose(world_from_cam @ [0, -1, 0], [0, 0, 1])  # up
    np.testing.assert_allclose(world_from_cam @ [1, 0, 0], [0, -1, 0])  # right


def test_yaw_turns_left_pitch_down_and_roll_lifts_the_left():
    forward, left, quarter = [0, 0, 1], [-1, 0, 0], np.pi / 2
    np.testing.assert_allclose(rotation_from_rpy([0, 0, quarter]) @ forward, [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(rotation_from_rpy([0, quarter, 0]) @ forward, [0, 0, -1], atol=1e-15)
    np.testing.assert_allclose(rotation_from_rpy([quarter, 0, 0]) @ left, [0, 0, 1], atol=1e-15)


def test_roll_pitch_yaw_is_the_written_out_product():
    roll, pitch, yaw = 0.3, -0.5, 2.5
    c, s = np.cos, np.sin
    rx = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    ry = np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
    rz = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    body = rotation_from_rpy([roll, pitch, yaw]) @ rotation_from_rpy([0, 0, 0]).T
    np.testing.assert_allclose(body, rz @ ry @ rx, atol=1e-15)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slerp_turns_at_constant_speed_the_short_way(sign):
    angle = np.radians(150)
    fractions = np.array([0.0, 0.1, 0.5, 1.0])
    found = slerp_quat_wxyz(turn(0.2), sign * turn(0.2 + angle), fractions)
    expected = np.array([canonical_quat_wxyz(turn(0.2 + f * angle)) for f in fractions])
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_slerp_of_equal_rotations_stays():
    found = slerp_quat_wxyz(turn(1.0), -turn(1.0), [0.0, 0.3, 1.0])
    np.testing.assert_allclose(found, np.tile(turn(1.0), (3, 1)), atol=1e-15)


def test_inverse_is_the_matrix_inverse():
    poses = random_poses(10)
    np.testing.assert_allclose(inverse(poses), np.linalg.inv(poses), atol=1e-14)


def test_relative_is_inverse_times_pose():
    a, b = random_poses(10, 1), random_poses(10, 2)
    np.testing.assert_allclose(relative(a, b), np.linalg.inv(a) @ b, atol=1e-14)


def test_relative_is_exact_far_from_the_origin():
    shift = np.array([2.0**40, -(2.0**40), 0.0])
    a = pose_matrix(np.eye(3), shift + np.array([1, 2, 3]))
    b = pose_matrix(np.eye(3), shift + np.array([1.5, 2.25, 3]))
    np.testing.assert_array_equal(relative(a, b)[:3, 3], [0.5, 0.25, 0])


def test_pose_and_quaternion_round_trip():
    poses = random_poses(20)
    again = pose_from_quat(poses[:, :3, 3], quat_wxyz_of(poses))
    np.testing.assert_allclose(again, poses, atol=1e-14)


def test_interpolation_is_straight_and_even():
    a = pose_from_quat([1.0, 0.0, 0.0], turn(0.0))
    b = pose_from_quat([3.0, 4.0, 0.0], turn(0.8))
    quarter, end = interpolate(a, b, [0.25, 1.0])
    np.testing.assert_allclose(quarter, pose_from_quat([1.5, 1.0, 0.0], turn(0.2)), atol=1e-15)
    np.testing.assert_allclose(end, b, atol=1e-15)


def test_pose_error_of_a_known_displacement():
    a = random_poses(1)[0]
    b = a @ pose_from_quat([0.3, 0.0, 0.4], turn(0.25))
    position_m, orientation_rad = pose_error(a, b)
    assert position_m == pytest.approx(0.5)
    assert orientation_rad == pytest.approx(0.25)
    assert position_error_m([[0, 0, 0]], [[1, 2, 2]]) == pytest.approx(3.0)


def test_umeyama_recovers_a_known_similarity():
    rng = np.random.default_rng(0)
    source = rng.normal(size=(12, 3))
    rotation, scale, offset = matrix_from_quat_wxyz(turn(2.0)), 0.37, np.array([5.0, -1.0, 2.0])
    found = umeyama_sim3(source, scale * source @ rotation.T + offset)
    assert found[0] == pytest.approx(scale, rel=1e-12)
    np.testing.assert_allclose(found[1], rotation, atol=1e-12)
    np.testing.assert_allclose(found[2], offset, atol=1e-12)


def test_umeyama_agrees_with_scipy_on_noisy_and_on_planar_points():
    rng = np.random.default_rng(1)
    for flat in (1.0, 0.0):
        source = rng.normal(size=(30, 3)) * [1, 1, flat]
        target = source @ matrix_from_quat_wxyz(turn(1.3)).T + 0.05 * rng.normal(size=(30, 3))
        _, rotation, _ = umeyama_sim3(source, target)
        centred = source - source.mean(0), target - target.mean(0)
        expected = Rotation.align_vectors(centred[1], centred[0])[0].as_matrix()
        np.testing.assert_allclose(rotation, expected, atol=1e-6)


def test_umeyama_never_returns_a_reflection():
    source = np.random.default_rng(2).normal(size=(10, 3))
    _, rotation, _ = umeyama_sim3(source, source * [1, 1, -1])
    assert np.linalg.det(rotation) == pytest.approx(1)


SINGLE = [
    lambda p, q: pose_matrix(p[:, :3, :3], p[:, :3, 3]),
    lambda p, q: pose_from_quat(p[:, :3, 3], q),
    lambda p, q: quat_wxyz_of(p),
    lambda p, q: inverse(p),
    lambda p, q: relative(p[0], p),
    lambda p, q: interpolate(p[0], p[1], np.float32([0.1, 0.7])),
    lambda p, q: np.stack(pose_error(p[0], p[1:])),
    lambda p, q: canonical_quat_wxyz(q),
    lambda p, q: quat_wxyz_from_matrix(p[:, :3, :3]),
    lambda p, q: matrix_from_quat_wxyz(q),
    lambda p, q: rotation_angle_rad(q[0], q),
    lambda p, q: rotation_from_rpy(p[:, :3, 3]),
    lambda p, q: slerp_quat_wxyz(q[0], q[1], np.float32([0.1, 0.7])),
    lambda p, q: np.hstack([np.ravel(part) for part in umeyama_sim3(p[:, :3, 3], q[:, :3])]),
]


@pytest.mark.parametrize("function", SINGLE)
def test_what_is_given_in_single_precision_is_computed_in_double(function):
    poses = random_poses(6, 3).astype(np.float32)
    quats = np.random.default_rng(3).normal(size=(6, 4)).astype(np.float32)
    found = function(poses, quats)
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, function(*(a.astype(np.float64) for a in (poses, quats))))


def test_lists_of_whole_numbers_are_as_good_as_arrays():
    quarter = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    pose = [[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]
    np.testing.assert_array_equal(pose_matrix(quarter, [4, 5, 6]), pose)
    np.testing.assert_allclose(inverse(pose) @ pose, np.eye(4), atol=1e-15)
    np.testing.assert_allclose(relative(pose, pose), np.eye(4), atol=1e-15)
    np.testing.assert_allclose(interpolate(pose, pose, 1), [pose], atol=1e-15)
    np.testing.assert_allclose(pose_error(pose, pose), 0.0, atol=1e-15)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(quat_wxyz_of(pose), [half, 0, 0, half], atol=1e-15)
    np.testing.assert_allclose(canonical_quat_wxyz([-3, 0, 0, -4]), [0.6, 0, 0, 0.8], atol=1e-15)
    np.testing.assert_allclose(matrix_from_quat_wxyz([2, 0, 0, 2]), quarter, atol=1e-15)
    assert rotation_angle_rad([1, 0, 0, 0], [3, 0, 0, 3]) == pytest.approx(np.pi / 2)
    corners = [[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 3]]
    assert umeyama_sim3(corners, corners)[0] == pytest.approx(1.0)


def test_a_quaternion_given_is_left_as_it_was():
    quat = np.array([-2.0, 0.0, 0.0, 0.0])
    canonical_quat_wxyz(quat)
    np.testing.assert_array_equal(quat, [-2.0, 0.0, 0.0, 0.0])


def test_umeyama_takes_points_that_are_barely_apart_and_far_away():
    # 1 mm aside of a line of 1 m, 100 km from the origin: little, but far above rounding.
    source = np.array([[1e5, 0, 0], [1e5 + 0.5, 1e-3, 0], [1e5 + 1.0, 0, 0]])
    np.testing.assert_allclose(umeyama_sim3(source, source)[1], np.eye(3), atol=1e-4)
    thin = np.array([[0.0, 0, 0], [0.5, 2e-9, 0], [1.0, 0, 0]])  # spread 2 : 1e9
    np.testing.assert_allclose(umeyama_sim3(thin, thin)[1], np.eye(3), atol=1e-6)
    for scale in (1e-3, 1.0, 1e3):  # what counts is the spread aside against that along
        with pytest.raises(ValueError, match="collinear"):
            umeyama_sim3(scale * thin * [1, 0.1, 1], thin)


def test_umeyama_says_which_shapes_it_was_given():
    with pytest.raises(ValueError, match=r"got \(4, 3\) and \(5, 3\)"):
        umeyama_sim3(np.zeros((4, 3)), np.zeros((5, 3)))
    with pytest.raises(ValueError, match=r"got \(9,\) and \(9,\)"):
        umeyama_sim3(np.zeros(9), np.zeros(9))


def test_umeyama_refuses_what_leaves_the_rotation_free():
    line = np.outer(np.arange(5.0), [1, 2, 3])
    whole = "^the points are collinear: the rotation about their line is undetermined$"
    with pytest.raises(ValueError, match=whole):
        umeyama_sim3(line, line)
    with pytest.raises(ValueError, match="collinear"):  # all in one place
        umeyama_sim3(np.zeros((4, 3)), np.zeros((4, 3)))
    far_line = np.linspace(0, 0.1, 20)[:, None] * [0.3, -0.5, 0.81] + [1e6, -7e5, 3e5]
    with pytest.raises(ValueError, match="collinear"):  # up to rounding
        umeyama_sim3(far_line, far_line)
    with pytest.raises(ValueError, match="collinear"):
        umeyama_sim3(np.random.default_rng(0).normal(size=line.shape), line)
    with pytest.raises(ValueError, match="N >= 3"):
        umeyama_sim3(np.eye(3)[:2], np.eye(3)[:2])
