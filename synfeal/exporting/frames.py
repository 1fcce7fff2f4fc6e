"""Frames of a data set with poses, splits and camera: the input of every exporter.

An exporter is called with an :class:`ExportSet`, an empty directory to fill, and a
:data:`Place` that puts images there.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import MILLIMETRES, read_depth_m
from synfeal.dataset.frame_files import FrameFile, encode_png
from synfeal.dataset.frame_poses import compare_tables, read_poses, rigid_problems
from synfeal.dataset.images import image_size
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.sequence_listing import (
    COLOR,
    DEPTH,
    RIGHT_COLOR,
    RIGHT_DEPTH,
    Frame,
    frames_of,
    kinds_of,
    list_sequences,
    name_problems,
)
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.dataset.split_frames import read_splits, split_problems
from synfeal.errors import InputError
from synfeal.geometry.poses import moved_right

RIGHT = "-right"
# Links or copies the image of a frame; without a target it only counts the frame as written.
Place = Callable[[FrameFile, Path | None], None]

log = logging.getLogger("synfeal")


@dataclass(frozen=True)
class ExportFrame:
    """One frame of a data set."""

    frame: Frame  # its files
    world_from_cam: NDArray[np.float64]  # (4, 4)
    split: str | None  # ``train`` or ``test``; None where the data set has no splits
    is_right: bool = False  # whether it is that of the right camera of a stereo pair

    @property
    def sequence(self) -> str:
        """Name of the sequence; right images are a sequence of their own, ``seq-01-right``."""
        return self.frame.sequence.stem + RIGHT * self.is_right

    @property
    def color(self) -> FrameFile:
        """The colour image."""
        return self.frame.path(RIGHT_COLOR if self.is_right else COLOR)

    @property
    def depth(self) -> FrameFile:
        """The depth image, which need not exist."""
        return self.frame.path(RIGHT_DEPTH if self.is_right else DEPTH)

    @property
    def stem(self) -> str:
        """``frame-000000``, the same for both images of a stereo pair."""
        return f"frame-{self.frame.number:06d}"


@dataclass(frozen=True)
class ExportSet:
    """A data set as exporters take it."""

    path: Path
    camera: CameraConfig
    frames: tuple[ExportFrame, ...]
    has_depth: bool
    has_splits: bool

    def of_split(self, split: str) -> Iterator[ExportFrame]:
        """Yield the frames of a split, in order."""
        return (frame for frame in self.frames if frame.split == split)


def read_export_set(dataset: Path, camera_file: Path | None) -> ExportSet:
    """Read the frames of a data set, all of which must be there with rigid poses.

    Without ``camera_file``, a calibration, the manifest says which camera.

    Raises:
        InputError: frames or poses are missing or damaged, splits contradict each other, or the
            camera is not known.
    """
    sequences = list_sequences(dataset)
    camera = camera_of_dataset(dataset, camera_file)
    if camera.assumed:
        raise InputError(
            dataset / "manifest.json",
            "missing, so the camera is not known",
            "give `camera=FILE`",
        )
    splits, split_failures = read_splits(dataset, sequences)
    poses, unreadable = read_poses(sequences)
    problems = (*name_problems(sequences), *unreadable, *rigid_problems(poses))
    if any((dataset / name).exists() for name in SPLIT_FILES.values()):
        problems += split_problems(dataset, sequences, splits, split_failures)
        problems += compare_tables(dataset, poses, splits).problems
    split_of = {s.path: split for split, listed in splits.items() for s in listed}
    if problems:
        raise InputError(f"{problems[0]}; synfeal validate says more")
    frames = tuple(
        ExportFrame(frame, poses[frame], split_of.get(frame.sequence))
        for frame in frames_of(sequences)
    )
    if camera.config.stereo_baseline_m is not None and RIGHT_COLOR in kinds_of(sequences):
        frames += tuple(
            ExportFrame(
                left.frame,
                moved_right(left.world_from_cam, camera.config.stereo_baseline_m),
                left.split,
                is_right=True,
            )
            for left in frames
        )
    width, height = image_size(frames[0].color)
    if (width, height) != (camera.config.width, camera.config.height):
        raise InputError(
            str(frames[0].color),
            f"is {width} x {height}, the camera is {camera.config.width} x {camera.config.height}",
            "give the camera of these images with `camera`",
        )
    has_depth = DEPTH in kinds_of(sequences)
    return ExportSet(dataset, camera.config, frames, has_depth, bool(splits))


def need_splits(data: ExportSet) -> None:
    """Refuse a data set that does not say which frames are for training, and which for test."""
    for split, name in SPLIT_FILES.items():
        if next(data.of_split(split), None) is None:
            raise InputError(data.path / name, f"lists no frame; this format needs {split} frames")


def need_perspective(data: ExportSet, program: str) -> None:
    """Refuse a fisheye or a panorama where a format has no such camera."""
    if data.camera.projection is not None:
        raise InputError(
            data.path,
            f"{program} knows perspective cameras, and this one is {data.camera.projection}",
            "export to colmap or nerfstudio",
        )


def frame_name(frame: ExportFrame) -> str:
    """Return the name of an image below ``images``."""
    return f"{frame.sequence}/{frame.stem}.{COLOR}"


def write_lines(path: Path, lines: Iterable[str]) -> None:
    """Write a text file, and the directory it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def rewrite_depth(source: FrameFile, target: Path, units_per_m: float = MILLIMETRES) -> float:
    """Write a depth image in other units.

    Args:
        source: 16-bit PNG in units of its own, 0 or 65535 where there is no depth.
        target: 16-bit PNG to write, 0 where there is no depth or it is beyond 65535 units.
        units_per_m: Units of ``target`` per metre.

    Returns:
        Share of the known depths that are beyond 65535 units.
    """
    depth_m = read_depth_m(source)
    known = np.isfinite(depth_m)
    units = np.round(depth_m.astype(np.float64) * units_per_m)
    fits = known & (units <= 65535)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(encode_png(np.where(fits, units, 0).astype(np.uint16)))
    n_known = int(np.count_nonzero(known))
    return 1.0 - int(np.count_nonzero(fits)) / n_known if n_known else 0.0


def warn_of_lost(lost: float, n_frames: int, units_per_m: float, whose: str) -> None:
    """Say which share of the depths a format cannot hold.

    Args:
        lost: Sum of what :func:`rewrite_depth` returned.
        n_frames: Number of frames.
        units_per_m: Units of the format per metre.
        whose: Whose images they are.
    """
    if lost:
        log.warning(
            "%.2g%% of the depths are beyond %.1f m, more than %s images hold: now 0",
            100 * lost / n_frames,
            65535 / units_per_m,
            whose,
        )
