"""Intrinsics of a camera, and where its pixels look with lens distortion removed."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol, Self

import numpy as np

from synfeal.camera.distortion import Array, distort, undistort


class Intrinsics(NamedTuple):
    """Pinhole intrinsics in pixels; the centre of the top-left pixel is (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float

    def matrix(self, centre_shift_px: float = 0.0) -> Array:
        """The camera matrix (3, 3), with a shift of the principal point.

        It is 0 where the centre of the first pixel is at (0.5, 0.5), as here and in COLMAP; -0.5
        where it is at (0, 0), as in OpenCV and Open3D.
        """
        cx, cy = self.cx + centre_shift_px, self.cy + centre_shift_px
        return np.array([[self.fx, 0.0, cx], [0.0, self.fy, cy], [0.0, 0.0, 1.0]])

    @classmethod
    def of_view(cls, width: int, height: int, horizontal_fov_deg: float) -> Self:
        """Square pixels, the principal point in the middle of the image."""
        focal = width / 2.0 / math.tan(math.radians(horizontal_fov_deg) / 2.0)
        return cls(focal, focal, width / 2.0, height / 2.0)


class Camera(Protocol):
    """Interface of a camera: image size, intrinsics and lens distortion."""

    @property
    def width(self) -> int:
        """Image width, pixels."""

    @property
    def height(self) -> int:
        """Image height, pixels."""

    @property
    def intrinsics(self) -> Intrinsics:
        """Resolved, whichever way they were given."""

    @property
    def distortion(self) -> tuple[float, float, float, float, float]:
        """Brown-Conrady coefficients: k1, k2, p1, p2, k3."""


def normalised_of_pixels(camera: Camera, pixel: Array) -> Array:
    """Normalised image coordinates (..., 2), x / z and y / z, of ``pixel`` (..., 2): column, row.

    NaN where the lens folds over before it reaches the pixel.
    """
    fx, fy, cx, cy = camera.intrinsics
    return undistort((pixel - [cx, cy]) / [fx, fy], camera.distortion)


def pixels_of_normalised(camera: Camera, normalised: Array) -> Array:
    """Return pixels (..., 2), column and row, of normalised image coordinates (..., 2)."""
    fx, fy, cx, cy = camera.intrinsics
    return distort(normalised, camera.distortion) * [fx, fy] + [cx, cy]


def cell_pixels(camera: Camera, columns: int, rows: int) -> Array:
    """Middles (rows, columns, 2) of equal cells of an image: column and row, pixels."""
    x = (np.arange(columns) + 0.5) * camera.width / columns
    y = (np.arange(rows) + 0.5) * camera.height / rows
    return np.stack(np.meshgrid(x, y), axis=-1)


def cell_directions(camera: Camera, columns: int, rows: int) -> Array:
    """Camera coordinates (rows, columns, 3), z = 1, of what the middles of equal cells show."""
    normalised = normalised_of_pixels(camera, cell_pixels(camera, columns, rows))
    return np.concatenate([normalised, np.ones_like(normalised[..., :1])], axis=-1)


def refuse_fold(camera: Camera) -> None:
    """Check that every pixel looks somewhere.

    Raises:
        ValueError: the lens folds over within the image; names the pixel nearest to the centre.
    """
    sides = (np.linspace(0.0, side, 33) for side in (camera.width, camera.height))
    pixel = np.stack(np.meshgrid(*sides), axis=-1)
    folded = pixel[np.isnan(normalised_of_pixels(camera, pixel)).any(axis=-1)]
    if len(folded):
        _, _, cx, cy = camera.intrinsics
        x, y = folded[np.argmin(np.hypot(*(folded - [cx, cy]).T))]
        raise ValueError(
            f"distortion: folds over inside the image at pixel ({x:.0f}, {y:.0f}); the coefficients"
            " hold for a narrower image or belong to another lens"
        )
