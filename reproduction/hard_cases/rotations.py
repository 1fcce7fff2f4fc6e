"""Rotations near 0 and pi, poses between poses, frames of a path, alignments, poses far away."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from reproduction.hard_cases import exact
from reproduction.hard_cases.exact import MP, REFUSED, Trial
from synfeal.geometry import poses, rotations
from synfeal.planning import path

Array = NDArray[np.float64]
AXIS = (2.0, -3.0, 6.0)
BASE = exact.quat_of(0.7, (1.0, 5.0, -2.0))  # a rotation along no axis
PI = MP.pi
NEARLY_PI = PI - MP.mpf("1e-9")
FRACTIONS = (0.0, 0.1, 0.5, 1.0)
FAR_M = np.array([1e6, -7e5, 3e5])
OFFSET_M = np.array([5.0, -1.0, 2.0])
PERMUTATION = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def _turned(angle: Any) -> Any:
    """Quaternion of a turn about ``AXIS`` after the base."""
    return exact.quat_product(exact.quat_of(angle, AXIS), BASE)


def angle_of_quats(angle: Any, sign: float = 1.0) -> Trial:
    """Angle between a rotation and the same turned on; one quaternion may have the other sign."""
    a, b = exact.rounded(BASE), sign * exact.rounded(_turned(angle))
    between = exact.quat_product(exact.inverse(exact.exact(a)), exact.exact(b))
    return Trial(
        naive=lambda: 2.0 * np.arccos(np.dot(a, b)),
        ours=lambda: rotations.rotation_angle_rad(a, b),
        truth=exact.angle_of_quat(between),
    )


def angle_of_poses(angle: Any) -> Trial:
    """Angle between two poses: their matrices are rotations up to rounding."""
    quats = (BASE, _turned(angle))
    a, b = (poses.pose_matrix(exact.rounded(exact.matrix_of(q)), np.zeros(3)) for q in quats)
    near_a, near_b = (exact.nearest_rotation(exact.exact(pose[:3, :3])) for pose in (a, b))
    return Trial(
        naive=lambda: np.arccos((np.trace(a[:3, :3].T @ b[:3, :3]) - 1.0) / 2.0),
        ours=lambda: poses.pose_error(a, b)[1],
        truth=exact.angle_of_matrix(near_a.T * near_b),
    )


def quat_of_matrices(matrices: Array) -> Trial:
    """Quaternions of the rotations nearest to matrices (N, 3, 3); the error is an angle."""
    return Trial(
        naive=lambda: np.array([_textbook_quat(matrix) for matrix in matrices]),
        ours=lambda: rotations.quat_wxyz_from_matrix(matrices),
        truth=[exact.nearest_rotation(exact.exact(matrix)) for matrix in matrices],
        error=lambda quats, truth: max(
            float(exact.angle_of_matrix(true.T * exact.matrix_of(exact.exact(quat))))
            for quat, true in zip(quats, truth, strict=True)
        ),
    )


def matrix_turned_by(angle: Any) -> Array:
    """A matrix (1, 3, 3) of a turn, rounded to doubles."""
    return np.array([exact.rounded(exact.matrix_of(exact.quat_of(angle, AXIS)))])


def read_back() -> Array:
    """Rotations (40, 3, 3) as a text file of five digits gives them back."""
    return np.asarray(np.round(Rotation.random(40, rng=np.random.default_rng(0)).as_matrix(), 5))


def _textbook_quat(matrix: Array) -> Array:
    w = np.sqrt(1.0 + np.trace(matrix)) / 2.0
    skew = matrix - matrix.T
    quat = np.array([w, *(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * w))])
    return np.asarray(quat / np.linalg.norm(quat))


def arc(angle: Any, sign: float = 1.0) -> Trial:
    """Quaternions on the arc between two that are ``angle`` apart; the error is an angle."""
    a, b = exact.rounded(BASE), sign * exact.rounded(_turned(angle))
    first = exact.exact(a)
    step = exact.quat_product(exact.exact(b), exact.inverse(first))
    return Trial(
        naive=lambda: _textbook_slerp(a, b),
        ours=lambda: rotations.slerp_quat_wxyz(a, b, FRACTIONS),
        truth=[exact.quat_product(exact.quat_to_power(step, t), first) for t in FRACTIONS],
        error=lambda quats, truth: max(
            float(exact.angle_of_quat(exact.quat_product(exact.inverse(true), exact.exact(quat))))
            for quat, true in zip(quats, truth, strict=True)
        ),
    )


def _textbook_slerp(a: Array, b: Array) -> Array:
    angle = np.arccos(np.dot(a, b))
    weights = [(np.sin((1.0 - t) * angle), np.sin(t * angle)) for t in FRACTIONS]
    return np.array([(u * a + v * b) / np.sin(angle) for u, v in weights])


def across_half_turn(from_deg: float, to_deg: float) -> Trial:
    """Yaw of the frames between two headings on either side of +-180 deg, as a turn in degrees."""
    ends = np.zeros((2, 6))
    ends[:, 5] = np.radians([from_deg, to_deg])
    turn = exact.mpf(ends[1, 5]) - exact.mpf(ends[0, 5])
    shortest = turn - 2 * PI * MP.nint(turn / (2 * PI))
    return Trial(
        naive=lambda: np.degrees((ends[1] - ends[0])[5]),
        ours=lambda: np.degrees(path.step_of(ends[0], ends[1], 1)[5]),
        truth=shortest * 180 / PI,
    )


def frames(distance_m: float, spacing_m: float) -> Trial:
    """Frames of a path against ``start + j / n (target - start)``: some, and the last."""
    start = np.array([0.1, -2.3, 1.1, 0.0, 0.1, 0.2])
    target = start + distance_m * np.eye(6)[0]
    count = max(1, round(distance_m / spacing_m))
    some = sorted({1, (count + 1) // 2, count})
    rows = [frame - 1 for frame in some]
    x, end = Fraction(start[0]), Fraction(target[0])
    return Trial(
        naive=lambda: _printed(start, target, spacing_m)[rows, 0],
        ours=lambda: path.path_vectors(start, target, path.n_frames_of(start, target, spacing_m))[
            rows, 0
        ],
        truth=[x + Fraction(j, count) * (end - x) for j in some],
    )


def _printed(start: Array, target: Array, spacing_m: float) -> Array:
    """``v_j = v_(j-1) + j * step``, as the paper prints it."""
    count = round(float(np.linalg.norm(target[:3] - start[:3])) / spacing_m)
    step = (target - start) / count if count else np.full(6, np.nan)
    return start + np.cumsum(np.arange(1, max(count, 1) + 1))[:, None] * step


def motion_far_away() -> Trial:
    """Motion between two cameras decimetres apart, a thousand kilometres from the origin."""
    quats = [exact.rounded(exact.quat_of(angle, (1, 2, 3))) for angle in (0.4, 1.1)]
    a = poses.pose_from_quat(FAR_M + np.array([0.1, 0.2, 0.3]), quats[0])
    b = poses.pose_from_quat(FAR_M + np.array([0.35, 0.1, 0.7]), quats[1])
    a_from_world = exact.exact(a[:3, :3]).T
    return Trial(
        naive=lambda: (np.linalg.inv(a) @ b)[:3, 3],
        ours=lambda: poses.relative(a, b)[:3, 3],
        truth=a_from_world * (exact.exact(b[:3, 3:]) - exact.exact(a[:3, 3:])),
    )


def undetermined(centre_m: Array, length_m: float) -> Trial:
    """Centres on a line leave the turn about it free: there is no single alignment."""
    source = centre_m + length_m * np.linspace(0.0, 1.0, 20)[:, None] * [0.3, -0.5, 0.81]
    return _alignment(source, REFUSED)


def aligned(centre_m: Array, thickness: float) -> Trial:
    """Centres of dyadic coordinates and their exact images: the scale and all of the rotation.

    The rotation permutes the axes and the scale is a half, so nothing is rounded; of thickness 0
    the centres lie in a plane.
    """
    spread = np.array([1.0, 1.0, thickness])
    cloud = np.round(64 * np.random.default_rng(1).normal(size=(20, 3)) * spread) / 64
    return _alignment(centre_m + cloud, [Fraction(1, 2), *PERMUTATION.ravel()])


def _alignment(source: Array, truth: Any) -> Trial:
    target = source @ PERMUTATION.T / 2 + OFFSET_M

    def ours() -> Array:
        scale, rotation, _ = poses.umeyama_sim3(source, target)
        return np.array([scale, *rotation.ravel()])

    return Trial(naive=lambda: _uncentred(source, target), ours=ours, truth=truth)


def _uncentred(source: Array, target: Array) -> Array:
    """Covariances as means of products less products of means, no look at rank or reflection."""
    mean_a, mean_b = source.mean(axis=0), target.mean(axis=0)
    covariance = target.T @ source / len(source) - np.outer(mean_b, mean_a)
    u, singular, vt = np.linalg.svd(covariance)
    spread = (source**2).sum(axis=1).mean() - mean_a @ mean_a
    return np.array([singular.sum() / spread, *(u @ vt).ravel()])
