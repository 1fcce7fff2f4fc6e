"""The format of the 7-Scenes data set: ``seq-XX/frame-XXXXXX.{color.png,depth.png,pose.txt}``.

Depth is along the optical axis, 16-bit PNG in millimetres, 65535 where nothing is; poses are
``world_from_cam`` as four rows of four numbers.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from collections.abc import Sequence as Series
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import FrameFile, frame_file, sequence_at
from synfeal.dataset.sequence_listing import gap_in, list_sequence
from synfeal.errors import InputError, read_as
from synfeal.geometry.limits import FARTHEST_M
from synfeal.records.files import atomic_path, read_text

SEQUENCE = re.compile(r"(sequence)?[0-9]{1,9}")
MOST_POSE_BYTES = 2**16  # sixteen numbers
SPLIT_FILES = {"train": "TrainSplit.txt", "test": "TestSplit.txt"}


def pose_text(world_from_cam: NDArray[np.float64]) -> str:
    """Format a pose (4, 4) as four tab-separated rows, exact to about 1e-10."""
    rows = ("\t".join(f"{value:.10e}" for value in row) for row in world_from_cam.tolist())
    return "".join(f"{row}\n" for row in rows)


def pose_file_text(path: FrameFile) -> str:
    """Read the text of a pose's file.

    Raises:
        OSError: The file cannot be read.
        ValueError: It is no text, or no pose by its size.
    """
    if isinstance(path, Path):
        return read_text(path, most_bytes=MOST_POSE_BYTES)
    content = path.read_bytes(MOST_POSE_BYTES)
    if b"\0" in content:
        raise ValueError("it holds zero bytes, so it is no text")
    return content.decode()


def read_pose(path: FrameFile) -> NDArray[np.float64]:
    """Read a pose (4, 4) from a file of sixteen finite numbers in four rows.

    Raises:
        InputError: The file cannot be read, or holds something else or a place that is too far
            away.
    """
    with read_as(path, "a pose"):
        rows = [line.split() for line in pose_file_text(path).splitlines() if line]
        pose = np.array(rows, np.float64)
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise InputError(path, "a pose is four rows of four finite numbers")
    if np.abs(pose).max() > FARTHEST_M:
        raise InputError(path, f"holds {np.abs(pose).max():.3g}, which is no place in metres")
    return pose


def frame_paths(sequences: Iterable[Path], kind: str) -> list[FrameFile]:
    """List the files of one kind of all frames of sequences, in order.

    For readers that take the rows of another file by position; so frames must be numbered from 0
    without gaps, and each must have its file.

    Args:
        sequences: ``seq-01`` or ``seq-01.zip``.
        kind: ``color.png``, ``depth.png`` or ``pose.txt``.

    Raises:
        InputError: a sequence has no such file, or lacks that of one frame, which is named.
    """
    paths: list[FrameFile] = []
    for sequence in sequences:
        listing = list_sequence(sequence)
        if not listing.numbers[kind]:
            raise InputError(sequence, f"holds no frame-XXXXXX.{kind}", "render it again")
        paths += listing.files(kind)
        if gap := gap_in(listing):
            raise InputError(
                gap.path(kind), "missing, with all files of the frame", "render it again"
            )
    return paths


def frames_between(
    sequences: Series[Path], kind: str, start: int = 0, stop: int | None = None
) -> list[FrameFile]:
    """List the files of one kind of the frames ``start`` to ``stop`` (exclusive) of a split.

    Its frames are counted through its sequences, each of which must be as long as
    :func:`sequences_of` makes it: one frame less in any of them would shift all that follow.

    Args:
        sequences: those of the split from its first, ``seq-01`` or ``seq-01.zip``.
        kind: ``color.png``, ``depth.png`` or ``pose.txt``.
        start: first frame, counted from 0 in the split.
        stop: one past the last frame; None for all frames of the sequences.

    Raises:
        InputError: a frame or its file is missing.
    """
    parts = [frame_paths([sequence], kind) for sequence in sequences]
    most = max(map(len, parts), default=0)
    for sequence, part in zip(sequences[:-1], parts[:-1], strict=True):
        if len(part) < most:
            missing = frame_file(sequence, f"frame-{len(part):06d}.{kind}")
            raise InputError(missing, "missing, with all files of the frame", "render it again")
    paths = [path for part in parts for path in part]
    if stop is not None and len(paths) < stop:
        places = ", ".join(map(str, sequences))
        raise InputError(
            places, f"hold {len(paths)} frames, {stop} are needed", "render them again"
        )
    return paths[start:stop]


def write_splits(dataset_dir: Path, sequences: Iterable[Sequence]) -> None:
    """Write ``TrainSplit.txt`` and ``TestSplit.txt``: a line ``sequence1`` for each ``seq-01``."""
    sequences = list(sequences)
    for split, name in SPLIT_FILES.items():
        lines = [f"sequence{s.number}\n" for s in sequences if s.split == split]
        with atomic_path(dataset_dir / name) as temporary:
            temporary.write_text("".join(lines), encoding="utf-8")


def read_split(dataset_dir: Path, split: str) -> list[Path]:
    """List the sequences of a split in order, each as a directory or an archive.

    Raises:
        InputError: The list is missing, names what is no sequence, or names one twice.
    """
    path = dataset_dir / SPLIT_FILES[split]
    if not os.path.lexists(path):
        raise InputError(path, "missing; a 7-Scenes data set has one")
    with read_as(path, "a list of sequences"):
        lines = read_text(path).split()
    bad = [line for line in lines if not SEQUENCE.fullmatch(line)]
    if bad:
        raise InputError(path, f"'{bad[0][:40]}' names no sequence; lines look like 'sequence1'")
    numbers = [int(line.removeprefix("sequence")) for line in lines]
    twice = [line for at, line in enumerate(lines) if numbers[at] in numbers[:at]]
    if twice:
        raise InputError(path, f"lists {twice[0]} twice", "leave one line")
    return [sequence_at(dataset_dir / f"seq-{number:02d}") for number in numbers]


Split = Literal["train", "test"]


@dataclass(frozen=True)
class Sequence:
    """Frames ``start`` to ``stop`` (exclusive) of a split, in a directory called ``name``."""

    name: str
    split: Split
    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def images(self) -> list[str]:
        """Its colour images, as the data set's directory has them."""
        return [f"{self.name}/frame-{number:06d}.color.png" for number in range(len(self))]

    @property
    def number(self) -> int:
        """Number of the sequence, from 1, train and test counted together."""
        return int(self.name.removeprefix("seq-"))


def sequences_of(n_train: int, n_test: int, shard_frames: int) -> list[Sequence]:
    """Divide frames into sequences of at most ``shard_frames``, first train's, then test's.

    Raises:
        ValueError: A number of frames is negative, or ``shard_frames`` is below 1.
    """
    if shard_frames < 1 or min(n_train, n_test) < 0:
        raise ValueError(f"cannot divide {n_train} + {n_test} frames by {shard_frames}")
    sequences: list[Sequence] = []
    counts: tuple[tuple[Split, int], ...] = (("train", n_train), ("test", n_test))
    for split, count in counts:
        for start in range(0, count, shard_frames):
            name = f"seq-{len(sequences) + 1:02d}"
            sequences.append(Sequence(name, split, start, min(start + shard_frames, count)))
    return sequences
