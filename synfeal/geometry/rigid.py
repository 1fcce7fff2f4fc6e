"""Rigid motions as other programs write them: one test, one bound."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from synfeal.errors import InputError
from synfeal.geometry.rotations import Array

# Text of three decimals is the least that programs write. Rounding an entry to it changes it by
# 0.5e-3 at most, so the determinant of a rotation by 0.5e-3 times the sum of its nine absolute
# entries, at most 3 sqrt(3): 2.6e-3. Products of its rows change by less, 1.7e-3. Single precision
# makes 1e-6, and the poses of 7-Scenes, integrated in it by KinectFusion, are off by a few 1e-4. A
# scale of 0.2 % or more, a shear, a reflection and a row of another convention are beyond.
RIGID_BOUND = 3e-3


class RigidDefects(NamedTuple):
    """Distance from rigid of matrices (N, 4, 4); infinite where an entry is not finite.

    Attributes:
        orthonormal: Largest absolute entry (N) of R'R - 1.
        determinant: Absolute difference (N) of det R from +1.
        last_row: Largest absolute difference (N) of the last row from 0 0 0 1.
    """

    orthonormal: Array
    determinant: Array
    last_row: Array

    @property
    def worst(self) -> Array:
        """Largest of the three (N)."""
        return np.asarray(np.maximum.reduce(self))


def rigid_defects(matrices: ArrayLike) -> RigidDefects:
    """Measure how far matrices (N, 4, 4) are from rotations and translations."""
    matrices = np.asarray(matrices, np.float64).reshape(-1, 4, 4)
    with np.errstate(over="ignore", invalid="ignore"):
        rotation = matrices[:, :3, :3]
        gram = np.swapaxes(rotation, 1, 2) @ rotation
        orthonormal = np.abs(gram - np.eye(3)).max(axis=(1, 2))
        determinant = np.abs(np.linalg.det(rotation) - 1.0)
        last_row = np.abs(matrices[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1)
    found = (orthonormal, determinant, last_row)
    return RigidDefects(*(np.nan_to_num(each, nan=np.inf) for each in found))


def is_rigid(matrix: Array) -> bool:
    """Tell whether a matrix is (4, 4), finite, and a rotation and translation up to rounding."""
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        return False
    return bool(rigid_defects(matrix).worst[0] <= RIGID_BOUND)


def refuse_non_rigid(matrix: Array, where: object) -> None:
    """Check that a matrix (4, 4) is a rotation and a translation.

    Args:
        matrix: Pose.
        where: File or argument that it comes from, for messages.

    Raises:
        InputError: It is not.
    """
    if is_rigid(matrix):
        return
    if matrix.shape == (4, 4) and is_rigid(np.vstack([matrix[:3], [0.0, 0.0, 0.0, 1.0]])):
        raise InputError(where, "is not a rigid pose; its last row must be 0 0 0 1")
    raise InputError(where, "is not a rigid pose; its upper left 3x3 must be a rotation")
