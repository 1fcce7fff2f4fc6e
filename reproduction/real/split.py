"""Division of a scene's photographs into scanned and localized ones.

Where all sequences of the official split are there, it is used. Else the photographs there are, in
order, are halved (``forward``: scan the first half; ``reverse``: the second) or cut into ten blocks
of which every other one is scanned (``alternate``), so that no place is far from the scan.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import link_or_unpack
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.dataset.posed_sequence import PosedFrames, read_posed_sequence
from synfeal.dataset.sevenscenes import SPLIT_FILES, pose_text, read_split
from synfeal.errors import InputError
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.records.files import atomic_directory

BLOCKS = 10
HALVES = ("forward", "reverse", "alternate")
Rows = NDArray[np.int64]


def directions_of(scene: Path) -> tuple[str, ...]:
    """Name the directions that the photographs of a scene allow, the most important one first.

    Raises:
        InputError: There is no such folder.
    """
    if not scene.is_dir():
        raise InputError(
            scene, "is not a folder", "give that of a 7-Scenes scene, or of a sequence of one"
        )
    if all(os.path.lexists(scene / file) for file in SPLIT_FILES.values()):
        sequences = [path for split in ("train", "test") for path in read_split(scene, split)]
        if all(path.exists() for path in sequences):
            return ("official",)
    return HALVES


def split_frames(scene: Path, direction: str) -> tuple[PosedFrames, PosedFrames]:
    """Read the photographs that are scanned and those that are localized.

    Args:
        scene: Folder of a scene, or of a sequence.
        direction: One of :func:`directions_of`.

    Raises:
        InputError: The folder cannot be read, or holds too few photographs.
    """
    every = read_posed_sequence(scene)
    if direction == "official":
        of = np.array([sequence_and_number(name)[0] for name in every.names])
        return _of_split(scene, "train", every, of), _of_split(scene, "test", every, of)
    if len(every) < 2 * BLOCKS:
        raise InputError(
            scene,
            f"holds {len(every)} photographs; {2 * BLOCKS} or more are needed to scan some and"
            " localize the others",
        )
    index = np.arange(len(every))
    half = index >= len(every) // 2
    scanned = {
        "forward": ~half,
        "reverse": half,
        "alternate": index * BLOCKS // len(every) % 2 == 0,
    }[direction]
    return frames_at(every, index[scanned]), frames_at(every, index[~scanned])


def _of_split(scene: Path, split: str, every: PosedFrames, of: NDArray[np.str_]) -> PosedFrames:
    named = [path.stem for path in read_split(scene, split)]
    return frames_at(every, np.flatnonzero(np.isin(of, named)))


def frames_at(frames: PosedFrames, index: Sequence[int] | Rows) -> PosedFrames:
    """Select frames by index."""
    rows = [int(i) for i in index]
    return PosedFrames(
        names=tuple(frames.names[i] for i in rows),
        color=tuple(frames.color[i] for i in rows),
        depth=tuple(frames.depth[i] for i in rows),
        world_from_cam=frames.world_from_cam[rows],
    )


def spread(frames: PosedFrames, count: int | None) -> PosedFrames:
    """Select ``count`` frames at even steps from the first on; all if it is None or too large."""
    if count is None or count >= len(frames):
        return frames
    return frames_at(frames, np.arange(count) * len(frames) // count)


def sequence_and_number(name: str) -> tuple[str, int]:
    """Split the name of a frame, ``seq-01/frame-000012`` or ``frame-000012``."""
    sequence, _, frame = name.rpartition("/")
    return sequence, int(frame.removeprefix("frame-"))


def blocks_of(names: Sequence[str], length: int) -> Rows:
    """Number blocks (N,) of at most ``length`` neighbouring frames.

    Frames are neighbours where their numbers follow one another in the same sequence. A run of
    neighbours is cut into blocks of nearly equal length, so that none is a remainder.
    """
    placed = [sequence_and_number(name) for name in names]
    starts = [
        i
        for i, (sequence, number) in enumerate(placed)
        if i == 0 or placed[i - 1] != (sequence, number - 1)
    ]
    block = np.empty(len(names), np.int64)
    first = 0
    for start, stop in zip(starts, [*starts[1:], len(names)], strict=True):
        count = max(1, round((stop - start) / length))
        block[start:stop] = first + np.arange(stop - start) * count // (stop - start)
        first += count
    return block


def write_frames(frames: PosedFrames, only_sequence: str, out: Path) -> None:
    """Write frames as a new folder of ``seq-XX``; images are links to where they lie.

    Args:
        frames: Photographs.
        only_sequence: Name of the sequence of frames that do not say theirs.
        out: Folder to write.
    """
    with atomic_directory(out) as directory:
        place_frames(frames, only_sequence, directory)


def place_frames(frames: PosedFrames, only_sequence: str, directory: Path) -> None:
    """Put frames into folders ``seq-XX``; images are links to where they lie.

    Args:
        frames: Photographs.
        only_sequence: Name of the sequence of frames that do not say theirs.
        directory: Folder of the sequences.
    """
    for name, color, depth, pose in zip(
        frames.names, frames.color, frames.depth, frames.world_from_cam, strict=True
    ):
        stem = (directory / full_name(name, only_sequence)).as_posix()
        link_or_unpack(color, Path(f"{stem}.color{color.suffix}"))
        if depth is not None:
            link_or_unpack(depth, Path(f"{stem}.depth.png"))
        Path(f"{stem}.pose.txt").write_text(pose_text(pose), encoding="utf-8")


def full_name(name: str, only_sequence: str) -> str:
    """Return the name of a frame with its sequence."""
    return name if "/" in name else f"{only_sequence}/{name}"


def write_truth(frames: PosedFrames, only_sequence: str, out: Path) -> None:
    """Write the poses and names of photographs as a pose table.

    Args:
        frames: Photographs.
        only_sequence: Name of the sequence of frames that do not say theirs.
        out: CSV to write.
    """
    table = PoseTable(
        frame=np.arange(len(frames)),
        path=np.zeros(len(frames), np.int64),
        position_m=frames.world_from_cam[:, :3, 3].copy(),
        quat_wxyz=quat_wxyz_of(frames.world_from_cam),
    )
    write_pose_table(out, table, [full_name(name, only_sequence) for name in frames.names])
