"""What a method estimates for one batch: poses relative to the batch's first frame.

Stored as CSV with columns ``frame,registered,tx,ty,tz,qw,qx,qy,qz``; frames count from 0 inside the
batch, positions are in metres and rotations unit quaternions of ``first_from_cam``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.number_table import read_numbers, write_numbers
from synfeal.dataset.pose_table import check_unit, whole_numbers
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of

COLUMNS = ("frame", "registered", "tx", "ty", "tz", "qw", "qx", "qy", "qz")
HEADER = ",".join(COLUMNS)


@dataclass(frozen=True)
class BatchTrajectory:
    """Estimated motion inside one batch."""

    # (n, 4, 4) poses relative to the first frame; where a frame is not registered the entry is the
    # identity and means nothing
    first_from_cam: NDArray[np.float64]
    registered: NDArray[np.bool_]  # (n,) whether the method found the frame's pose

    def __post_init__(self) -> None:
        n = len(self.registered)
        if self.first_from_cam.shape != (n, 4, 4):
            raise ValueError(f"{n} flags for poses of shape {self.first_from_cam.shape}")

    def __len__(self) -> int:
        return len(self.registered)


def failed_trajectory(n_frames: int) -> BatchTrajectory:
    """The result of a method that found nothing in ``n_frames`` frames."""
    return BatchTrajectory(np.tile(np.eye(4), (n_frames, 1, 1)), np.zeros(n_frames, dtype=bool))


def write_trajectory(path: Path, trajectory: BatchTrajectory) -> None:
    """Write the trajectory with enough digits to read back the same positions and quaternions."""
    pose = trajectory.first_from_cam
    numbers = np.hstack([pose[:, :3, 3], quat_wxyz_of(pose)]).tolist()
    flags = trajectory.registered.astype(int).tolist()
    rows = enumerate(zip(flags, numbers, strict=True))
    write_numbers(path, HEADER, ([frame, flag, *row] for frame, (flag, row) in rows))


def read_trajectory(path: Path) -> BatchTrajectory:
    """Read a file written by :func:`write_trajectory`.

    Raises:
        InputError: the file is missing, has another header, or holds anything but finite numbers,
            frames counted from 0, flags 0 or 1, and unit quaternions.
    """
    values = read_numbers(path, HEADER, "batch trajectory")
    frame, registered = whole_numbers(values[:, :2], path).T
    if (frame != np.arange(len(frame))).any() or (registered > 1).any():
        raise InputError(f"{path}: frames must count from 0, registered be 0 or 1; estimate again")
    check_unit(values[:, 5:9], path, np.arange(len(values)) + 2)
    return BatchTrajectory(pose_from_quat(values[:, 2:5], values[:, 5:9]), values[:, 1] == 1)
