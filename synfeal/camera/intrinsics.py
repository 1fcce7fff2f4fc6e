"""The pinhole part of a camera."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray


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

    @classmethod
    def of_view(cls, width: int, height: int, horizontal_fov_deg: float) -> Self:
        """Square pixels, the principal point in the middle of the image."""
        focal = width / 2.0 / math.tan(math.radians(horizontal_fov_deg) / 2.0)
        return cls(focal, focal, width / 2.0, height / 2.0)


class Camera(Protocol):
    """What this package asks of a camera, whatever configures it."""

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
