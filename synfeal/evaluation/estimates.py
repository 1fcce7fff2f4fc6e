"""Poses as a file holds them, before it is settled which frames they are of and what they map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import UNIT_TOLERANCE
from synfeal.geometry.poses import inverse, pose_from_quat

Array = NDArray[np.float64]
Direction = Literal["world_from_cam", "cam_from_world"]
Order = Literal["wxyz", "xyzw"]


class Convention(NamedTuple):
    """What a pose maps, and the order of its quaternion."""

    direction: Direction
    order: Order

    def __str__(self) -> str:
        return f"{self.direction}-{self.order}"


CONVENTIONS = {
    str(c): c for c in (Convention(d, o) for d in get_args(Direction) for o in get_args(Order))
}


@dataclass(frozen=True)
class Estimates:
    """Poses read from a file or a directory.

    Attributes:
        kind: what it was read as, e.g. ``an ACE result file``.
        convention: that of ``kind``, which is how its poses are taken.
        names: (N) what each pose is called, or the index of its frame.
        places: (N) where each stands, for messages.
        translation: (N, 3) fourth columns of the matrices.
        quat: (N, 4) quaternions in the order of ``convention``; not a number where a matrix is no
            rotation.
        ordered: names are indices of frames within the split (our own tables).
    """

    kind: str
    convention: Convention
    names: tuple[str, ...]
    places: tuple[str, ...]
    translation: Array
    quat: Array
    ordered: bool = False

    def is_rotation(self) -> NDArray[np.bool_]:
        """Which poses (N,) are finite with a quaternion of unit length."""
        with np.errstate(over="ignore", invalid="ignore"):
            off = np.abs(np.linalg.norm(self.quat, axis=1) - 1.0)
        return np.asarray(np.isfinite(self.translation).all(axis=1) & (off <= UNIT_TOLERANCE))

    def world_from_cam(self, convention: Convention) -> Array:
        """Poses (N, 4, 4); not a number where there is no rotation."""
        good = self.is_rotation()
        quat_wxyz = self.quat if convention.order == "wxyz" else np.roll(self.quat, 1, axis=1)
        matrices = np.full((len(good), 4, 4), np.nan)
        matrices[good] = pose_from_quat(self.translation[good], quat_wxyz[good])
        return matrices if convention.direction == "world_from_cam" else inverse(matrices)
