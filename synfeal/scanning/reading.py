"""Images of posed RGB-D frames as arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.frame_files import FrameFile, read_image
from synfeal.dataset.sevenscenes import INVALID_MM
from synfeal.errors import InputError

Depth = NDArray[np.float32]


def read_raw_depth(path: FrameFile) -> NDArray[np.uint16]:
    """Read a depth image (H, W) in the units it is stored in, 0 where nothing was measured.

    Raises:
        InputError: It is missing, damaged, or no 16-bit grey image.
    """
    image = read_image(path)
    values = np.asarray(image)
    if values.ndim != 2 or values.dtype == np.uint8:
        raise InputError(f"{path}: must be a 16-bit grey image of depth")
    raw = values.astype(np.uint16)
    return np.where(raw == INVALID_MM, np.uint16(0), raw)


def read_depth_m(path: FrameFile, units_per_m: float, size: tuple[int, int]) -> Depth:
    """Read a depth image.

    Args:
        path: 16-bit grey image; 0 and 65535 are no measurement.
        units_per_m: What a metre is stored as.
        size: Width and height it must have, pixels.

    Returns:
        Metres (H, W) along the optical axis, 0 where nothing was measured.
    """
    raw = read_raw_depth(path)
    _check_size(path, (raw.shape[1], raw.shape[0]), size)
    return (raw / np.float32(units_per_m)).astype(np.float32)


def read_color(path: FrameFile, size: tuple[int, int], shrink: int = 1) -> NDArray[np.uint8]:
    """Read a photograph.

    Args:
        path: Image file.
        size: Width and height it must have, pixels.
        shrink: Factor by which both sides are made shorter, averaging pixels.

    Returns:
        Colours (H, W, 3).

    Raises:
        InputError: It is missing, damaged, or of another size.
    """
    image = read_image(path, "RGB")
    _check_size(path, image.size, size)
    if shrink > 1:
        image = image.reduce(shrink)
    return np.asarray(image)


def image_size(path: FrameFile) -> tuple[int, int]:
    """Read the width and height of an image, pixels."""
    width, height = read_image(path).size
    return width, height


def _check_size(path: FrameFile, found: tuple[int, int], expected: tuple[int, int]) -> None:
    if found != expected:
        raise InputError(
            f"{path}: is of {found[0]}x{found[1]} pixels, others of {expected[0]}x{expected[1]};"
            " all images of a sequence must be of one camera"
        )
