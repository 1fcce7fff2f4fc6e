"""Properties of rotations, poses and alignment."""

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from synfeal.geometry.poses import (
    interpolate,
    inverse,
    pose_error,
    pose_from_quat,
    pose_matrix,
    quat_wxyz_of,
    relative,
    umeyama_sim3,
)
from synfeal.geometry.rotations import (
    canonical_quat_wxyz,
    matrix_from_quat_wxyz,
    mean_quat_wxyz,
    quat_wxyz_from_matrix,
    rotation_angle_rad,
    rotation_from_rpy,
    slerp_quat_wxyz,
)
from tests.support.property_support import (
    angles_rad,
    directions,
    few,
    fractions,
    pose_of,
    poses,
    positions,
    quats,
    random_table,
    rotation_of,
    turn,
    vectors,
)

pytestmark = pytest.mark.portable


def test_batches_keep_their_shape_and_arguments_and_far_poses_their_digits():
    quats = np.tile([0.8, 0.0, 0.6, 0.0], (2, 5, 1))
    np.testing.assert_allclose(quat_wxyz_from_matrix(matrix_from_quat_wxyz(quats)), quats)
    shift = np.array([2.0**40, -(2.0**40), 0.0])
    a = pose_matrix(np.eye(3), shift + np.array([1, 2, 3]))
    b = pose_matrix(np.eye(3), shift + np.array([1.5, 2.25, 3]))
    np.testing.assert_array_equal(relative(a, b)[:3, 3], [0.5, 0.25, 0])
    quat = np.array([-2.0, 0.0, 0.0, 0.0])
    canonical_quat_wxyz(quat)
    np.testing.assert_array_equal(quat, [-2.0, 0.0, 0.0, 0.0])


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
    poses = random_table(6, 3).world_from_cam.astype(np.float32)
    quats = np.random.default_rng(3).normal(size=(6, 4)).astype(np.float32)
    found = function(poses, quats)
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, function(*(a.astype(np.float64) for a in (poses, quats))))


HALF_TURN = np.array([0.0, 0.0, -1.0, 0.0])
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
lengths = st.floats(1e-3, 1e3)


def same_rotation(a, b, atol=1e-12):
    np.testing.assert_allclose(rotation_of(a), rotation_of(b), atol=atol)


@few
@given(quats, lengths, st.sampled_from([1.0, -1.0]))
@example(HALF_TURN, 1.0, 1.0)
def test_a_rotation_has_one_canonical_quaternion(quat, length, sign):
    found = canonical_quat_wxyz(sign * length * quat)
    np.testing.assert_allclose(np.linalg.norm(found), 1.0, rtol=1e-14)
    assert found[np.flatnonzero(found)[0]] > 0
    same_rotation(found, quat)
    np.testing.assert_allclose(canonical_quat_wxyz(found), found, rtol=1e-15)


@few
@given(quats, lengths)
@example(HALF_TURN, 1.0)
def test_quaternions_and_matrices_are_the_same_rotations(quat, length):
    matrix = matrix_from_quat_wxyz(length * quat)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(matrix), 1.0, rtol=1e-13)
    w, x, y, z = quat  # the matrix of a unit quaternion, written out
    np.testing.assert_allclose(
        matrix[0], [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], atol=1e-14
    )
    found = quat_wxyz_from_matrix(matrix)
    assert found[0] >= 0
    same_rotation(found, quat)


def test_matrices_and_means_are_scipys():
    rng = np.random.default_rng(0)
    for size in (1e-150, 1.0, 1e150):
        quat = size * rng.normal(size=(20, 30, 4))
        matrix = Rotation.from_quat(quat.reshape(-1, 4), scalar_first=True).as_matrix()
        found = matrix_from_quat_wxyz(quat)
        np.testing.assert_allclose(found, matrix.reshape(20, 30, 3, 3), rtol=0, atol=5e-16)
    for count in (1, 2, 7, 100, 3001):
        quat = canonical_quat_wxyz([1.0, 0.2, -0.3, 0.4] + 0.3 * rng.normal(size=(count, 4)))
        mean = Rotation.from_quat(quat, scalar_first=True).mean().as_quat(scalar_first=True)
        same_rotation(mean_quat_wxyz(quat), mean)


def test_a_quaternion_of_zeros_is_no_rotation():
    with pytest.raises(ValueError, match="length 0"):
        matrix_from_quat_wxyz(np.zeros((2, 4)))


@few
@given(quats, vectors(1e-6, 9))
def test_a_matrix_that_is_nearly_a_rotation_gives_the_nearest_one(quat, errors):
    matrix = rotation_of(quat) + errors.reshape(3, 3)
    u, _, vt = np.linalg.svd(matrix)  # the nearest rotation in the sense of Frobenius
    nearest = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    np.testing.assert_allclose(rotation_of(quat_wxyz_from_matrix(matrix)), nearest, atol=1e-10)


@few
@given(quats, quats, quats, st.sampled_from([1.0, -1.0]))
def test_angle_is_a_distance_that_no_common_rotation_changes(a, b, c, sign):
    angle = rotation_angle_rad(a, sign * b)
    assert 0.0 <= angle <= np.pi
    first, second, third = (Rotation.from_quat(q, scalar_first=True) for q in (a, b, c))
    np.testing.assert_allclose(angle, (first.inv() * second).magnitude(), atol=1e-7)
    np.testing.assert_allclose(angle, rotation_angle_rad(b, a), atol=1e-15)
    moved = [(third * r).as_quat(scalar_first=True) for r in (first, second)]
    np.testing.assert_allclose(rotation_angle_rad(*moved), angle, atol=1e-14)
    assert rotation_angle_rad(a, c) <= angle + rotation_angle_rad(b, c) + 1e-14


@few
@given(directions, quats, st.floats(0.0, np.pi))
@example(np.array([1.0, 0.0, 0.0]), IDENTITY, 1e-12)
@example(np.array([1.0, 0.0, 0.0]), IDENTITY, np.pi - 1e-9)
def test_angle_of_a_turn_is_the_turn(axis, quat, angle_rad):
    turned = Rotation.from_quat(turn(axis, angle_rad), scalar_first=True) * Rotation.from_quat(
        quat, scalar_first=True
    )
    found = rotation_angle_rad(quat, turned.as_quat(scalar_first=True))
    np.testing.assert_allclose(found, angle_rad, atol=4e-16 * 4)


@few
@given(angles_rad, st.floats(-1.5, 1.5), angles_rad)
def test_roll_pitch_and_yaw_can_be_read_off_the_camera(roll, pitch, yaw):
    right, down, forward = rotation_from_rpy([roll, pitch, yaw]).T
    np.testing.assert_allclose(np.cross(right, down), forward, atol=1e-14)  # right-handed
    np.testing.assert_allclose(forward[2], -np.sin(pitch), atol=1e-14)
    level = np.array([np.cos(yaw), np.sin(yaw)])
    np.testing.assert_allclose(forward[:2], np.cos(pitch) * level, atol=1e-14)
    tilt = np.array([-right[2], -down[2]])  # height of body left and up, over cos(pitch)
    np.testing.assert_allclose(
        tilt, np.cos(pitch) * np.array([np.sin(roll), np.cos(roll)]), atol=1e-14
    )
    full_turn = rotation_from_rpy(np.array([roll, pitch, yaw]) + 2 * np.pi)
    np.testing.assert_allclose(full_turn, np.stack([right, down, forward], axis=1), atol=1e-14)


@few
@given(quats, quats, fractions, st.sampled_from([1.0, -1.0]))
@example(IDENTITY, IDENTITY, 0.5, -1.0)
def test_slerp_turns_evenly_from_one_end_to_the_other(a, b, fraction, sign):
    whole = rotation_angle_rad(a, b)
    assume(whole < 3.1)  # at half a turn there are two shortest ways
    found = slerp_quat_wxyz(a, sign * b, [fraction])
    assert found.shape == (1, 4)
    np.testing.assert_allclose(rotation_angle_rad(a, found[0]), fraction * whole, atol=1e-13)
    np.testing.assert_allclose(rotation_angle_rad(b, found[0]), (1 - fraction) * whole, atol=1e-13)
    same_rotation(slerp_quat_wxyz(b, a, [1 - fraction])[0], found[0], atol=1e-12)


@few
@given(positions, quats, positions)
def test_a_pose_turns_points_and_then_moves_them(position_m, quat, point):
    expected = rotation_of(quat) @ point + position_m
    for pose in (pose_matrix(rotation_of(quat), position_m), pose_from_quat(position_m, quat)):
        np.testing.assert_allclose(pose @ [*point, 1.0], [*expected, 1.0], atol=1e-11)
        np.testing.assert_array_equal(pose[3], [0.0, 0.0, 0.0, 1.0])
        np.testing.assert_array_equal(pose[:3, 3], position_m)


@few
@given(poses, poses, poses)
def test_motions_form_a_group(a, b, common):
    np.testing.assert_allclose(inverse(a) @ a, np.eye(4), atol=1e-11)
    np.testing.assert_allclose(inverse(inverse(a)), a, atol=1e-11)
    a_from_b = relative(a, b)
    np.testing.assert_allclose(a @ a_from_b, b, atol=1e-11)
    np.testing.assert_allclose(inverse(a_from_b), relative(b, a), atol=1e-11)
    np.testing.assert_allclose(relative(common @ a, common @ b), a_from_b, atol=1e-10)
    np.testing.assert_array_equal(relative(a, a)[:3, 3], 0.0)


@few
@given(poses, poses, fractions)
def test_interpolation_divides_way_and_turn_in_one_ratio(a, b, fraction):
    whole_rad = rotation_angle_rad(quat_wxyz_of(a), quat_wxyz_of(b))
    assume(whole_rad < 3.1)
    found = interpolate(a, b, fraction)
    assert found.shape == (1, 4, 4)
    expected_m = (1 - fraction) * a[:3, 3] + fraction * b[:3, 3]
    np.testing.assert_allclose(found[0, :3, 3], expected_m, atol=1e-12)
    turned_rad = rotation_angle_rad(quat_wxyz_of(a), quat_wxyz_of(found[0]))
    np.testing.assert_allclose(turned_rad, fraction * whole_rad, atol=1e-12)
    np.testing.assert_allclose(interpolate(b, a, 1 - fraction), found, atol=1e-12)


@few
@given(poses, directions, directions, st.floats(0.0, 50.0), st.floats(0.0, np.pi), poses)
def test_pose_error_is_the_displacement_and_the_turn(pose, way, axis, moved_m, turned_rad, world):
    other = pose @ pose_of(moved_m * way, turn(axis, turned_rad))
    for a, b in ((pose, other), (other, pose), (world @ pose, world @ other)):
        position_m, orientation_rad = pose_error(a, b)
        np.testing.assert_allclose(position_m, moved_m, atol=1e-10)
        np.testing.assert_allclose(orientation_rad, turned_rad, atol=1e-7)
