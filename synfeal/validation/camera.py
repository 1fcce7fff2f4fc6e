"""Rays through the pixels of a camera, by other code than the renderers'."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.fisheye import EQUIDISTANT
from synfeal.camera.projection import pixels_per_radian
from synfeal.config.dataset import CameraConfig

Array = NDArray[np.float64]


def lens_of(
    camera: CameraConfig, step: int, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Lens:
    """Open a camera of any model.

    Args:
        camera: The camera.
        step: Every ``step``-th pixel along both axes is looked at.
        moved: What is added to cx and cy, pixels, and to the logarithm of the focal lengths.
    """
    return (Lens if camera.projection is None else WideLens)(camera, step, moved)


class Lens:
    """A perspective camera with the rays of a grid of its pixels; see :func:`lens_of`.

    Attributes:
        rows: Rows (N,) of the grid's pixels.
        columns: Their columns (N,).
        places: Where they are (N, 2), -1 to 1 across the image's width.
        rays: Points (N, 3) at depth 1 that they see.
        curvature: By how much at most, as a share of it, depth that is interpolated between pixels
            is off on a plane.
        share: Share of the points seen by two frames that must agree in depth.
    """

    curvature = 0.0
    share = 0.5

    def __init__(
        self, camera: CameraConfig, step: int, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        self._camera = colmap_camera(camera, moved)
        self._pixel_grid(camera, step)
        rays = np.asarray(self._camera.cam_from_img(self._pixels), np.float64)
        self.rays = np.column_stack([rays, np.ones(len(rays))])
        self.focal_px = np.array(camera.intrinsics[:2])
        # Beyond the corners of the image a distortion polynomial may fold back.
        self._radius = 1.1 * float(np.nanmax(np.linalg.norm(rays, axis=1)))

    def _pixel_grid(self, camera: CameraConfig, step: int) -> None:
        self.rows, self.columns = np.mgrid[
            step // 2 : camera.height : step, step // 2 : camera.width : step
        ].reshape(2, -1)
        self._pixels = np.stack([self.columns, self.rows], axis=1) + 0.5
        centre = [camera.width / 2.0, camera.height / 2.0]
        self.places = (self._pixels - centre) / (camera.width / 2.0)

    def project(self, points_m: Array) -> Array:
        """Project points (N, 3) in the camera to pixels (N, 2), NaN where it cannot see them."""
        pixels = np.full((len(points_m), 2), np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            radius = np.linalg.norm(points_m[:, :2], axis=1) / points_m[:, 2]
            seen = (points_m[:, 2] > 1e-6) & (radius < self._radius)
        if seen.any():
            pixels[seen] = self._camera.img_from_cam(points_m[seen])
        return pixels

    def depth_of(self, points_m: Array) -> Array:
        """Return depths (N,) of points (N, 3) in the camera."""
        return np.asarray(points_m[:, 2])

    def normals(self, points_m: Array, inverse: Array, slope: Array) -> Array:
        """Fit planes ``normal @ point = 1`` to what an image of inverse depth shows.

        On such a plane the inverse of depth is linear in x / z and y / z.

        Args:
            points_m: Points (N, 3) in the camera.
            inverse: Inverse (N,) of the depth of what the image shows there.
            slope: Its change (N, 2) from pixel to pixel.

        Returns:
            Normals (N, 3) in the frame of the camera.
        """
        along = slope * self.focal_px
        place = points_m[:, :2] / points_m[:, 2:]
        constant = inverse - np.einsum("ni,ni->n", along, place)
        return np.column_stack([along, constant])


# Farther from the axis COLMAP's fisheye models, in terms of x / z and y / z, do not hold.
MOST_ANGLE_RAD = np.radians(85.0)


class WideLens(Lens):
    """A fisheye or a panorama, depth along the ray; see :func:`lens_of`.

    Of a fisheye, the pixels that look no farther than 85 degrees from its axis. Most of what a
    wide image shows may lie alongside a movement and keep its depth: more than half must agree.
    """

    share = 0.9

    def __init__(
        self, camera: CameraConfig, step: int, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        self._camera = colmap_camera(camera, moved)
        self._is_fisheye = camera.projection == "fisheye"
        self._pixel_grid(camera, step)
        if self._is_fisheye:
            # The same pixels whatever is moved, which is little.
            unmoved = colmap_camera(camera)
            rays = np.asarray(unmoved.cam_ray_from_img(self._pixels), np.float64)
            back = np.asarray(unmoved.img_from_cam(rays), np.float64)
            with np.errstate(invalid="ignore"):
                kept = np.abs(back - self._pixels).max(axis=1) < 1e-3
                kept &= _angle_rad(rays) < MOST_ANGLE_RAD
            self.rows, self.columns = self.rows[kept], self.columns[kept]
            self._pixels, self.places = self._pixels[kept], self.places[kept]
        self.rays = np.asarray(self._camera.cam_ray_from_img(self._pixels), np.float64)
        self._most_rad = float(_angle_rad(self.rays).max()) if self._is_fisheye else np.inf
        self.curvature = float(np.sum(1.0 / np.square(pixels_per_radian(camera))) / 8.0)

    def project(self, points_m: Array) -> Array:
        """Project points (N, 3) in the camera to pixels (N, 2), NaN where it cannot see them."""
        pixels = np.full((len(points_m), 2), np.nan)
        with np.errstate(invalid="ignore"):
            seen = np.isfinite(points_m).all(axis=1) & (np.linalg.norm(points_m, axis=1) > 1e-6)
            seen &= _angle_rad(points_m) <= self._most_rad
        if seen.any():
            pixels[seen] = self._camera.img_from_cam(points_m[seen])
        return pixels

    def depth_of(self, points_m: Array) -> Array:
        """Return depths (N,) of points (N, 3) in the camera."""
        return np.asarray(np.linalg.norm(points_m, axis=1))

    def normals(self, points_m: Array, inverse: Array, slope: Array) -> Array:
        """Fit planes ``normal @ point = 1`` to what an image of inverse depth shows.

        Inverse depth is ``normal @ ray``, and so its change is that of the ray. Arguments and
        result are those of :meth:`Lens.normals`.
        """
        normal = np.full(points_m.shape, np.nan)
        pixels = self.project(points_m)
        seen = np.isfinite(pixels).all(axis=1) & np.isfinite(inverse) & np.isfinite(slope).all(1)
        if not seen.any():
            return normal
        rows = [points_m[seen] / np.linalg.norm(points_m[seen], axis=1, keepdims=True)]
        for step_px in (np.array([0.5, 0.0]), np.array([0.0, 0.5])):
            ahead, behind = (
                np.asarray(self._camera.cam_ray_from_img(pixels[seen] + sign * step_px))
                for sign in (1.0, -1.0)
            )
            rows.append(ahead - behind)
        system = np.stack(rows, axis=1)
        values = np.column_stack([inverse[seen], slope[seen]])
        # At the poles of a panorama a step sideways leads nowhere.
        regular = np.abs(np.linalg.det(system)) > 1e-12
        found = np.full((len(system), 3), np.nan)
        found[regular] = np.linalg.solve(system[regular], values[regular, :, None])[..., 0]
        normal[seen] = found
        return normal


def _angle_rad(points_m: Array) -> Array:
    """Return angles (N,) between points (N, 3) and the optical axis."""
    return np.asarray(np.arctan2(np.linalg.norm(points_m[:, :2], axis=1), points_m[:, 2]))


def colmap_camera(camera: CameraConfig, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Any:
    """Build the ``pycolmap.Camera`` of a camera.

    Args:
        camera: The camera.
        moved: What is added to cx and cy, pixels, and to the logarithm of the focal lengths; a
            panorama has none of them.
    """
    import pycolmap  # takes long to load, and only comparing frames needs it

    width, height = camera.width, camera.height
    if camera.projection == "equirectangular":
        return pycolmap.Camera(
            model="EQUIRECTANGULAR", width=width, height=height, params=[width, height]
        )
    fx, fy, cx, cy = camera.intrinsics
    scale = float(np.exp(moved[2]))
    pinhole = [fx * scale, fy * scale, cx + moved[0], cy + moved[1]]
    if camera.projection == "fisheye":
        params = [*pinhole, *(camera.fisheye_k or EQUIDISTANT)]
        return pycolmap.Camera(model="OPENCV_FISHEYE", width=width, height=height, params=params)
    params = [*pinhole, *camera.distortion, 0.0, 0.0, 0.0]
    return pycolmap.Camera(model="FULL_OPENCV", width=width, height=height, params=params)
