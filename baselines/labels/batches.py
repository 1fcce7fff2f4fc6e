"""Batches of section 4.1: division of a split, links to its images, estimated trajectories.

A trajectory is stored as CSV with columns ``frame,registered,tx,ty,tz,qw,qx,qy,qz``; frames count
from 0 inside the batch, positions are in metres and rotations unit quaternions of
``first_from_cam``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig
from synfeal.dataset import images
from synfeal.dataset.frame_files import FrameFile, link_or_unpack
from synfeal.dataset.pose_table import check_unit, whole_numbers
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of
from synfeal.records.tables import read_numbers, write_numbers

COLLECT_AGAIN = "; collect the data set again"


@dataclass(frozen=True)
class Batch:
    """A run of consecutive frames that is estimated on its own.

    Attributes:
        index: Position of the batch in its split.
        start: First frame, which is also the last frame of the batch before.
        stop: One past the last frame.
    """

    index: int
    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start


def batches_of(n_frames: int, batch_frames: int) -> list[Batch]:
    """Cut a split into batches: batch b holds frames b*B to (b+1)*B, both included, cut at the end.

    Every batch adds at most ``batch_frames`` frames to the one it shares with the batch before, and
    every batch has at least two frames. A split of one frame has no batch: its pose is the anchor.

    Raises:
        ValueError: ``n_frames`` or ``batch_frames`` is below 1.
    """
    if n_frames < 1 or batch_frames < 1:
        raise ValueError(
            f"need at least one frame and batch_frames >= 1: {n_frames}, {batch_frames}"
        )
    last = n_frames - 1
    starts = range(0, last, batch_frames)
    return [
        Batch(index, start, min(start + batch_frames, last) + 1)
        for index, start in enumerate(starts)
    ]


HEADER = "frame,registered,tx,ty,tz,qw,qx,qy,qz"


@dataclass(frozen=True)
class BatchTrajectory:
    """Estimated motion inside one batch.

    Attributes:
        first_from_cam: (n, 4, 4) poses relative to the first frame; where a frame is not registered
            the entry is the identity and means nothing.
        registered: (n,) whether the method found the frame's pose.
    """

    first_from_cam: NDArray[np.float64]
    registered: NDArray[np.bool_]

    def __post_init__(self) -> None:
        n = len(self.registered)
        if self.first_from_cam.shape != (n, 4, 4):
            raise ValueError(f"{n} flags for poses of shape {self.first_from_cam.shape}")

    def __len__(self) -> int:
        return len(self.registered)


def failed_trajectory(n_frames: int) -> BatchTrajectory:
    """Return the result of a method that found nothing in ``n_frames`` frames."""
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
        raise InputError(path, "frames must count from 0, registered be 0 or 1", "estimate again")
    check_unit(values[:, 5:9], path, np.arange(len(values)) + 2)
    return BatchTrajectory(pose_from_quat(values[:, 2:5], values[:, 5:9]), values[:, 1] == 1)


def read_image(path: FrameFile, camera: CameraConfig, mode: str | None = None) -> NDArray[Any]:
    """Read an image and check that it has the camera's size.

    Args:
        path: Image file, on its own or inside an archive.
        camera: Camera whose width and height the image must have.
        mode: Pillow mode to convert to, such as ``RGB`` or ``L``; None keeps the file's own.

    Returns:
        Pixels (H, W) or (H, W, C), in the type of the file's mode.

    Raises:
        InputError: it is missing, cannot be read, or has another size.
    """
    size = (camera.width, camera.height)
    return np.asarray(images.read_image(path, mode, size=size, remedy=COLLECT_AGAIN))


def link_images(color_paths: Sequence[FrameFile], camera: CameraConfig, directory: Path) -> None:
    """Link frames into a new directory, under names that sort in the order of the frames.

    Each image is read first: COLMAP silently leaves out one that it cannot read, which would then
    look like a frame without texture.

    Args:
        color_paths: Colour images in order; those in an archive are unpacked instead of linked.
        camera: Camera whose size they must have.
        directory: Directory to create; it must not exist yet.

    Raises:
        InputError: as :func:`read_image`.
    """
    directory.mkdir()
    for frame, path in enumerate(color_paths):
        read_image(path, camera)
        link_or_unpack(path, directory / f"{frame:06d}{path.suffix}")
