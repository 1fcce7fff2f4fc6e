"""The pinhole part of a camera."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray


class Camera(Protocol):
    """What this package asks of a camera, whatever configures it."""

    @property
    def width(self) -> int:
        """Image width, pixels."""

    @property
    def height(self) -> int:
        """Image height, pixels."""

    @property
    def horizontal_fov_deg(self) -> float:
        """Of square pixels about the centre; unused where the intrinsics are given."""

    @property
    def given_intrinsics(self) -> tuple[float, float, float, float] | None:
        """fx, fy, cx, cy in pixels, if they are known."""

    @property
    def distortion(self) -> tuple[float, float, float, float, float]:
        """Brown-Conrady coefficients: k1, k2, p1, p2, k3."""


class Intrinsics(NamedTuple):
    """Pinhole intrinsics in pixels; the centre of the top-left pixel is (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float

    def matrix(self, centre_shift_px: float = 0.0) -> NDArray[np.float64]:
        """The camera matrix (3, 3).

        Args:
            centre_shift_px: added to the principal point: 0 where the centre of the first pixel is
                at (0.5, 0.5), as here and in COLMAP; -0.5 where it is at (0, 0), as in OpenCV and
                Open3D.
        """
        cx, cy = self.cx + centre_shift_px, self.cy + centre_shift_px
        return np.array([[self.fx, 0.0, cx], [0.0, self.fy, cy], [0.0, 0.0, 1.0]])


def intrinsics_of(camera: Camera) -> Intrinsics:
    """The intrinsics given, or those of square pixels with the principal point in the centre."""
    if camera.given_intrinsics is not None:
        return Intrinsics(*camera.given_intrinsics)
    focal = camera.width / 2.0 / math.tan(math.radians(camera.horizontal_fov_deg) / 2.0)
    return Intrinsics(focal, focal, camera.width / 2.0, camera.height / 2.0)
