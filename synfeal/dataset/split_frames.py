"""Frames of a split, checked by name against the table of their poses."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.pose_table import HEADER, IMAGE, PoseTable, read_pose_table
from synfeal.dataset.sequence_listing import Frame, SequenceListing, list_sequence, refuse_problems
from synfeal.dataset.sevenscenes import SPLIT_FILES, read_split
from synfeal.errors import InputError, read_as
from synfeal.records.files import read_text

_IMAGE_NAME = re.compile(r"([^/]+)/(frame-[0-9]{6,16})\.color\.[A-Za-z]+")


@dataclass(frozen=True)
class SplitFrames:
    """The frames of a split in the order of its sequences, and what its table says of them."""

    sequences: tuple[SequenceListing, ...]
    poses: PoseTable | None  # one row for each frame, in their order; None where there is no table

    @property
    def frames(self) -> tuple[Frame, ...]:
        """Its frames, in order."""
        return tuple(frame for sequence in self.sequences for frame in sequence.frames)

    def files(self, kind: str) -> list[FrameFile]:
        """List the file of one kind of each frame, none missing.

        Raises:
            InputError: the file of a frame is missing.
        """
        return [file for sequence in self.sequences for file in sequence.files(kind)]


def read_split_frames(dataset: Path, split: str) -> SplitFrames:
    """List the frames of a split and pair them with the rows of ``<split>.csv`` by name.

    Args:
        dataset: directory of a data set with ``TrainSplit.txt`` and ``TestSplit.txt``.
        split: ``train`` or ``test``.

    Raises:
        InputError: a sequence cannot be read, a file does not say which frame it is of, or the
            table names other frames than there are.
    """
    sequences = tuple(list_sequence(path) for path in read_split(dataset, split))
    refuse_problems(sequences)
    for sequence in sequences:
        if not sequence.frames:
            raise InputError(
                sequence.path, f"holds no frame, but {SPLIT_FILES[split]} lists it", "restore it"
            )
    listed = SplitFrames(sequences, None)
    path = dataset / f"{split}.csv"
    if not path.is_file():
        return listed
    table = read_pose_table(path)
    if problems := table_problems(path, listed.frames):
        raise InputError(problems[0])
    return SplitFrames(sequences, table.at(rows_of_frames(path, listed.frames)))


def read_image_names(table: Path) -> tuple[str, ...] | None:
    """Read image names from the last column of a pose table; None where it has no such column.

    Raises:
        InputError: it cannot be read.
    """
    with read_as(table, "a pose table"):
        header, *lines = read_text(table).splitlines() or [""]
    if header != f"{HEADER},{IMAGE}":
        return None
    return tuple(line.rpartition(",")[2] for line in lines)


def table_problems(table: Path, frames: Sequence[Frame]) -> list[str]:
    """Describe how the rows of a pose table differ from the frames, one sentence per problem.

    A table without a column of names can be compared by length only.
    """
    images = read_image_names(table)
    if images is None:
        n_rows = len(read_pose_table(table))
        return [] if n_rows == len(frames) else [f"{table}: {n_rows} rows for {len(frames)} frames"]
    known = {frame.name for frame in frames}
    line_of: dict[str, int] = {}
    problems = []
    for line, image in enumerate(images, start=2):
        name = _frame_name(image)
        if name is None:
            problems.append(
                f"{table}: line {line}: image '{image[:80]}' names no frame; names look like"
                " seq-01/frame-000000.color.png"
            )
        elif name in line_of:
            problems.append(
                f"{table}: line {line}: {image} is named in line {line_of[name]}, too; leave one"
            )
        elif name not in known:
            problems.append(
                f"{table}: line {line} names {image}, which is not there; restore the frame, or"
                " collect the data set again"
            )
        if name is not None:
            line_of.setdefault(name, line)
    problems += [
        f"{table}: has no row for {frame.name}, which is there; restore the row, or collect the"
        " data set again"
        for frame in frames
        if frame.name not in line_of
    ]
    return problems


def rows_of_frames(table: Path, frames: Sequence[Frame]) -> NDArray[np.int64]:
    """Find the row (N,) of each frame in a table in which :func:`table_problems` finds nothing."""
    images = read_image_names(table)
    if images is None:
        return np.arange(len(frames))
    row_of = {_frame_name(image): row for row, image in enumerate(images)}
    return np.array([row_of[frame.name] for frame in frames], dtype=np.int64)


def _frame_name(image: str) -> str | None:
    """Return ``seq-01/frame-000000`` for the name of an image; None for other names."""
    match = _IMAGE_NAME.fullmatch(image)
    return f"{match[1]}/{match[2]}" if match else None


Splits = dict[str, list[SequenceListing]]


def read_splits(
    dataset: Path, sequences: Iterable[SequenceListing]
) -> tuple[Splits, tuple[str, ...]]:
    """List the sequences of each readable split in order, and what is wrong with the files."""
    by_path = {sequence.path: sequence for sequence in sequences}
    splits: Splits = {}
    failures: list[str] = []
    for split, name in SPLIT_FILES.items():
        try:
            directories = read_split(dataset, split)
        except InputError as error:
            failures.append(str(error))
            continue
        failures += [
            f"{dataset / name}: lists {path.name}, which is not there"
            for path in directories
            if path not in by_path
        ]
        splits[split] = [by_path[path] for path in directories if path in by_path]
    return splits, tuple(failures)


def split_problems(
    dataset: Path,
    sequences: Iterable[SequenceListing],
    splits: Mapping[str, list[SequenceListing]],
    unreadable: tuple[str, ...],
) -> tuple[str, ...]:
    """Describe sequences that are not in one split, once; see :func:`read_splits`.

    Args:
        dataset: The data set.
        sequences: All of its sequences.
        splits: Sequences by split.
        unreadable: What is wrong with the files that list the splits. If anything is, a sequence
            may be in no split.
    """
    uses = Counter(sequence.name for listed in splits.values() for sequence in listed)
    names = " and ".join(SPLIT_FILES.values())
    problems = [
        f"{dataset / sequence.name}: is listed {count} times in {names}, must be listed once"
        for sequence in sequences
        if (count := uses[sequence.name]) > 1 or not (count or unreadable)
    ]
    return (*unreadable, *problems)
