"""Frames of one sequence, paired by the numbers in the names of their files.

Every reader of frames starts here, so that no list of images can be one file shorter than the list
of their poses: a frame exists if any of its files does, and lists of files hold one for each frame.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from synfeal.dataset.frame_files import (
    SUFFIX,
    FrameFile,
    foreign_members,
    frame_file,
    is_archive,
    sequence_at,
    sequence_names,
)
from synfeal.errors import InputError, read_as

COLOR, DEPTH, POSE = "color.png", "depth.png", "pose.txt"
# Of the right camera of a stereo pair; its pose follows from that of the frame (manifest.json).
RIGHT_COLOR, RIGHT_DEPTH = "right.color.png", "right.depth.png"
RIGHT_OF = {COLOR: RIGHT_COLOR, DEPTH: RIGHT_DEPTH}
NORMAL, MASK = "normal.png", "mask.png"
KINDS = (COLOR, DEPTH, NORMAL, MASK, POSE, RIGHT_COLOR, RIGHT_DEPTH)

# Exactly what `frame-{number:06d}` writes: 10 and 0000010 would be the same frame as 000010.
_FRAME = re.compile(
    r"frame-([0-9]{6}|[1-9][0-9]{6,15})\.((?:(?:right\.)?(?:color|depth)|normal|mask)\.png|pose\.txt)"
)
# Other programs' colour images, which may stand in place of ours but not beside them.
_OTHER_COLOR = re.compile(r"frame-([0-9]{6}|[1-9][0-9]{6,15})\.color\.[A-Za-z]+")
_LIKE_A_FRAME = re.compile(
    r"frame-.*\.(color\.[A-Za-z]+|(depth|normal|mask)\.png|pose\.txt)", re.DOTALL
)


@dataclass(frozen=True)
class Frame:
    """One frame: its sequence (``seq-01`` or ``seq-01.zip``) and its number in it."""

    sequence: Path
    number: int

    def path(self, kind: str) -> FrameFile:
        """Return the file of one kind."""
        return frame_file(self.sequence, f"frame-{self.number:06d}.{kind}")

    @property
    def name(self) -> str:
        """``seq-01/frame-000000``, archived or not."""
        return f"{self.sequence.stem}/frame-{self.number:06d}"


@dataclass(frozen=True)
class SequenceListing:
    """The frames of one sequence, by kind of file."""

    path: Path
    numbers: dict[str, set[int]]
    problems: tuple[str, ...] = ()  # files of which nobody can tell what frame they are of

    @property
    def name(self) -> str:
        """Name of the sequence: ``seq-01``, archived or not."""
        return self.path.stem

    @cached_property
    def frames(self) -> tuple[Frame, ...]:
        """All frames of which any file is there, in order."""
        numbers = sorted(set[int]().union(*self.numbers.values()))
        return tuple(Frame(self.path, number) for number in numbers)

    def files(self, kind: str) -> list[FrameFile]:
        """List the file of one kind of each of :attr:`frames`.

        A sequence with images or poses must have them of every frame: an image or a pose that
        stands alone is of no frame, and would take the place of one.

        Raises:
            InputError: the file of a frame is missing, or one has an ambiguous name.
        """
        refuse_problems([self])
        needed = {kind, *(own for own in (COLOR, POSE) if self.numbers[own])}
        for frame in self.frames:
            for own in (own for own in KINDS if own in needed):
                if frame.number in self.numbers[own]:
                    continue
                other = next(other for other in KINDS if frame.number in self.numbers[other])
                raise InputError(
                    frame.path(own),
                    f"missing, though {frame.path(other).name} is there",
                    "restore it, or delete the other files of the frame",
                )
        return [frame.path(kind) for frame in self.frames]


def list_sequence(path: Path) -> SequenceListing:
    """List the frames of a directory or an archive, and the files that no frame can claim.

    Raises:
        InputError: it cannot be read.
    """
    with read_as(path, "a sequence", OSError):
        counts = Counter(sequence_names(path))
    numbers: dict[str, set[int]] = {kind: set() for kind in KINDS}
    problems = []
    for name, count in counts.items():
        if match := _FRAME.fullmatch(name):
            numbers[match[2]].add(int(match[1]))
        elif match := _OTHER_COLOR.fullmatch(name):
            twin = f"frame-{match[1]}.{COLOR}"
            if twin in counts:
                problems.append(
                    f"{frame_file(path, name)}: is a second colour image beside {twin}; leave one"
                )
        elif _LIKE_A_FRAME.fullmatch(name):
            problems.append(
                f"{frame_file(path, name)}: does not say which frame it is of; names look like"
                " frame-000000.color.png; rename or delete it"
            )
        if count > 1:
            problems.append(f"{frame_file(path, name)}: is {count} times in {path.name}; leave one")
    return SequenceListing(path, numbers, tuple(problems))


def refuse_problems(sequences: Iterable[SequenceListing]) -> None:
    """Refuse sequences with a file whose frame is not certain.

    Raises:
        InputError: naming the first such file.
    """
    for sequence in sequences:
        if sequence.problems:
            raise InputError(sequence.problems[0])


def frames_of(sequences: Iterable[SequenceListing]) -> list[Frame]:
    """List all frames of several sequences, in order."""
    return [frame for sequence in sequences for frame in sequence.frames]


def gap_in(sequence: SequenceListing) -> Frame | None:
    """Find the first frame that is missing from the numbers 0, 1, 2, ... of a sequence, if any."""
    for expected, frame in enumerate(sequence.frames):
        if frame.number != expected:
            return Frame(sequence.path, expected)
    return None


def is_sequence(path: Path) -> bool:
    """Tell whether a path is a sequence, as a folder or as an archive."""
    return path.is_dir() or is_archive(path)


def list_sequences(dataset: Path) -> list[SequenceListing]:
    """List the sequences of a data set in order of their numbers.

    Raises:
        InputError: ``dataset`` is not a directory, holds no ``seq-XX``, or an archive is damaged.
    """
    if not dataset.is_dir():
        raise InputError(dataset, "is not a directory", "give the directory that holds seq-01")
    names = {path.name.removesuffix(SUFFIX) for path in dataset.glob("seq-*")}
    paths = [sequence_at(dataset / name) for name in names if name[4:].isdecimal()]
    found = [path for path in paths if is_sequence(path)]
    if not found:
        raise InputError(
            dataset,
            f"holds no seq-01 and no seq-01{SUFFIX}",
            "give the directory of a 7-Scenes data set",
        )
    found.sort(key=lambda path: (int(path.stem[4:]), path.stem))
    return [list_sequence(path) for path in found]


def kinds_of(sequences: Iterable[SequenceListing]) -> tuple[str, ...]:
    """List the kinds of file every frame must have: layers and right images only if any has."""
    listed = list(sequences)
    return tuple(
        kind
        for kind in (COLOR, DEPTH, NORMAL, MASK, POSE, RIGHT_COLOR, RIGHT_DEPTH)
        if kind in (COLOR, POSE) or any(sequence.numbers[kind] for sequence in listed)
    )


def name_problems(sequences: Sequence[SequenceListing]) -> tuple[str, ...]:
    """Describe frames that are not numbered 0, 1, 2, ... or lack a file, and ambiguous files."""
    kinds = kinds_of(sequences)
    problems = [problem for sequence in sequences for problem in sequence.problems]
    problems += [problem for sequence in sequences for problem in _gaps(sequence, kinds)]
    return tuple(problems)


def _gaps(sequence: SequenceListing, kinds: Iterable[str]) -> Iterable[str]:
    if not sequence.frames:
        yield f"{sequence.path}: holds no frame"
        return
    if is_archive(sequence.path):
        for name in foreign_members(sequence.path):
            yield f"{sequence.path}: '{name[:80]}' does not unpack to one file in {sequence.name}"
    for number in range(sequence.frames[-1].number + 1):
        frame = Frame(sequence.path, number)
        for kind in kinds:
            if number not in sequence.numbers[kind]:
                yield f"{frame.path(kind)}: missing"
