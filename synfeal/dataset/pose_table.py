"""Tables of poses: plans, label sets and predictions are all one CSV format.

Columns ``frame,path,tx,ty,tz,qw,qx,qy,qz``: frame index in its split, index of the straight path
the frame belongs to, position in metres and unit quaternion of ``world_from_cam``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.number_table import read_numbers, write_numbers
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of

COLUMNS = ("frame", "path", "tx", "ty", "tz", "qw", "qx", "qy", "qz")
HEADER = ",".join(COLUMNS)


@dataclass(frozen=True)
class PoseTable:
    """Poses of consecutive frames.

    Attributes:
        frame: (N,) index within the split.
        path: (N,) index of the straight path.
        position_m: (N, 3) camera centres in the world.
        quat_wxyz: (N, 4) unit quaternions of ``world_from_cam``, w >= 0.
    """

    frame: NDArray[np.int64]
    path: NDArray[np.int64]
    position_m: NDArray[np.float64]
    quat_wxyz: NDArray[np.float64]

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
        part = slice(start, stop)
        return PoseTable(
            self.frame[part], self.path[part], self.position_m[part], self.quat_wxyz[part]
        )

    def first(self, count: int) -> PoseTable:
        """The first ``count`` frames: smaller data sets are prefixes of larger ones."""
        return self.between(0, count)


def write_pose_table(path: Path, table: PoseTable) -> None:
    """Write the table with enough digits to read back the same float64 values."""
    columns = [table.frame, table.path, *table.position_m.T, *table.quat_wxyz.T]
    write_numbers(path, HEADER, zip(*(c.tolist() for c in columns), strict=True))


def read_pose_table(path: Path) -> PoseTable:
    """Read a table written by :func:`write_pose_table`.

    Raises:
        InputError: the file is missing, has another header, or holds anything but finite numbers.
    """
    values = read_numbers(path, HEADER, "pose table")
    index = values[:, :2].astype(np.int64)
    return PoseTable(index[:, 0], index[:, 1], values[:, 2:5], values[:, 5:9])
