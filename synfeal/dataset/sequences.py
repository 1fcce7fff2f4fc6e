"""How the frames of a data set are divided into sequences, the unit that is rendered at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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
    """Sequences of at most ``shard_frames`` frames: those of train first, then those of test."""
    if shard_frames < 1 or min(n_train, n_test) < 0:
        raise ValueError(f"cannot divide {n_train} + {n_test} frames by {shard_frames}")
    sequences: list[Sequence] = []
    counts: tuple[tuple[Split, int], ...] = (("train", n_train), ("test", n_test))
    for split, count in counts:
        for start in range(0, count, shard_frames):
            name = f"seq-{len(sequences) + 1:02d}"
            sequences.append(Sequence(name, split, start, min(start + shard_frames, count)))
    return sequences
