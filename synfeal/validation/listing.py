"""Which files a data set holds, reading one completely, and the outcome of a check."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.frame_files import (
    IMAGE_DAMAGE,
    SUFFIX,
    FrameFile,
    frame_file,
    is_archive,
    sequence_at,
    sequence_names,
)
from synfeal.errors import InputError, read_as, why

COLOR, DEPTH, POSE = "color.png", "depth.png", "pose.txt"
_FRAME = re.compile(r"frame-(\d{6,})\.(color\.png|depth\.png|pose\.txt)")


@dataclass(frozen=True)
class Frame:
    """One frame: its sequence (``seq-01`` or ``seq-01.zip``) and its number in it."""

    sequence: Path
    number: int

    def path(self, kind: str) -> FrameFile:
        """The file of one kind."""
        return frame_file(self.sequence, f"frame-{self.number:06d}.{kind}")


@dataclass(frozen=True)
class SequenceListing:
    """The frames of one sequence, by kind of file."""

    path: Path
    numbers: dict[str, set[int]]

    @property
    def name(self) -> str:
        """Name of the sequence: ``seq-01``, archived or not."""
        return self.path.stem

    @cached_property
    def frames(self) -> tuple[Frame, ...]:
        """All frames of which any file is there, in order."""
        numbers = sorted(set[int]().union(*self.numbers.values()))
        return tuple(Frame(self.path, number) for number in numbers)


def list_sequences(dataset: Path) -> list[SequenceListing]:
    """The sequences of a data set, in order of their numbers.

    Raises:
        InputError: ``dataset`` is not a directory, holds no ``seq-XX``, or an archive is damaged.
    """
    if not dataset.is_dir():
        raise InputError(f"{dataset}: is not a directory; give the directory that holds seq-01")
    names = {path.name.removesuffix(SUFFIX) for path in dataset.glob("seq-*")}
    paths = [sequence_at(dataset / name) for name in names if name[4:].isdecimal()]
    found = [path for path in paths if path.is_dir() or is_archive(path)]
    if not found:
        raise InputError(
            f"{dataset}: holds no seq-01 and no seq-01{SUFFIX}; give the directory of a 7-Scenes"
            " data set"
        )
    return [_list(path) for path in sorted(found, key=lambda path: (int(path.stem[4:]), path.stem))]


def frames_of(sequences: Iterable[SequenceListing]) -> list[Frame]:
    """All frames of several sequences, in order."""
    return [frame for sequence in sequences for frame in sequence.frames]


def _list(path: Path) -> SequenceListing:
    with read_as(path, "a sequence", OSError):
        found = [match for name in sequence_names(path) if (match := _FRAME.fullmatch(name))]
    kinds = (COLOR, DEPTH, POSE)
    return SequenceListing(path, {k: {int(m[1]) for m in found if m[2] == k} for k in kinds})


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


Pixels = NDArray[Any]


def read_color(path: FrameFile) -> NDArray[np.uint8]:
    """Colours (H, W, 3).

    Raises:
        InputError: the file is missing, truncated, damaged, or no 8-bit PNG.
    """
    image = _decoded(path)
    if image.mode not in ("RGB", "RGBA", "L", "P"):
        raise InputError(f"{path}: is not an 8-bit colour image but of mode {image.mode}")
    return np.asarray(image.convert("RGB"))


def read_depth_mm(path: FrameFile) -> NDArray[np.uint16]:
    """Depth (H, W) in millimetres as stored; 0 and 65535 mean no depth.

    Raises:
        InputError: the file is missing, truncated, damaged, or no 16-bit grey PNG.
    """
    image = _decoded(path)
    depth = np.asarray(image)
    if not image.mode.startswith("I") or depth.min() < 0 or depth.max() > 65535:
        raise InputError(f"{path}: is not a 16-bit grey image but of mode {image.mode}")
    return depth.astype(np.uint16)


def _decoded(path: FrameFile) -> Image.Image:
    """A PNG with every checksum verified and every row decoded."""
    try:
        content = path.read_bytes()
        with Image.open(io.BytesIO(content), formats=["PNG"]) as image:
            image.verify()
        decoded = Image.open(io.BytesIO(content), formats=["PNG"])
        decoded.load()
    except FileNotFoundError:
        raise InputError(f"{path}: missing") from None
    except IMAGE_DAMAGE as error:
        raise InputError(f"{path}: cannot be decoded ({why(error)})") from None
    return decoded
