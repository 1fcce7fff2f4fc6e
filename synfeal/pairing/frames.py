"""The frames of a data set whose depth says what they see: from our own sets and 7-Scenes."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.depth_agreement import PosedDepth
from synfeal.dataset.frame_poses import read_poses, rigid_problems
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.sequence_listing import (
    COLOR,
    DEPTH,
    Frame,
    kinds_of,
    list_sequences,
    name_problems,
)
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.dataset.split_frames import read_splits, split_problems
from synfeal.errors import InputError

log = logging.getLogger("synfeal")


@dataclass(frozen=True)
class DepthFrames:
    """Frames with depth and poses.

    Attributes:
        frames: Their files.
        splits: ``train`` or ``test`` of each; empty where the data set has no splits.
        world_from_cam: Poses (N, 4, 4).
        camera: Camera of the depth images.
        is_color: Whether it is that of the colour images, too.
    """

    frames: tuple[Frame, ...]
    splits: tuple[str, ...]
    world_from_cam: NDArray[np.float64]
    camera: CameraConfig
    is_color: bool

    def __len__(self) -> int:
        return len(self.frames)

    def image(self, index: int) -> str:
        """Return the name of a colour image in the data set."""
        return f"{self.frames[index].name}.{COLOR}"

    @property
    def posed_depth(self) -> PosedDepth:
        """Depth and poses, to be checked against each other."""
        return PosedDepth(
            files=[frame.path(DEPTH) for frame in self.frames],
            read_m=self.depth_m,
            world_from_cam=self.world_from_cam,
            camera=self.camera,
            depth_from_cam=np.eye(4),
        )

    def depth_m(self, index: int) -> NDArray[np.float32]:
        """Read depth (H, W) of a frame in metres, inf for nothing.

        Raises:
            InputError: The image is missing, damaged, or of another size than the camera.
        """
        return read_depth_m(
            self.frames[index].path(DEPTH),
            size=(self.camera.width, self.camera.height),
            remedy="; give the camera of these images with `camera`",
        )


def read_depth_frames(
    dataset: Path, splits: Sequence[str], camera_file: Path | None, every: int
) -> DepthFrames:
    """List the frames of a data set; depth is read later.

    Args:
        dataset: Its directory.
        splits: Splits to take frames of, if the data set has any.
        camera_file: A calibration in place of the manifest's camera.
        every: Take every such frame of each sequence.

    Raises:
        InputError: A frame lacks a file, poses are not rigid, splits are contradictory, or there
            is no depth.
    """
    sequences = list_sequences(dataset)
    if DEPTH not in kinds_of(sequences):
        raise InputError(dataset, "has no depth images", "collect it with `depth=True`")
    camera = camera_of_dataset(dataset, camera_file)
    if camera.assumed:
        log.warning("%s: says nothing of its camera; that of 7-Scenes is assumed", dataset)
    poses, unreadable = read_poses(sequences)
    problems = (*name_problems(sequences), *unreadable, *rigid_problems(poses))
    split_of: dict[Path, str] = {}
    if any((dataset / name).exists() for name in SPLIT_FILES.values()):
        listed, split_failures = read_splits(dataset, sequences)
        problems += split_problems(dataset, sequences, listed, split_failures)
        split_of = {s.path: split for split, own in listed.items() for s in own}
    if problems:
        raise InputError(f"{problems[0]}; synfeal validate says more")
    frames = tuple(
        frame
        for sequence in sequences
        if not split_of or split_of[sequence.path] in splits
        for frame in sequence.frames[::every]
    )
    return DepthFrames(
        frames=frames,
        splits=tuple(split_of.get(frame.sequence, "") for frame in frames),
        world_from_cam=np.array([poses[frame] for frame in frames]).reshape(-1, 4, 4),
        camera=camera.depth,
        is_color=camera.of_depth is None,
    )
