"""Sequences of posed photographs: their files and poses, paired by frame.

Three layouts are read:

- A flat folder, as one sequence of 7-Scenes is: ``frame-000000.color.png`` (or ``.jpg``),
  ``frame-000000.depth.png``, ``frame-000000.pose.txt``.
- A folder of such sequences, ``seq-01``, ``seq-02``, ..., each a folder or a ``.zip``.
- TUM RGB-D ("File Formats of the RGB-D benchmark"): ``rgb.txt``, ``depth.txt`` and
  ``groundtruth.txt``, which give files and poses by time stamp.

Files belong together by name and nothing else; a gap is an error, not a shift of all that follows.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import (
    SUFFIX,
    FrameFile,
    frame_file,
    is_archive,
    sequence_at,
    sequence_names,
)
from synfeal.dataset.poses_in import read_trajectory
from synfeal.dataset.sevenscenes import pose_file_text, read_pose
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import interpolate
from synfeal.geometry.rigid import refuse_non_rigid
from synfeal.records.files import lies_in, read_text

COLOR_SUFFIXES = ("png", "jpg", "jpeg")
FRAME = re.compile(r"frame-(\d+)\.(color\.(?:png|jpg|jpeg)|depth\.png|pose\.txt)")
RGB_LIST, DEPTH_LIST, TRAJECTORY = "rgb.txt", "depth.txt", "groundtruth.txt"
# Largest distance in time between a photograph and its depth image, and between a photograph and
# each of the two poses it lies between: what the benchmark's own ``associate.py`` takes, and ten
# poses of its motion capture.
DEPTH_SLACK_S, POSE_SLACK_S = 0.02, 0.1
SAME_TIME_S = 1e-4  # what times are rounded to in other people's files

log = logging.getLogger("synfeal")
Array = NDArray[np.float64]


@dataclass(frozen=True)
class PosedFrames:
    """Photographs of one or more sequences, in order.

    Attributes:
        names: One for each frame: ``frame-000000``, ``seq-01/frame-000000``, or the time stamp of
            the photograph in a TUM sequence.
        color: Colour images.
        depth: Depth images, None for all frames of a sequence that has none.
        world_from_cam: Poses (N, 4, 4), finite and rigid.
    """

    names: tuple[str, ...]
    color: tuple[FrameFile, ...]
    depth: tuple[FrameFile | None, ...]
    world_from_cam: Array

    def __len__(self) -> int:
        return len(self.names)

    @property
    def has_depth(self) -> bool:
        """True where every frame has a depth image."""
        return all(file is not None for file in self.depth)

    def __getitem__(self, frames: slice) -> PosedFrames:
        """Take some of the frames."""
        return PosedFrames(
            names=self.names[frames],
            color=self.color[frames],
            depth=self.depth[frames],
            world_from_cam=self.world_from_cam[frames],
        )


def is_tum(path: Path) -> bool:
    """Tell whether a folder is a sequence of the TUM RGB-D benchmark."""
    return (path / RGB_LIST).is_file() and (path / TRAJECTORY).is_file()


def read_posed_sequence(path: Path, frames: slice | None = None) -> PosedFrames:
    """Read which files and poses a sequence has; images are not opened.

    Args:
        path: Folder (or ``.zip``) of frames, folder of ``seq-XX``, or TUM RGB-D sequence.
        frames: Which frames, counted in order over all sequences, from 0; None for all. Only these
            need to be whole.

    Returns:
        The frames. Those whose pose is not finite, which 7-Scenes' own tools write where tracking
        was lost, are left out with a warning.

    Raises:
        InputError: It is no such sequence, a frame lacks a file, a pose is not rigid, or there is
            no frame in the range.
    """
    if not path.is_dir() and not (is_archive(path) and path.is_file()):
        raise InputError(path, "is not a folder", "give the folder of a posed sequence")
    if path.is_dir() and is_tum(path):
        return _chosen(_read_tum(path), frames, path)
    listed = _listed(path)
    chosen = listed if frames is None else listed[frames]
    if not chosen:
        raise InputError(
            path,
            f"has {len(listed)} frames, none of them in the range asked for; frames are counted"
            " from 0",
        )
    return _read_frames(chosen)


@dataclass(frozen=True)
class _Entry:
    """The files that one frame number has."""

    sequence: Path
    prefix: str  # before its number: ``seq-01/`` or nothing
    number: str  # as it is written, ``000000``
    files: dict[str, str]  # by kind: color, depth, pose

    @property
    def name(self) -> str:
        return f"{self.prefix}frame-{self.number}"

    def file(self, kind: str) -> FrameFile:
        """Return the file of one kind, which must exist.

        Raises:
            InputError: It is missing.
        """
        if kind not in self.files:
            endings = {"color": "color.png (or .jpg)", "depth": "depth.png", "pose": "pose.txt"}
            missing = frame_file(self.sequence, f"frame-{self.number}.{endings[kind]}")
            raise InputError(
                missing,
                "missing, other files of this frame are there",
                "copy the sequence again or delete the rest of the frame",
            )
        return frame_file(self.sequence, self.files[kind])


def _listed(path: Path) -> list[_Entry]:
    """List all frames of which any file exists, in order, sequence after sequence."""
    if is_archive(path):
        entries = _entries(path, "")
    else:
        entries = _entries(path, "")
        names = sorted({item.name.removesuffix(SUFFIX) for item in path.glob("seq-*")})
        numbered = [name for name in names if name[4:].isdecimal()]
        sequences = [sequence_at(path / name) for name in numbered]
        sequences = [item for item in sequences if item.is_dir() or is_archive(item)]
        if entries and sequences:
            raise InputError(
                path, f"holds frames and {sequences[0].name}", "give one of its sequences"
            )
        sequences.sort(key=lambda item: int(item.stem[4:]))
        for sequence in sequences:
            entries += _entries(sequence, f"{sequence.stem}/")
    if not entries:
        raise InputError(
            path,
            f"holds no frame-000000.color.png, no seq-01 and no {RGB_LIST} with {TRAJECTORY}",
            "give the folder of a posed sequence",
        )
    return entries


def _entries(sequence: Path, prefix: str) -> list[_Entry]:
    """List the frames of one sequence in order of their numbers."""
    found: dict[str, dict[str, str]] = {}
    with read_as(sequence, "a sequence", OSError):
        names = sequence_names(sequence)
    for name in names:
        match = FRAME.fullmatch(name)
        if match is None:
            continue
        kind = match[2].partition(".")[0]
        files = found.setdefault(match[1], {})
        if kind in files:
            raise InputError(
                frame_file(sequence, name),
                f"this frame has a second colour image, {files[kind]}",
                "delete one of the two",
            )
        files[kind] = name
    numbers = sorted(found, key=lambda number: (int(number), number))
    return [_Entry(sequence, prefix, number, found[number]) for number in numbers]


def _read_frames(entries: Sequence[_Entry]) -> PosedFrames:
    """Read files and poses of frames, each of which must be complete."""
    with_depth = any("depth" in entry.files for entry in entries)
    color = [entry.file("color") for entry in entries]
    depth = [entry.file("depth") if with_depth else None for entry in entries]
    poses = [_pose(entry.file("pose")) for entry in entries]
    kept = [index for index, pose in enumerate(poses) if pose is not None]
    if len(kept) < len(entries):
        lost = next(entry for entry, pose in zip(entries, poses, strict=True) if pose is None)
        if not kept:
            raise InputError(lost.file("pose"), "is not finite, and neither is any other pose")
        log.warning(
            "%s: is not finite; left out, and so are %d others of %d frames",
            lost.file("pose"),
            len(entries) - len(kept) - 1,
            len(entries),
        )
    return PosedFrames(
        names=tuple(entries[index].name for index in kept),
        color=tuple(color[index] for index in kept),
        depth=tuple(depth[index] for index in kept),
        world_from_cam=np.array([pose for pose in poses if pose is not None]),
    )


def _pose(path: FrameFile) -> Array | None:
    """Read a rigid pose (4, 4); None where it is not finite."""
    with read_as(path, "a pose"):
        cells = pose_file_text(path).split()
        values = np.array(cells, np.float64)
    if len(values) == 16 and not np.isfinite(values).all():
        return None
    pose = read_pose(path)  # says what is wrong with anything else
    refuse_non_rigid(pose, path)
    return pose


def _chosen(sequence: PosedFrames, frames: slice | None, path: Path) -> PosedFrames:
    chosen = sequence if frames is None else sequence[frames]
    if not len(chosen):
        raise InputError(
            path,
            f"has {len(sequence)} frames, none of them in the range asked for; frames are counted"
            " from 0",
        )
    return chosen


def _read_tum(path: Path) -> PosedFrames:
    """Read the photographs of a TUM sequence that have a pose, with depth where it is listed."""
    color_s, color = _read_list(path, RGB_LIST)
    keep = np.ones(len(color_s), bool)
    depth: list[FrameFile | None] = [None] * len(color)
    if (path / DEPTH_LIST).is_file():
        depth_s, files = _read_list(path, DEPTH_LIST)
        nearest = _nearest(depth_s, color_s)
        keep &= np.abs(depth_s[nearest] - color_s) <= DEPTH_SLACK_S
        depth = [files[index] for index in nearest]
    trajectory = read_trajectory(path / TRAJECTORY).by_time(path / TRAJECTORY)
    if len(trajectory) < 2:
        raise InputError(path / TRAJECTORY, "holds one pose; a trajectory has two or more")
    pose_s, poses = trajectory.stamps_s, trajectory.world_from_cam
    after = np.searchsorted(pose_s, color_s).clip(1, len(pose_s) - 1)
    gap_s = np.maximum(color_s - pose_s[after - 1], pose_s[after] - color_s)
    between = (gap_s <= POSE_SLACK_S) & (color_s >= pose_s[0]) & (color_s <= pose_s[-1])
    # A pose of that very moment needs no neighbour to interpolate with.
    exact = np.minimum(np.abs(color_s - pose_s[after - 1]), np.abs(pose_s[after] - color_s))
    keep &= between | (exact <= SAME_TIME_S)
    kept = np.flatnonzero(keep)
    if not len(kept):
        raise InputError(
            path / TRAJECTORY,
            f"no photograph of {RGB_LIST} was taken within its times; are the three lists of one"
            " sequence?",
        )
    if len(kept) < len(color):
        log.warning(
            "%s: %d of %d photographs have no pose or depth near in time and are left out",
            path,
            len(color) - len(kept),
            len(color),
        )
    fraction = (color_s - pose_s[after - 1]) / (pose_s[after] - pose_s[after - 1])
    fraction, later = fraction.clip(0.0, 1.0)[kept], after[kept]
    found = interpolate(poses[later - 1], poses[later], fraction)
    for file in (file for i in kept for file in (color[i], depth[i])):
        if file is not None and not file.is_file():
            raise InputError(file, "missing, a list names it", "copy the sequence again")
    return PosedFrames(
        names=tuple(color[i].stem for i in kept),
        color=tuple(color[i] for i in kept),
        depth=tuple(depth[i] for i in kept),
        world_from_cam=found,
    )


def _nearest(times_s: Array, wanted_s: Array) -> NDArray[np.int64]:
    """Return the index (M,) of the nearest of some times (N,) to each of others (M,)."""
    order = np.argsort(times_s, kind="stable")
    rising = times_s[order]
    after = np.searchsorted(rising, wanted_s).clip(0, len(rising) - 1)
    before = (after - 1).clip(0)
    is_before = np.abs(rising[before] - wanted_s) <= np.abs(rising[after] - wanted_s)
    return np.asarray(order[np.where(is_before, before, after)])


def _lines(path: Path) -> Iterable[tuple[int, list[str]]]:
    with read_as(path, "a list of time stamps"):
        lines = read_text(path).splitlines()
    cells = ((number, line.partition("#")[0].split()) for number, line in enumerate(lines, 1))
    return [(number, row) for number, row in cells if row]


def _read_list(path: Path, name: str) -> tuple[Array, list[Path]]:
    """Read time stamps (N,) in seconds and files from ``rgb.txt`` or ``depth.txt``."""
    rows = _lines(path / name)
    stamps, files = [], []
    for number, row in rows:
        with read_as(f"{path / name}: line {number}", "a time stamp and a file"):
            stamp, file = row  # ValueError where there are not two
            stamps.append(float(stamp))
        if not lies_in(path / file, path):
            raise InputError(
                path / name,
                f"line {number} names '{file}', which leads out of the sequence's folder and is"
                " not read",
                "copy it there",
            )
        files.append(path / file)
    if not files:
        raise InputError(path / name, "lists no images")
    return np.array(stamps), files
