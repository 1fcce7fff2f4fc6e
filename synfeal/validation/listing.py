"""Files of a data set, reading one completely, and the outcome of a check."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.frame_files import (
    IMAGE_DAMAGE,
    SUFFIX,
    FrameFile,
    decode_png,
    opened_image,
    sequence_at,
)
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
from synfeal.errors import InputError, why

__all__ = [
    "COLOR",
    "DEPTH",
    "MASK",
    "NORMAL",
    "POSE",
    "RIGHT_COLOR",
    "RIGHT_DEPTH",
    "Check",
    "Frame",
    "Pixels",
    "SequenceListing",
    "frames_of",
    "list_sequences",
    "read_color",
    "read_depth_mm",
]


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


Pixels = NDArray[Any]


def read_color(path: FrameFile) -> NDArray[np.uint8]:
    """Read colours (H, W, 3) of an 8-bit PNG.

    Raises:
        InputError: the file is missing, truncated, damaged, or no 8-bit PNG.
    """
    content = _content(path)
    pixels = decode_png(content)
    if pixels is not None and pixels.ndim == 3:
        return pixels.astype(np.uint8, copy=False)
    image = _decoded(path, content)
    if image.mode not in ("RGB", "RGBA", "L", "P"):
        raise InputError(f"{path}: is not an 8-bit colour image but of mode {image.mode}")
    return np.asarray(image.convert("RGB"))


def read_depth_mm(path: FrameFile) -> NDArray[np.uint16]:
    """Read depth (H, W) in millimetres as stored; 0 and 65535 mean no depth.

    Raises:
        InputError: the file is missing, truncated, damaged, or no 16-bit grey PNG.
    """
    content = _content(path)
    pixels = decode_png(content)
    if pixels is not None and pixels.ndim == 2:
        return pixels.astype(np.uint16, copy=False)
    image = _decoded(path, content)
    depth = np.asarray(image)
    if not image.mode.startswith("I") or depth.min() < 0 or depth.max() > 65535:
        raise InputError(f"{path}: is not a 16-bit grey image but of mode {image.mode}")
    return depth.astype(np.uint16)


def _content(path: FrameFile) -> bytes:
    """Read the content of a file."""
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{path}: missing") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be decoded ({why(error)})") from error


def _decoded(path: FrameFile, content: bytes) -> Image.Image:
    """Decode a PNG with every checksum verified and every row decoded."""
    try:
        with opened_image(content, ("PNG",)) as image:
            image.verify()
        decoded = Image.open(io.BytesIO(content), formats=["PNG"])
        decoded.load()
    except IMAGE_DAMAGE as error:
        raise InputError(f"{path}: cannot be decoded ({why(error)})") from error
    return decoded
