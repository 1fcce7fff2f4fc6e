"""Pixels to rays and back by COLMAP's camera models: other code than the renderers'."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pycolmap
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig

Array = NDArray[np.float64]


class Lens:
    """A camera with the rays of a grid of its pixels.

    Args:
        camera: intrinsics and distortion.
        step: every ``step``-th row and column belongs to the grid.
        moved: added to (cx, cy), pixels, and to the logarithm of the focal lengths.
    """

    def __init__(
        self, camera: CameraConfig, step: int, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        fx, fy, cx, cy = camera.intrinsics
        self.focal_px = np.array([fx, fy])
        scale = float(np.exp(moved[2]))
        k1, k2, p1, p2, k3 = camera.distortion
        parameters = [fx * scale, fy * scale, cx + moved[0], cy + moved[1], k1, k2, p1, p2, k3]
        self._camera = pycolmap.Camera(
            model="FULL_OPENCV",
            width=camera.width,
            height=camera.height,
            params=[*parameters, 0.0, 0.0, 0.0],
        )
        self.rows, self.columns = np.mgrid[
            step // 2 : camera.height : step, step // 2 : camera.width : step
        ].reshape(2, -1)
        centre = [camera.width / 2.0, camera.height / 2.0]
        pixels = np.stack([self.columns, self.rows], axis=1) + 0.5
        self.places = (pixels - centre) / (camera.width / 2.0)

    @cached_property
    def rays(self) -> Array:
        """Points (N, 3) at depth 1 that the pixels of the grid see."""
        pixels = np.stack([self.columns, self.rows], axis=1) + 0.5
        rays = np.asarray(self._camera.cam_from_img(pixels), np.float64)
        return np.column_stack([rays, np.ones(len(rays))])

    @cached_property
    def _radius(self) -> float:
        """Beyond the corners of the image a distortion polynomial may fold back."""
        return 1.1 * float(np.nanmax(np.linalg.norm(self.rays[:, :2], axis=1)))

    def project(self, points_m: Array) -> Array:
        """Pixels (N, 2) of points (N, 3) in the camera, NaN where the camera cannot see them."""
        pixels = np.full((len(points_m), 2), np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            radius = np.linalg.norm(points_m[:, :2], axis=1) / points_m[:, 2]
            seen = (points_m[:, 2] > 1e-6) & (radius < self._radius)
        if seen.any():
            pixels[seen] = self._camera.img_from_cam(points_m[seen])
        return pixels
