"""Rotations: quaternions in ``wxyz`` order, matrices, and the roll, pitch and yaw of the paper.

SciPy's rotations are imported by what needs them: with all of ``scipy.spatial`` they take a quarter
of a second, and most jobs that read poses need none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    from scipy.spatial.transform import Rotation

    matrices = np.asarray(rotation, dtype=np.float64)
    flat = Rotation.from_matrix(matrices.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return canonical_quat_wxyz(flat).reshape(*matrices.shape[:-2], 4)


def matrix_from_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Return rotation matrices (..., 3, 3) of quaternions (..., 4) of any length but zero.

    The digits are those of SciPy's ``Rotation.from_quat(...).as_matrix()``.
    """
    w, x, y, z = np.moveaxis(_unit_quat(quat_wxyz), -1, 0)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    xy, xz, yz, xw, yw, zw = x * y, x * z, y * z, x * w, y * w, z * w
    matrix = [
        [xx - yy - zz + ww, 2 * (xy - zw), 2 * (xz + yw)],
        [2 * (xy + zw), -xx + yy - zz + ww, 2 * (yz - xw)],
        [2 * (xz - yw), 2 * (yz + xw), -xx - yy + zz + ww],
    ]
    return np.stack([np.stack(row, axis=-1) for row in matrix], axis=-2)


def mean_quat_wxyz(quat_wxyz: ArrayLike) -> Array:
    """Return the rotation (4,) with the least sum of squared chords to rotations (N, 4).

    Markley et al., "Averaging Quaternions", JGCD 2007. The digits are those of SciPy's
    ``Rotation.mean``.
    """
    quat_xyzw = np.roll(_unit_quat(quat_wxyz), -1, axis=-1)
    # Of a copy: an array by its own transpose is multiplied by another routine, to other digits.
    _, vectors = np.linalg.eigh(quat_xyzw.T.copy(order="K") @ quat_xyzw)
    return canonical_quat_wxyz(np.roll(vectors[:, -1], 1))


def _unit_quat(quat_wxyz: ArrayLike) -> Array:
    """Normalise quaternions (..., 4) of any length but zero."""
    quat = np.asarray(quat_wxyz, dtype=np.float64)
    w, x, y, z = np.moveaxis(quat, -1, 0)
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.sqrt(x * x + y * y + z * z + w * w)
        if not np.all(length):
            raise ValueError("a quaternion of length 0 is no rotation")
        return np.asarray(quat / length[..., None])


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
    from scipy.spatial.transform import Rotation

    rpy = np.asarray(rpy_rad, dtype=np.float64)
    body = Rotation.from_euler("ZYX", rpy.reshape(-1, 3)[:, ::-1]).as_matrix()
    return np.asarray(body @ BODY_FROM_CAM).reshape(*rpy.shape[:-1], 3, 3)


def slerp_quat_wxyz(quat_a_wxyz: ArrayLike, quat_b_wxyz: ArrayLike, fraction: ArrayLike) -> Array:
    """Interpolate on the shortest arc between quaternions, (4,) or (N, 4), at fractions (N,)."""
    from scipy.spatial.transform import Rotation

    a = Rotation.from_quat(np.asarray(quat_a_wxyz, dtype=np.float64), scalar_first=True)
    b = Rotation.from_quat(np.asarray(quat_b_wxyz, dtype=np.float64), scalar_first=True)
    step = (b * a.inv()).as_rotvec()
    turned = Rotation.from_rotvec(np.atleast_1d(fraction)[:, None] * step) * a
    return canonical_quat_wxyz(turned.as_quat(scalar_first=True))
