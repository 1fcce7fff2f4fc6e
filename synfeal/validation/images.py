"""Reading the files of a frame completely: what is damaged is an ``InputError``."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.archive import FrameFile
from synfeal.dataset.png import IMAGE_DAMAGE
from synfeal.errors import InputError, why

Pixels = NDArray[Any]

_COLOR_MODES = ("RGB", "RGBA", "L", "P")


def read_color(path: FrameFile) -> NDArray[np.uint8]:
    """Colours (H, W, 3).

    Raises:
        InputError: the file is missing, truncated, damaged, or no 8-bit PNG.
    """
    image = _decoded(path)
    if image.mode not in _COLOR_MODES:
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
