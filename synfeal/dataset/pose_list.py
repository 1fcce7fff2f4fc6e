"""Poses as read from a file: which frames they are of, and by which convention they are meant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_table import UNIT_TOLERANCE
from synfeal.geometry.axes import CameraAxes, with_our_axes
from synfeal.geometry.poses import inverse, pose_from_quat

Array = NDArray[np.float64]
Direction = Literal["world_from_cam", "cam_from_world"]
Order = Literal["wxyz", "xyzw"]
# How a pose says which frame it is of: a name, a time in seconds, or the index of the frame
# within the split.
FrameKey = Literal["name", "time", "index"]
KITTI = "KITTI poses"


class Convention(NamedTuple):
    """Direction of a pose, the order of its quaternion, and the axes of its camera."""

    direction: Direction
    order: Order
    axes: CameraAxes = "opencv"

    def __str__(self) -> str:
        name = f"{self.direction}-{self.order}"
        return name if self.axes == "opencv" else f"{name}-{self.axes}"


AXES: tuple[CameraAxes, ...] = ("opencv", "opengl")
CONVENTIONS = {
    str(c): c
    for c in (
        Convention(direction, order, axes)
        for axes in AXES
        for direction in get_args(Direction)
        for order in get_args(Order)
    )
}
# What a format says, but of cameras with OpenGL's axes.
OPENGL = "opengl"


def named_convention(name: str | None, of_format: Convention) -> Convention:
    """Find the convention that ``--convention`` names; None stands for that of the format."""
    if name is None:
        return of_format
    return of_format._replace(axes="opengl") if name == OPENGL else CONVENTIONS[name]


@dataclass(frozen=True)
class PoseList:
    """Poses read from a file or a directory."""

    kind: str  # what it was read as, e.g. ``an ACE result file``.
    convention: Convention  # that of ``kind``, which is how its poses are taken
    names: tuple[str, ...]  # (N) what ``frame_key`` says: names, seconds or indices
    places: tuple[str, ...]  # (N) where each stands, for messages
    translation: Array  # (N, 3) fourth columns of the matrices
    # (N, 4) quaternions in the order of ``convention``; not a number where a matrix is no rotation
    quat: Array
    frame_key: FrameKey = "name"
    of_matrices: bool = False  # whether the file has matrices in place of quaternions
    # (N, 4) radii that the file states, columns of ``STATED``, NaN where it states none; None of a
    # file without these columns
    stated: Array | None = None
    # whether there is a row for every frame that was to be localized, found or not
    names_all_asked: bool = False

    @property
    def counts_seconds(self) -> bool:
        """Check whether times are 0, 1, 2, ..., in one sequence or each.

        They may then be numbers of frames, which somebody wrote where seconds should be.
        """
        if self.frame_key != "time" or len(self.names) < 2:
            return False
        stamps = [name.rpartition("/")[2] for name in self.names]
        seconds = np.array(stamps, np.float64)
        if seconds[0] != 0.0 or not np.isfinite(seconds).all():
            return False
        onwards = np.diff(seconds) == 1.0
        return bool(onwards.any() and (onwards | (seconds[1:] == 0.0)).all())

    def world_from_cam(self, convention: Convention) -> Array:
        """Return poses (N, 4, 4), read by a convention; NaN where there is no rotation."""
        with np.errstate(over="ignore", invalid="ignore"):
            off = np.abs(np.linalg.norm(self.quat, axis=1) - 1.0)
        good = np.isfinite(self.translation).all(axis=1) & (off <= UNIT_TOLERANCE)
        quat_wxyz = self.quat if convention.order == "wxyz" else np.roll(self.quat, 1, axis=1)
        matrices = np.full((len(good), 4, 4), np.nan)
        matrices[good] = pose_from_quat(self.translation[good], quat_wxyz[good])
        poses = matrices if convention.direction == "world_from_cam" else inverse(matrices)
        return with_our_axes(poses, convention.axes)
