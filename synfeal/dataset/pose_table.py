"""Tables of poses: plans, label sets and predictions share one CSV format.

Columns ``frame,path,tx,ty,tz,qw,qx,qy,qz``: frame index in its split, index of the straight path
the frame belongs to, position in metres and unit quaternion of ``world_from_cam``. Labels that were
estimated from images have a column ``registered`` after these: 1 where the frame's pose was found,
0 where it was filled in, which is nothing to learn from. Where the frames are files, a last column
``image`` names them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.geometry.limits import FARTHEST_M
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of
from synfeal.records.tables import read_numbers, write_numbers

COLUMNS = ("frame", "path", "tx", "ty", "tz", "qw", "qx", "qy", "qz")
HEADER = ",".join(COLUMNS)
REGISTERED = "registered"
IMAGE = "image"
# Further columns of poses found in a map: whether one was found, and what speaks for it.
SUPPORT = ("status", "inliers", "confidence")
# Further columns of poses that a network gave: whether it has seen the like of a picture.
SEEN = ("status", "typicality", "outside_m")
# Further columns of poses whose error is stated: radii that hold 68 and 95 % of the errors.
STATED = ("position_sd_m", "position_95_m", "orientation_sd_deg", "orientation_95_deg")
UNIT_TOLERANCE = 1e-2
FARTHEST_GUESS_M = 1e100  # a network that diverged; its square is still finite


@dataclass(frozen=True)
class PoseTable:
    """Poses of consecutive frames."""

    frame: NDArray[np.int64]  # (N,) index within the split
    path: NDArray[np.int64]  # (N,) index of the straight path
    position_m: NDArray[np.float64]  # (N, 3) camera centres in the world
    quat_wxyz: NDArray[np.float64]  # (N, 4) unit quaternions of ``world_from_cam``, w >= 0
    # the paths that the frames are of, all of their frames, where these are but a part
    whole: PoseTable | None = None
    # (N,) whether the pose of a frame was found, where poses are estimates; None: all are known
    registered: NDArray[np.bool_] | None = None

    def __len__(self) -> int:
        return len(self.frame)

    @property
    def world_from_cam(self) -> NDArray[np.float64]:
        """Poses (N, 4, 4)."""
        return pose_from_quat(self.position_m, self.quat_wxyz)

    def with_poses(self, world_from_cam: NDArray[np.float64]) -> PoseTable:
        """Return the same frames with other poses ``world_from_cam`` (N, 4, 4)."""
        return PoseTable(
            self.frame, self.path, world_from_cam[:, :3, 3].copy(), quat_wxyz_of(world_from_cam)
        )

    @property
    def usable_rows(self) -> NDArray[np.int64]:
        """Rows (M,) of the frames whose poses are more than filled in: what may be learned from."""
        if self.registered is None:
            return np.arange(len(self))
        return np.flatnonzero(self.registered)

    def between(self, start: int, stop: int) -> PoseTable:
        """Return frames ``start`` to ``stop`` (exclusive), which must all exist.

        Raises:
            ValueError: One does not.
        """
        if not 0 <= start <= stop <= len(self):
            raise ValueError(f"asked for frames {start} to {stop} of a table of {len(self)}")
        edges = np.concatenate([[0], np.flatnonzero(np.diff(self.path)) + 1, [len(self)]])
        around = slice(edges[edges <= start].max(), edges[edges >= stop].min())
        return self.at(slice(start, stop), None if self.whole else self.at(around))

    def at(self, rows: slice | NDArray[np.int64], whole: PoseTable | None = None) -> PoseTable:
        """Select frames by row."""
        return PoseTable(
            frame=self.frame[rows],
            path=self.path[rows],
            position_m=self.position_m[rows],
            quat_wxyz=self.quat_wxyz[rows],
            whole=whole or self.whole,
            registered=None if self.registered is None else self.registered[rows],
        )

    def first(self, count: int) -> PoseTable:
        """Return the first ``count`` frames: smaller data sets are prefixes of larger ones."""
        return self.between(0, count)


def write_pose_table(path: Path, table: PoseTable, images: Sequence[str] = ()) -> None:
    """Write a table with enough digits to read back the same float64 values.

    Args:
        path: File to write.
        table: Poses; a column ``registered`` is written if the table has one.
        images: Path of each frame's image below the data set, for a column ``image``; empty if the
            frames are not files.
    """
    arrays = [table.frame, table.path, *table.position_m.T, *table.quat_wxyz.T]
    header = HEADER
    if table.registered is not None:
        arrays.append(table.registered.astype(int))
        header = f"{header},{REGISTERED}"
    columns = [*(array.tolist() for array in arrays), *([images] if images else [])]
    header = f"{header},{IMAGE}" if images else header
    write_numbers(path, header, zip(*columns, strict=True))


def read_pose_table(path: Path, any_frames: bool = False) -> PoseTable:
    """Read a table written by :func:`write_pose_table`.

    Args:
        path: the file.
        any_frames: accept frames in any order and number, where nothing is paired with the rows.

    Raises:
        InputError: the file is missing, has another header, or holds anything but finite numbers,
            whole ones for frame and path, positions that a camera may have, unit quaternions, and
            0 or 1 for registered; or the frames are not 0, 1, 2, ...
    """
    values = read_numbers(path, HEADER, "pose table", passed_over=IMAGE, optional=REGISTERED)
    frame, straight_path = whole_numbers(values[:, :2], path).T
    check_places(values[:, 2:5], path, np.arange(len(values)) + 2, FARTHEST_GUESS_M)
    check_unit(values[:, 5:9], path, np.arange(len(values)) + 2)
    off = np.flatnonzero(frame != np.arange(len(frame)))
    if len(off) and not any_frames:
        row = int(off[0])
        raise InputError(
            path,
            f"line {row + 2} is of frame {frame[row]} where frame {row} must be; a row is missing,"
            " doubled or out of order: make the table again",
        )
    flags = values[:, len(COLUMNS) :]
    if not np.isin(flags, (0, 1)).all():
        bad = int(np.argmin(np.isin(flags, (0, 1)).all(axis=1)))
        raise InputError(path, f"row {bad + 2}: {REGISTERED} must be 0 or 1", "make it again")
    registered = flags[:, 0] == 1 if flags.shape[1] else None
    return PoseTable(frame, straight_path, values[:, 2:5], values[:, 5:9], registered=registered)


def read_frames(path: Path, start: int, stop: int) -> PoseTable:
    """Read the frames ``start`` to ``stop`` (exclusive) of a pose table that has as many.

    Raises:
        InputError: The table holds fewer than ``stop`` poses.
    """
    table = read_pose_table(path)
    if len(table) < stop:
        raise InputError(path, f"holds {len(table)} poses, {stop} are needed", "make it again")
    return table.between(start, stop)


def whole_numbers(values: NDArray[np.float64], path: Path) -> NDArray[np.int64]:
    """Convert the leading columns (N, C) of a table to indices: whole numbers, 0 or above.

    Raises:
        InputError: A value is something else; names its row in ``path``.
    """
    good = ((values >= 0) & (values < 2**53) & (values == np.floor(values))).all(axis=1)
    if not good.all():
        row = int(np.argmin(good)) + 2
        raise InputError(path, f"row {row} must begin with whole numbers, 0 or above")
    return values.astype(np.int64)


def check_places(
    position_m: NDArray[np.float64],
    path: Path,
    line_of: NDArray[np.int64],
    farthest_m: float = FARTHEST_M,
) -> None:
    """Refuse positions that no camera can have; what is not finite passes.

    Args:
        position_m: Positions (N, 3), world, metres.
        path: File they were read from, for messages.
        line_of: Line (N,) of the file that each stands on.
        farthest_m: Largest distance from the origin, metres.

    Raises:
        InputError: a position is farther away.
    """
    distance_m = np.abs(position_m).max(axis=1, initial=0.0)
    off = (distance_m > farthest_m) & np.isfinite(distance_m)
    if off.any():
        bad = int(np.argmax(off))
        raise InputError(
            path,
            f"line {line_of[bad]} holds a position of {distance_m[bad]:.3g} m, which is no place;"
            " repair the line",
        )


def check_unit(quat_wxyz: NDArray[np.float64], path: Path, line_of: NDArray[np.int64]) -> None:
    """Refuse quaternions that are not of unit length, but for rounding to few digits.

    Args:
        quat_wxyz: Quaternions (N, 4), in any order.
        path: File they were read from, for messages.
        line_of: Line (N,) of the file that each stands on.

    Raises:
        InputError: A length is off by more than ``UNIT_TOLERANCE``.
    """
    with np.errstate(over="ignore"):
        length = np.linalg.norm(quat_wxyz, axis=1)
    off = np.abs(length - 1.0) > UNIT_TOLERANCE
    if off.any():
        bad = int(np.argmax(off))
        raise InputError(
            path,
            f"line {line_of[bad]} holds a quaternion of length {length[bad]:.3g}; a rotation has"
            " length 1",
        )


def write_first_frames(plan: Path, n_frames: int, out_labels: Path) -> None:
    """Write the first frames of a pose table as a pose table of their own."""
    write_pose_table(out_labels, read_frames(plan, 0, n_frames))
