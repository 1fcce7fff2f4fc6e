"""Which frames of a data set are rendered where: shards for machines, pieces for processes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from synfeal.dataset.archive import archive_of
from synfeal.dataset.sequences import Sequence
from synfeal.errors import InputError

PIECE_FRAMES = 250  # seconds of work: small enough to share out evenly and to report


@dataclass(frozen=True)
class Shard:
    """The ``number``-th of ``of`` equal parts of a data set, from 1."""

    number: int
    of: int

    def bounds(self, n_frames: int) -> tuple[int, int]:
        """First frame and the one after the last, training and test frames counted through."""
        return (
            (self.number - 1) * n_frames // self.of,
            self.number * n_frames // self.of,
        )


@dataclass(frozen=True)
class Piece:
    """Frames ``start`` to ``stop`` (exclusive) of a sequence, counted within it."""

    sequence: Sequence
    start: int
    stop: int

    def __len__(self) -> int:
        return self.stop - self.start

    @property
    def name(self) -> str:
        """As progress names it."""
        return f"{self.sequence.name} frames {self.start}-{self.stop - 1}"

    def missing(self, data: Path, kinds: tuple[str, ...]) -> list[int]:
        """Frames that are not whole yet: a file is missing, or empty after a power cut.

        An archive is written from a whole sequence only.
        """
        directory = data / self.sequence.name
        if archive_of(directory).is_file():
            return []
        if not directory.is_dir():
            return list(range(self.start, self.stop))
        found = {path.name for path in directory.iterdir() if path.stat().st_size}
        return [
            number
            for number in range(self.start, self.stop)
            if not all(f"frame-{number:06d}.{kind}" in found for kind in kinds)
        ]


def read_shard(text: str) -> Shard:
    """``3/8`` as the third of eight shards.

    Raises:
        InputError: it is no such thing.
    """
    number, slash, of = text.partition("/")
    numbers = number.isdecimal() and of.isdecimal() and len(text) <= 20
    if not (slash and numbers and 1 <= int(number) <= int(of)):
        raise InputError(f"--shard: '{text}' is no shard; 3/8 is the third of eight")
    return Shard(int(number), int(of))


def pieces_of(sequences: Iterable[Sequence], first: int, last: int) -> list[Piece]:
    """The frames ``first`` to ``last`` (exclusive) of all sequences, cut into pieces."""
    pieces: list[Piece] = []
    offset = 0  # frames of the sequences before
    for sequence in sequences:
        start, stop = max(first - offset, 0), min(last - offset, len(sequence))
        pieces += [
            Piece(sequence, begin, min(begin + PIECE_FRAMES, stop))
            for begin in range(start, stop, PIECE_FRAMES)
        ]
        offset += len(sequence)
    return pieces


def sequences_within(sequences: Iterable[Sequence], first: int, last: int) -> list[Sequence]:
    """Those of which all frames lie in ``first`` to ``last`` (exclusive), counted through."""
    within: list[Sequence] = []
    offset = 0
    for sequence in sequences:
        if first <= offset and offset + len(sequence) <= last:
            within.append(sequence)
        offset += len(sequence)
    return within
