"""Which frames a directory holds: names only, nothing is opened."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from synfeal.errors import InputError

COLOR, DEPTH, POSE = "color.png", "depth.png", "pose.txt"
KINDS = (COLOR, DEPTH, POSE)
_FRAME = re.compile(r"frame-(\d{6,})\.(color\.png|depth\.png|pose\.txt)")


@dataclass(frozen=True)
class Frame:
    """One frame: its sequence and its number in it."""

    directory: Path
    number: int

    def path(self, kind: str) -> Path:
        """The file of one kind."""
        return self.directory / f"frame-{self.number:06d}.{kind}"


@dataclass(frozen=True)
class SequenceListing:
    """The frames of one sequence, by kind of file."""

    directory: Path
    numbers: dict[str, frozenset[int]]

    @property
    def name(self) -> str:
        """Name of the directory: ``seq-01``."""
        return self.directory.name

    @cached_property
    def frames(self) -> tuple[Frame, ...]:
        """All frames of which any file is there, in order."""
        numbers = sorted(frozenset().union(*self.numbers.values()))
        return tuple(Frame(self.directory, number) for number in numbers)


def list_sequences(dataset: Path) -> list[SequenceListing]:
    """The sequences of a data set, in order of their numbers.

    Raises:
        InputError: ``dataset`` is no directory, or holds no ``seq-XX``.
    """
    if not dataset.is_dir():
        raise InputError(f"{dataset}: is no directory; give the directory that holds seq-01")
    found = [path for path in dataset.glob("seq-*") if path.is_dir() and path.name[4:].isdecimal()]
    if not found:
        raise InputError(f"{dataset}: holds no seq-01; give the directory of a 7-Scenes data set")
    return [_list(path) for path in sorted(found, key=lambda path: (int(path.name[4:]), path.name))]


def _list(directory: Path) -> SequenceListing:
    numbers: dict[str, set[int]] = {kind: set() for kind in KINDS}
    for path in directory.iterdir():
        match = _FRAME.fullmatch(path.name)
        if match and path.is_file():
            numbers[match[2]].add(int(match[1]))
    return SequenceListing(directory, {kind: frozenset(found) for kind, found in numbers.items()})
