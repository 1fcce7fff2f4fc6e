"""A camera as a calibration tool found it, whatever the file it came in."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

Distortion = tuple[float, float, float, float, float]


@dataclass(frozen=True)
class Calibration:
    """Intrinsics in pixels of an image of ``width`` x ``height``.

    Raises:
        ValueError: a value that no camera has; the message begins with the attribute.
    """

    width: int
    height: int
    fx: float  # focal length along x, pixels
    fy: float  # focal length along y, pixels
    cx: float  # principal point from the left edge, pixels: the first pixel's centre is at 0.5
    cy: float  # principal point from the top edge, pixels
    distortion: Distortion  # k1, k2, p1, p2, k3

    def __post_init__(self) -> None:
        for name in ("fx", "fy"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name}: a focal length is a positive number, found {value:g}")
        for name, side in (("cx", self.width), ("cy", self.height)):
            value = getattr(self, name)
            if not 0 <= value <= side:
                raise ValueError(
                    f"{name}: the principal point {value:g} lies outside the image of"
                    f" {self.width}x{self.height}; are both of the same calibration?"
                )
        if not all(map(math.isfinite, self.distortion)):
            raise ValueError(f"distortion: must be finite, found {list(self.distortion)}")

    def scaled(self, width: int | None, height: int | None) -> Calibration:
        """The same lens with an image of another size, in pixels, as when the image is resized.

        A side that is None follows from the other.

        Raises:
            ValueError: the two sides would not keep the aspect ratio to the pixel.
        """
        if width is None and height is None:
            return self
        if width is None:
            assert height is not None
            width = round(height * self.width / self.height)
        kept = round(width * self.height / self.width)
        if height is None:
            height = kept
        if abs(width * self.height / self.width - height) >= 1.0:
            raise ValueError(
                f"is of {self.width}x{self.height}, which does not scale to"
                f" {width}x{height}; {width}x{kept} keeps the aspect ratio"
            )
        along_x, along_y = width / self.width, height / self.height
        return replace(
            self,
            width=width,
            height=height,
            fx=self.fx * along_x,
            fy=self.fy * along_y,
            cx=self.cx * along_x,
            cy=self.cy * along_y,
        )
