"""Cameras of photographs: from a calibration file, a focal length, or EXIF."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from PIL import ExifTags, Image

from synfeal.camera.calibration import Calibration, read_calibration
from synfeal.camera.orientation import Orientation, turned, upright_size
from synfeal.errors import Argument, InputError

PINHOLE = (0.0, 0.0, 0.0, 0.0, 0.0)
FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)
# A picture whose sides are this far from the ratio that the camera wrote was cropped afterwards.
ASPECT_TOLERANCE = 0.01

Source = Literal["file", "focal", "exif"]


@dataclass(frozen=True)
class PhotographCamera:
    """Source of the intrinsics of photographs.

    Attributes:
        calibration: Calibration file; photographs may be scaled versions of what it is for.
        focal_px: Focal length in pixels of the photographs, in place of a file.
        exif: Read the focal length from EXIF if neither is given.
        file: Path of the calibration file, for messages.
        otherwise: Camera of photographs of which nothing else is known and whose sides have the
            same ratio: that of the capture that their place was built from.
    """

    calibration: Calibration | None = None
    focal_px: float | None = None
    exif: bool = True
    file: Path | None = None
    otherwise: Calibration | None = None

    @classmethod
    def read(cls, file: Path | None, focal_px: float | None, exif: bool) -> PhotographCamera:
        """Read the calibration file, if one is given; see the attributes for the arguments.

        Raises:
            InputError: The file cannot be used, both a file and a focal length are given, or the
                focal length is not a positive number.
        """
        if file is not None and focal_px is not None:
            raise InputError(
                Argument("focal_px"), "the calibration of `camera` has one", "give one of the two"
            )
        if focal_px is not None and not (math.isfinite(focal_px) and focal_px > 0):
            raise InputError(
                Argument("focal_px"), f"must be a positive number of pixels, found {focal_px:g}"
            )
        calibration = None if file is None else read_calibration(file)
        return cls(calibration, focal_px, exif, file)

    @property
    def source(self) -> Source | None:
        """Return the kind of source of the intrinsics, or None if there is none."""
        if self.calibration is not None:
            return "file"
        if self.focal_px is not None:
            return "focal"
        return "exif" if self.exif else None

    def of(
        self, image: Image.Image, name: object, turn: Orientation = Orientation.UPRIGHT
    ) -> Calibration | None:
        """Return the intrinsics of one photograph.

        A calibration file is of the sensor, so it is turned as the photograph was; one that fits
        the upright photograph alone is of that, as OpenCV sees it, and is taken as it is.

        Args:
            image: The photograph, upright.
            name: Its name in messages.
            turn: How its stored pixels were turned to stand upright.

        Returns:
            Its camera; None where nothing is known of it.

        Raises:
            InputError: The photograph has other proportions than the calibration.
        """
        width, height = image.size
        if self.calibration is not None:
            return self._calibrated(self.calibration, image.size, name, turn)
        if self.focal_px is not None:
            return _centred(width, height, self.focal_px)
        focal_px = exif_focal_px(image) if self.exif else None
        if focal_px is not None:
            return _centred(width, height, focal_px)
        if self.otherwise is None:
            return None
        stored = _scaled(self.otherwise, upright_size(image.size, turn))
        return None if stored is None else turned(stored, turn)

    def turns_with(self, image: Image.Image, turn: Orientation) -> bool:
        """Tell whether :meth:`of` turns the calibration file for a photograph."""
        if self.calibration is None or turn is Orientation.UPRIGHT:
            return False
        return _scaled(self.calibration, upright_size(image.size, turn)) is not None

    def _calibrated(
        self, calibration: Calibration, size: tuple[int, int], name: object, turn: Orientation
    ) -> Calibration:
        """Scale the calibration to the stored pixels and turn it, or scale it to upright ones."""
        stored = _scaled(calibration, upright_size(size, turn))
        if stored is not None:
            return turned(stored, turn)
        try:
            return calibration.scaled(*size)
        except ValueError as error:
            lying = _scaled(calibration, (size[1], size[0])) is not None
            remedy = (
                ". The picture was turned and its EXIF does not say which way; take the file as the"
                " camera stored it, or give a calibration of turned pictures"
            )
            raise InputError(
                name, f"its camera {self.file} {error}{remedy if lying else ''}"
            ) from error


def _scaled(calibration: Calibration, size: tuple[int, int]) -> Calibration | None:
    """Scale a calibration to a width and height, pixels; None where the proportions differ."""
    try:
        return calibration.scaled(*size)
    except ValueError:
        return None


def exif_focal_px(image: Image.Image) -> float | None:
    """Read the focal length in pixels from EXIF's ``FocalLengthIn35mmFilm``; None without one.

    It is the focal length that gives the same diagonal angle on film of 36 mm x 24 mm (CIPA
    DCG-001), so pixels per millimetre follow from the diagonal. Where EXIF's own size of the image
    has another aspect ratio, the picture was cropped later and the number no longer holds.
    """
    exif = image.getexif().get_ifd(ExifTags.IFD.Exif)
    focal_mm = _number(exif.get(ExifTags.Base.FocalLengthIn35mmFilm))
    if focal_mm is None:
        return None
    sides = (exif.get(ExifTags.Base.ExifImageWidth), exif.get(ExifTags.Base.ExifImageHeight))
    taken = [_number(side) for side in sides]
    if taken[0] is not None and taken[1] is not None:
        short, long = sorted((taken[0], taken[1]))
        ratio = (short / long) / (min(image.size) / max(image.size))
        if abs(ratio - 1.0) > ASPECT_TOLERANCE:
            return None
    return focal_mm * math.hypot(*image.size) / FILM_DIAGONAL_MM


def _number(value: object) -> float | None:
    """Return a positive number, or None: files hold zeros and text where a camera knew nothing."""
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) and number > 0 else None


def _centred(width: int, height: int, focal_px: float) -> Calibration:
    """Return a pinhole camera with square pixels and its principal point in the image's centre."""
    return Calibration(
        width=width,
        height=height,
        fx=focal_px,
        fy=focal_px,
        cx=width / 2,
        cy=height / 2,
        distortion=PINHOLE,
    )
