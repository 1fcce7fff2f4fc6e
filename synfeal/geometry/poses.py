"""Rigid poses as 4x4 matrices, and the alignment of trajectories.

``world_from_cam`` maps camera coordinates to world coordinates.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from synfeal.geometry.rotations import (
    Array,
    matrix_from_quat_wxyz,
    quat_wxyz_from_matrix,
    rotation_angle_rad,
    slerp_quat_wxyz,
)


def pose_matrix(rotation: ArrayLike, position_m: ArrayLike) -> Array:
    """Build poses (..., 4, 4) from rotations (..., 3, 3) and positions (..., 3)."""
    rotation = np.asarray(rotation, dtype=np.float64)
    pose = np.zeros((*rotation.shape[:-2], 4, 4))
    pose[..., :3, :3] = rotation
    pose[..., :3, 3] = position_m
    pose[..., 3, 3] = 1.0
    return pose


def pose_from_quat(position_m: ArrayLike, quat_wxyz: ArrayLike) -> Array:
    """Build poses (..., 4, 4) from positions (..., 3) and quaternions (..., 4)."""
    return pose_matrix(matrix_from_quat_wxyz(quat_wxyz), position_m)


def quat_wxyz_of(pose: ArrayLike) -> Array:
    """Return quaternions (..., 4) of the rotations of poses (..., 4, 4)."""
    return quat_wxyz_from_matrix(np.asarray(pose)[..., :3, :3])


def inverse(pose: ArrayLike) -> Array:
    """Invert rigid motions (..., 4, 4): ``cam_from_world`` of ``world_from_cam``."""
    pose = np.asarray(pose, dtype=np.float64)
    rotation_t = np.swapaxes(pose[..., :3, :3], -1, -2)
    return pose_matrix(rotation_t, -(rotation_t @ pose[..., :3, 3:])[..., 0])


def relative(world_from_a: ArrayLike, world_from_b: ArrayLike) -> Array:
    """Return ``a_from_b`` (..., 4, 4).

    Positions are subtracted first, which keeps precision far from the origin.
    """
    a = np.asarray(world_from_a, dtype=np.float64)
    b = np.asarray(world_from_b, dtype=np.float64)
    rotation_t = np.swapaxes(a[..., :3, :3], -1, -2)
    offset = (rotation_t @ (b[..., :3, 3] - a[..., :3, 3])[..., None])[..., 0]
    return pose_matrix(rotation_t @ b[..., :3, :3], offset)


def moved_right(world_from_cam: ArrayLike, distance_m: float) -> Array:
    """Return poses (..., 4, 4) moved along their own x axis: those of a stereo pair's right camera.

    Args:
        world_from_cam: Poses (..., 4, 4).
        distance_m: Distance, metres.
    """
    moved = np.array(world_from_cam, dtype=np.float64)
    moved[..., :3, 3] += distance_m * moved[..., :3, 0]
    return moved


def interpolate(pose_a: ArrayLike, pose_b: ArrayLike, fraction: ArrayLike) -> Array:
    """Interpolate between two poses.

    Positions follow a straight line, rotations turn at constant angular velocity.

    Args:
        pose_a: Pose at fraction 0, (4, 4) or one for each fraction (N, 4, 4).
        pose_b: Pose at fraction 1, likewise.
        fraction: Fractions (N,), or a single one.

    Returns:
        Poses (N, 4, 4).
    """
    a, b = np.asarray(pose_a, dtype=np.float64), np.asarray(pose_b, dtype=np.float64)
    fraction = np.atleast_1d(np.asarray(fraction, dtype=np.float64))
    position = a[..., :3, 3] + fraction[:, None] * (b[..., :3, 3] - a[..., :3, 3])
    return pose_from_quat(position, slerp_quat_wxyz(quat_wxyz_of(a), quat_wxyz_of(b), fraction))


def position_error_m(position_a_m: ArrayLike, position_b_m: ArrayLike) -> Array:
    """Return Euclidean distances (...) between positions (..., 3)."""
    offset = np.asarray(position_a_m) - np.asarray(position_b_m)
    return np.asarray(np.linalg.norm(offset, axis=-1))


def pose_error(pose_a: ArrayLike, pose_b: ArrayLike) -> tuple[Array, Array]:
    """Return position errors (m) and orientation errors (rad) between poses (..., 4, 4)."""
    a, b = np.asarray(pose_a, dtype=np.float64), np.asarray(pose_b, dtype=np.float64)
    position = position_error_m(a[..., :3, 3], b[..., :3, 3])
    return position, rotation_angle_rad(quat_wxyz_of(a), quat_wxyz_of(b))


def umeyama_sim3(
    source: ArrayLike, target: ArrayLike, with_scale: bool = True
) -> tuple[float, Array, Array]:
    """Fit the similarity ``target = scale * rotation @ source + t`` to pairs of points.

    Least squares (Umeyama, PAMI 1991, eq. 39-42).

    Args:
        source: Points (N, 3), at least three and not collinear.
        target: The same points (N, 3), row by row, in the frame to map to.
        with_scale: Fit the scale too; otherwise it is 1.

    Returns:
        Scale, rotation (3, 3) and translation t (3,).

    Raises:
        ValueError: Fewer than three pairs, or points of either set that are collinear up to
            rounding (their rotation about the line is free).
    """
    source, target = np.asarray(source, np.float64), np.asarray(target, np.float64)
    if source.shape != target.shape or source.ndim != 2 or len(source) < 3:
        raise ValueError(
            f"need equal (N >= 3, 3) point sets, got {source.shape} and {target.shape}"
        )
    if _collinear(source) or _collinear(target):
        raise ValueError("the points are collinear: the rotation about their line is undetermined")
    source_mean, target_mean = source.mean(0), target.mean(0)
    source_c, target_c = source - source_mean, target - target_mean
    u, singular, vt = np.linalg.svd(target_c.T @ source_c / len(source))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * sign) @ vt
    scale = float((singular * sign).sum() / (source_c**2).sum(axis=1).mean()) if with_scale else 1.0
    return scale, rotation, target_mean - scale * rotation @ source_mean


def _collinear(points: Array) -> bool:
    """Check whether points (N, 3) lie on a line up to rounding."""
    spread = np.linalg.svd(points - points.mean(0), compute_uv=False)
    rounding = 4.0 * np.finfo(float).eps * np.sqrt(len(points)) * np.abs(points).max()
    return bool(spread[1] <= max(1e-9 * spread[0], rounding))
