"""Pixels of captures: photographs, depth in the units a device stores, confidence."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.captures.capture import Colors, Depth
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import decode_image, read_image, read_rgb
from synfeal.errors import InputError


def read_photograph(path: Path, width: int, height: int) -> Colors:
    """Read a photograph (H, W, 3) as its pixels are stored: a capture's calibrations are of those.

    Raises:
        InputError: It is missing, damaged, or not of this size.
    """
    return read_rgb(path, size=(width, height), remedy="; are both of one capture?")


def decode_photograph(content: bytes, place: object) -> Colors:
    """Decode a photograph (H, W, 3) from a file's bytes."""
    return np.asarray(decode_image(content, place, "RGB"))


def read_depth_png(
    path: FrameFile, units_per_m: float, confidence: Path | None = None, least: int = 1
) -> Depth:
    """Read a 16-bit depth image.

    Args:
        path: PNG or TIFF of whole numbers; 0 and 65535 are no measurement.
        units_per_m: Stored value of one metre.
        confidence: Image of the same size, of how sure the device is of each pixel.
        least: Pixels of lower confidence count as not measured.

    Returns:
        Depth (H, W) in metres along the optical axis, 0 where nothing was measured.
    """
    depth_m = read_depth_m(path, units_per_m=units_per_m, nothing=0.0)
    if confidence is None:
        return depth_m
    return confident(depth_m, np.asarray(read_image(confidence)), least, confidence)


def depth_reader(
    path: FrameFile | None,
    units_per_m: float,
    confidence: Path | None = None,
    least: int = 1,
) -> Callable[[], Depth] | None:
    """Bind :func:`read_depth_png` to a file; None where there is none."""
    if path is None:
        return None
    return partial(read_depth_png, path, units_per_m, confidence, least)


def existing(path: Path) -> Path | None:
    """Return a path that is a file, or None."""
    return path if path.is_file() else None


def confident(
    depth_m: Depth, confidence: NDArray[np.integer[Any]], least: int, place: object
) -> Depth:
    """Return depth (H, W) with 0 where the confidence (H, W) is below the least."""
    if confidence.shape != depth_m.shape:
        raise InputError(
            f"{place}: is of {confidence.shape[::-1]} pixels, its depth of {depth_m.shape[::-1]}"
        )
    return np.where(confidence >= least, depth_m, np.float32(0.0))
