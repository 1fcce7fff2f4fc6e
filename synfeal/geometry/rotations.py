"""Rotations: quaternions in ``wxyz`` order, matrices, and the roll, pitch and yaw of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

# Body axes are x forward, y left, z up; camera axes are x right, y down, z forward.
BODY_FROM_CAM: Array = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def canonical_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Normalise quaternions (..., 4) to unit length and w >= 0.

    If w is 0, the first non-zero component is made positive.
    """
    quat = np.array(quat_wxyz, dtype=np.float64)
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    first_nonzero = np.argmax(quat != 0.0, axis=-1)[..., None]
    sign = np.sign(np.take_along_axis(quat, first_nonzero, axis=-1))
    return quat * sign


def quat_wxyz_from_matrix(rotation: ArrayLike) -> Array:
    """Return quaternions (..., 4) of the rotations nearest to the matrices (..., 3, 3)."""
    matrices = np.asarray(rotation, dtype=np.float64)
    flat = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return canonical_quat_wxyz(flat).reshape(*matrices.shape[:-2], 4)


def matrix_from_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Return rotation matrices (..., 3, 3) of quaternions (..., 4) of any length but zero."""
    quat = np.asarray(quat_wxyz, dtype=np.float64)
    flat = Rotation.from_quat(quat.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(flat, dtype=np.float64).reshape(*quat.shape[:-1], 3, 3)


def rotation_angle_rad(quat_a_wxyz: ArrayLike, quat_b_wxyz: ArrayLike) -> Array:
    """Return geodesic angles (...) in [0, pi] between rotations; q and -q are the same one.

    Uses atan2 of the relative quaternion, which keeps full precision near 0 and near pi where
    arccos of a dot product loses half of the digits.
    """
    a = canonical_quat_wxyz(quat_a_wxyz)
    b = canonical_quat_wxyz(quat_b_wxyz)
    scalar = np.sum(a * b, axis=-1)
    vector = a[..., :1] * b[..., 1:] - b[..., :1] * a[..., 1:] - np.cross(a[..., 1:], b[..., 1:])
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(vector, axis=-1), np.abs(scalar))
    return angle


def rotation_from_rpy(rpy_rad: ArrayLike) -> Array:
    """Return ``world_from_cam`` rotations (..., 3, 3) from body roll, pitch and yaw (..., 3).

    ``Rz(yaw) Ry(pitch) Rx(roll)`` turns the body; at zero the camera looks along world x, upright.
    """
    rpy = np.asarray(rpy_rad, dtype=np.float64)
    body = Rotation.from_euler("ZYX", rpy.reshape(-1, 3)[:, ::-1]).as_matrix()
    return np.asarray(body @ BODY_FROM_CAM).reshape(*rpy.shape[:-1], 3, 3)


def slerp_quat_wxyz(quat_a_wxyz: ArrayLike, quat_b_wxyz: ArrayLike, fraction: ArrayLike) -> Array:
    """Interpolate quaternions (N, 4) on the shortest arc between two (4,) at fractions (N,)."""
    a = Rotation.from_quat(np.asarray(quat_a_wxyz, dtype=np.float64), scalar_first=True)
    b = Rotation.from_quat(np.asarray(quat_b_wxyz, dtype=np.float64), scalar_first=True)
    step = (b * a.inv()).as_rotvec()
    turned = Rotation.from_rotvec(np.outer(np.atleast_1d(fraction), step)) * a
    return canonical_quat_wxyz(turned.as_quat(scalar_first=True))
