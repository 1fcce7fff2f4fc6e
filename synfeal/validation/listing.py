"""Files of a data set, and the outcome of a check."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from synfeal.dataset.frame_files import SUFFIX, sequence_at
from synfeal.dataset.sequence_listing import (
    COLOR,
    DEPTH,
    MASK,
    NORMAL,
    POSE,
    RIGHT_COLOR,
    RIGHT_DEPTH,
    Frame,
    SequenceListing,
    frames_of,
    is_sequence,
    list_sequence,
)
from synfeal.errors import InputError

__all__ = [
    "COLOR",
    "DEPTH",
    "MASK",
    "NORMAL",
    "PNG",
    "POSE",
    "RIGHT_COLOR",
    "RIGHT_DEPTH",
    "Check",
    "Frame",
    "SequenceListing",
    "frames_of",
    "list_sequences",
]

PNG = ("PNG",)  # the format of every image of a data set, whatever its name


def list_sequences(dataset: Path) -> list[SequenceListing]:
    """List the sequences of a data set in order of their numbers.

    Raises:
        InputError: ``dataset`` is not a directory, holds no ``seq-XX``, or an archive is damaged.
    """
    if not dataset.is_dir():
        raise InputError(f"{dataset}: is not a directory; give the directory that holds seq-01")
    names = {path.name.removesuffix(SUFFIX) for path in dataset.glob("seq-*")}
    paths = [sequence_at(dataset / name) for name in names if name[4:].isdecimal()]
    found = [path for path in paths if is_sequence(path)]
    if not found:
        raise InputError(
            f"{dataset}: holds no seq-01 and no seq-01{SUFFIX}; give the directory of a 7-Scenes"
            " data set"
        )
    found.sort(key=lambda path: (int(path.stem[4:]), path.stem))
    return [list_sequence(path) for path in found]


@dataclass(frozen=True)
class Check:
    """One line of the report."""

    name: str  # what was checked, one or two words
    text: str  # how much was checked, and the worst value beside its bound
    failures: tuple[str, ...] = ()  # one sentence each, naming the file; the first is printed
    skipped: bool = False  # nothing was checked, and ``text`` says why

    @property
    def verdict(self) -> str:
        """``ok``, ``FAILED`` or ``not checked``."""
        if self.skipped:
            return "not checked"
        return "FAILED" if self.failures else "ok"
