"""Tables of poses: plans, label sets and predictions are all one CSV format.

Columns ``frame,path,tx,ty,tz,qw,qx,qy,qz``: frame index in its split, index of the straight path
the frame belongs to, position in metres and unit quaternion of ``world_from_cam``. Where the frames
are files, a last column ``image`` names them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.frames import read_numbers, write_numbers
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of

COLUMNS = ("frame", "path", "tx", "ty", "tz", "qw", "qx", "qy", "qz")
HEADER = ",".join(COLUMNS)
IMAGE = "image"
UNIT_TOLERANCE = 1e-2


@dataclass(frozen=True)
class PoseTable:
    """Poses of consecutive frames."""

    frame: NDArray[np.int64]  # (N,) index within the split
    path: NDArray[np.int64]  # (N,) index of the straight path
    position_m: NDArray[np.float64]  # (N, 3) camera centres in the world
    quat_wxyz: NDArray[np.float64]  # (N, 4) unit quaternions of ``world_from_cam``, w >= 0
    # the paths that the frames are of, all of their frames, where these are but a part
    whole: PoseTable | None = None

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def world_from_cam(self) -> NDArray[np.float64]:
        """Poses (N, 4, 4)."""
        return pose_from_quat(self.position_m, self.quat_wxyz)

    def with_poses(self, world_from_cam: NDArray[np.float64]) -> PoseTable:
        """The same frames with other poses (N, 4, 4)."""
        return PoseTable(
            self.frame, self.path, world_from_cam[:, :3, 3].copy(), quat_wxyz_of(world_from_cam)
        )

    def between(self, start: int, stop: int) -> PoseTable:
        """Frames ``start`` to ``stop`` (exclusive), which must all exist."""
        if not 0 <= start <= stop <= len(self):
            raise ValueError(f"asked for frames {start} to {stop} of a table of {len(self)}")
        edges = np.concatenate([[0], np.flatnonzero(np.diff(self.path)) + 1, [len(self)]])
        around = slice(edges[edges <= start].max(), edges[edges >= stop].min())
        return self.at(slice(start, stop), None if self.whole else self.at(around))

    def at(self, rows: slice | NDArray[np.int64], whole: PoseTable | None = None) -> PoseTable:
        """Some of the frames, by row."""
        columns = (self.frame[rows], self.path[rows], self.position_m[rows], self.quat_wxyz[rows])
        return PoseTable(*columns, whole or self.whole)

    def first(self, count: int) -> PoseTable:
        """The first ``count`` frames: smaller data sets are prefixes of larger ones."""
        return self.between(0, count)


def write_pose_table(path: Path, table: PoseTable, images: Sequence[str] = ()) -> None:
    """Write the table with enough digits to read back the same float64 values.

    ``images`` are names of the frames' images, if they are files.
    """
    arrays = [table.frame, table.path, *table.position_m.T, *table.quat_wxyz.T]
    columns = [*(array.tolist() for array in arrays), *([images] if images else [])]
    header = f"{HEADER},{IMAGE}" if images else HEADER
    write_numbers(path, header, zip(*columns, strict=True))


def read_pose_table(path: Path) -> PoseTable:
    """Read a table written by :func:`write_pose_table`.

    Raises:
        InputError: the file is missing, has another header, or holds anything but finite numbers,
            whole ones for frame and path, and unit quaternions.
    """
    values = read_numbers(path, HEADER, "pose table", passed_over=IMAGE)
    frame, straight_path = whole_numbers(values[:, :2], path).T
    check_unit(values[:, 5:9], path, np.arange(len(values)) + 2)
    return PoseTable(frame, straight_path, values[:, 2:5], values[:, 5:9])


def read_frames(path: Path, start: int, stop: int) -> PoseTable:
    """Frames ``start`` to ``stop`` (exclusive) of a pose table, which must have as many."""
    table = read_pose_table(path)
    if len(table) < stop:
        raise InputError(f"{path}: holds {len(table)} poses, {stop} are needed; make it again")
    return table.between(start, stop)


def whole_numbers(values: NDArray[np.float64], path: Path) -> NDArray[np.int64]:
    """The leading columns (N, C) of a table as indices: whole numbers, 0 or above."""
    good = ((values >= 0) & (values < 2**53) & (values == np.floor(values))).all(axis=1)
    if not good.all():
        row = int(np.argmin(good)) + 2
        raise InputError(f"{path}: row {row} must begin with whole numbers, 0 or above")
    return values.astype(np.int64)


def check_unit(quat_wxyz: NDArray[np.float64], path: Path, line_of: NDArray[np.int64]) -> None:
    """Refuse quaternions (N, 4) that are not of unit length; files of others hold few digits."""
    with np.errstate(over="ignore"):
        length = np.linalg.norm(quat_wxyz, axis=1)
    off = np.abs(length - 1.0) > UNIT_TOLERANCE
    if off.any():
        bad = int(np.argmax(off))
        raise InputError(
            f"{path}: line {line_of[bad]} holds a quaternion of length {length[bad]:.3g};"
            " a rotation has length 1"
        )


def write_first_frames(plan: Path, n_frames: int, out_labels: Path) -> None:
    """Write the first frames of a pose table as one of their own."""
    write_pose_table(out_labels, read_frames(plan, 0, n_frames))
