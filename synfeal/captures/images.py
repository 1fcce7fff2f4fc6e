"""Pixels of captures: photographs, depth in the units a device stores, confidence."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.orientation import orientation_of, upright, upright_size
from synfeal.captures.capture import Colors, Depth
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import decode_image, image_size_and_turn, read_image, read_rgb
from synfeal.errors import InputError

# Sizes that were rounded differ in their proportions by this much.
STRETCH = 0.02


def read_photograph(path: Path, width: int, height: int) -> Colors:
    """Read a photograph (H, W, 3) as its pixels are stored: a capture's calibrations are of those.

    Where only the photograph that is turned as EXIF says has the calibration's size, it is turned.

    Raises:
        InputError: It is missing, damaged, or of this size neither way.
    """
    image = read_image(path, "RGB")
    turn = orientation_of(image)
    if image.size != (width, height) and upright_size(image.size, turn) == (width, height):
        return np.asarray(upright(image).image)
    return read_rgb(path, size=(width, height), remedy="; are both of one capture?")


def photograph_size(path: Path, width: int, height: int) -> tuple[int, int]:
    """Return the size in pixels at which :func:`read_photograph` is to read a photograph.

    That is the stored one, unless EXIF swaps its sides and the calibration has the proportions of
    the upright one: some programs turn what they calibrate.

    Args:
        path: Image file.
        width: Width that the calibration is of, pixels.
        height: Height that the calibration is of, pixels.

    Raises:
        InputError: It is missing or no image, or of other proportions than the calibration.
    """
    stored, turn = image_size_and_turn(path)
    for size in (stored, upright_size(stored, turn)):
        if abs(size[0] * height - size[1] * width) <= STRETCH * size[1] * width:
            return size
    raise InputError(
        path,
        f"is of {stored[0]} x {stored[1]} pixels, its calibration of {width} x {height}, which are"
        " other proportions",
        "give the photographs that were calibrated",
    )


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
    """Return depth (H, W) with 0 where the confidence (H, W) is below the least.

    Raises:
        InputError: The two differ in size; names ``place``.
    """
    if confidence.shape != depth_m.shape:
        raise InputError(
            place, f"is of {confidence.shape[::-1]} pixels, its depth of {depth_m.shape[::-1]}"
        )
    return np.where(confidence >= least, depth_m, np.float32(0.0))
