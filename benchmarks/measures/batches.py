"""Frames of a batch, and how far estimated poses are from the true ones."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from synfeal.config.models import CameraConfig, GroundTruthConfig, Strict
from synfeal.dataset.sevenscenes import read_pose
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, relative

Array = NDArray[np.float64]


class BatchCase(Strict):
    """A batch of a 7-Scenes sequence and the settings that estimate its poses."""

    sequence: Path = Field(description="directory of frame-XXXXXX.{color.png,depth.png,pose.txt}")
    start: int = Field(0, description="first frame")
    every: int = Field(
        1, description="frames of the sequence from one frame of the batch to the next"
    )
    length: int = Field(251, description="frames of the batch")
    groundtruth_camera: CameraConfig = Field(description="camera of the frames")
    groundtruth: GroundTruthConfig = Field(description="settings of the methods")


class BatchFiles(NamedTuple):
    """Files of a batch, and the true poses (N, 4, 4)."""

    color: list[Path]
    depth: list[Path]
    world_from_cam: Array


def open_batch(case: BatchCase) -> BatchFiles:
    """The frames of a case.

    Raises:
        InputError: the sequence is shorter.
    """
    numbers = range(case.start, case.start + case.every * case.length, case.every)
    color, depth, poses = (
        [case.sequence / f"frame-{number:06d}.{kind}" for number in numbers]
        for kind in ("color.png", "depth.png", "pose.txt")
    )
    if not poses[-1].exists():
        raise InputError(
            f"{poses[-1]}: is missing; give a longer sequence, or lower start or length"
        )
    return BatchFiles(color, depth, np.array([read_pose(path) for path in poses]))


def errors(name: str, first_from_cam: Array, world_from_cam: Array) -> dict[str, float]:
    """Median, largest and last error of poses (N, 4, 4) relative to the first: metres, degrees."""
    true = relative(world_from_cam[0], world_from_cam)
    error_m, error_rad = pose_error(first_from_cam, true)
    measured = {}
    for unit, values in (("m", error_m), ("deg", np.degrees(error_rad))):
        measured[f"{name}_median_{unit}"] = float(np.median(values))
        measured[f"{name}_max_{unit}"] = float(values.max())
        measured[f"{name}_last_{unit}"] = float(values[-1])
    return measured
