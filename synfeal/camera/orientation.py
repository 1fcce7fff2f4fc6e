"""EXIF's orientation: how the stored pixels of a photograph are turned, its camera with them.

A camera that was held upright may have stored its picture lying and noted the turn. Calibrations
are of the sensor, which is to say of the stored pixels; who turns the picture has to turn its
calibration, and its pose, in the same way.
"""

from __future__ import annotations

from dataclasses import replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps

from synfeal.camera.calibration import Calibration

# Where pillow-heif notes the turn that it has followed already, as the format HEIF demands.
FOLLOWED = "original_orientation"


class Orientation(IntEnum):
    """EXIF's orientation: how stored pixels are to be turned to stand upright.

    Those that are mirrored are first mirrored left to right, then turned. Turns are clockwise.

    Source: JEITA CP-3451 (Exif 2.32), tag 0x0112.
    """

    UPRIGHT = 1
    MIRRORED = 2
    TURNED_180 = 3
    MIRRORED_TURNED_180 = 4
    MIRRORED_TURNED_270 = 5
    TURNED_90 = 6
    MIRRORED_TURNED_90 = 7
    TURNED_270 = 8

    @property
    def is_mirrored(self) -> bool:
        """Tell whether the stored pixels are mirrored."""
        return "MIRRORED" in self.name

    @property
    def quarters(self) -> int:
        """Quarters of a clockwise turn, 0 to 3."""
        digits = self.name.rpartition("_")[2]
        return int(digits) // 90 if digits.isdecimal() else 0

    @property
    def swaps_sides(self) -> bool:
        """Tell whether width and height change places."""
        return self.quarters % 2 == 1

    @property
    def back(self) -> Orientation:
        """The turn that undoes this one."""
        if self.is_mirrored:
            return self
        return (self.UPRIGHT, self.TURNED_270, self.TURNED_180, self.TURNED_90)[self.quarters]


class Upright(NamedTuple):
    """A photograph that stands upright, and how its file was turned to do so."""

    image: Image.Image
    turn: Orientation


def orientation_of(image: Image.Image) -> Orientation:
    """Return how EXIF says the pixels of an image are turned; upright where it says nothing."""
    return _known(image.getexif().get(ExifTags.Base.Orientation, 1))


def upright(image: Image.Image) -> Upright:
    """Turn an image as its EXIF orientation says.

    HEIF's decoder has turned the pixels already; then the turn is only reported.
    """
    turn = orientation_of(image)
    if turn is not Orientation.UPRIGHT:
        return Upright(ImageOps.exif_transpose(image), turn)
    return Upright(image, _known(image.info.get(FOLLOWED) or 1))


def upright_size(size: tuple[int, int], turn: Orientation) -> tuple[int, int]:
    """Return width and height after the turn, or before it: a turn back swaps them as well."""
    return (size[1], size[0]) if turn.swaps_sides else size


def turned(camera: Calibration, turn: Orientation) -> Calibration:
    """Return the calibration of an image after the turn.

    Decentring moves a point by ``2 (p.x) x + |x|^2 p`` with p = (p2, p1) of OpenCV's coefficients,
    so p turns as points do.

    Args:
        camera: Calibration of the stored pixels.
        turn: How they are turned.
    """
    width, height = camera.width, camera.height
    fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
    k1, k2, p1, p2, k3 = camera.distortion
    if turn.is_mirrored:
        cx, p2 = width - cx, -p2
    for _ in range(turn.quarters):  # x' = height - y, y' = x
        cx, cy = height - cy, cx
        p2, p1 = -p1, p2
        fx, fy = fy, fx
        width, height = height, width
    return replace(
        camera,
        width=width,
        height=height,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion=(k1, k2, p1, p2, k3),
    )


def stored_from_upright(turn: Orientation) -> NDArray[np.float64]:
    """Return the rotation (4, 4) of camera axes that takes poses of stored images to upright ones.

    ``world_from_upright = world_from_stored @ stored_from_upright``. A mirrored image has no pose;
    its rotation is that of the image that was mirrored back.
    """
    cos, sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[turn.quarters]
    rotation = np.eye(4)
    rotation[:2, :2] = (cos, sin), (-sin, cos)
    return rotation


def _known(value: object) -> Orientation:
    """Return the orientation of a number; upright for what the standard does not know."""
    try:
        return Orientation(value)  # type: ignore[arg-type]
    except ValueError:
        return Orientation.UPRIGHT
