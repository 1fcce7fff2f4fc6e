"""Projection: from pixels to rays and from points to pixels, for every camera model.

Depth is what a model's depth images hold (:func:`depth_of_points`): along the optical axis of a
perspective camera, along the ray of one that may see behind itself. :func:`rays_of_pixels` gives
points at depth 1, so that ``depth * ray`` is the point that a pixel shows, whatever the model.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.distortion import Array, distort, fold_radius, undistort
from synfeal.camera.fisheye import (
    EQUIDISTANT,
    angle_of_radius,
    largest_angle_rad,
    radius_of_angle,
)

Projection = Literal["fisheye", "equirectangular"]


class Intrinsics(NamedTuple):
    """Pinhole intrinsics in pixels; the centre of the top-left pixel is (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float

    def matrix(self, centre_shift_px: float = 0.0) -> Array:
        """Return the camera matrix (3, 3), with a shift of the principal point.

        It is 0 where the centre of the first pixel is at (0.5, 0.5), as here and in COLMAP; -0.5
        where it is at (0, 0), as in OpenCV and Open3D.
        """
        cx, cy = self.cx + centre_shift_px, self.cy + centre_shift_px
        return np.array([[self.fx, 0.0, cx], [0.0, self.fy, cy], [0.0, 0.0, 1.0]])

    @classmethod
    def of_view(cls, width: int, height: int, horizontal_fov_deg: float) -> Self:
        """Build intrinsics with square pixels and the principal point in the image's centre."""
        focal = width / 2.0 / math.tan(math.radians(horizontal_fov_deg) / 2.0)
        return cls(focal, focal, width / 2.0, height / 2.0)


class Camera(Protocol):
    """Interface of a perspective camera: image size, intrinsics and lens distortion."""

    @property
    def width(self) -> int:
        """Image width, pixels."""

    @property
    def height(self) -> int:
        """Image height, pixels."""

    @property
    def intrinsics(self) -> Intrinsics:
        """Intrinsics, pixels, whether given or derived from the field of view."""

    @property
    def distortion(self) -> tuple[float, float, float, float, float]:
        """Brown-Conrady coefficients: k1, k2, p1, p2, k3."""


class AnyCamera(Camera, Protocol):
    """Interface of a camera of any model."""

    @property
    def projection(self) -> Projection | None:
        """The model; None is a perspective camera."""

    @property
    def fisheye_k(self) -> tuple[float, float, float, float] | None:
        """Coefficients of a fisheye lens: k1, k2, k3, k4; None is 0."""


def rays_of_pixels(camera: AnyCamera, pixel: Array) -> Array:
    """Return the points at depth 1 that pixels show, in the frame of the camera.

    Args:
        camera: A camera of any model.
        pixel: Pixels (..., 2), column and row; the centre of the first is (0.5, 0.5).

    Returns:
        Points (..., 3): z is 1 for a perspective camera, the length for others. NaN where the lens
        shows nothing.
    """
    if camera.projection == "equirectangular":
        longitude = (pixel[..., 0] / camera.width - 0.5) * 2.0 * np.pi
        latitude = (pixel[..., 1] / camera.height - 0.5) * np.pi
        level = np.cos(latitude)
        return np.stack(
            [level * np.sin(longitude), np.sin(latitude), level * np.cos(longitude)], axis=-1
        )
    if camera.projection == "fisheye":
        fx, fy, cx, cy = camera.intrinsics
        place = (pixel - [cx, cy]) / [fx, fy]
        radius = np.hypot(place[..., 0], place[..., 1])
        angle = angle_of_radius(radius, camera.fisheye_k or EQUIDISTANT)
        sideways = np.sin(angle) / np.where(radius > 0.0, radius, 1.0)
        return np.concatenate([place * sideways[..., None], np.cos(angle)[..., None]], axis=-1)
    normalised = normalised_of_pixels(camera, pixel)
    return np.concatenate([normalised, np.ones_like(normalised[..., :1])], axis=-1)


def pixels_of_points(camera: AnyCamera, point: Array) -> Array:
    """Return the pixels that show points, whatever is in front of them.

    Args:
        camera: A camera of any model.
        point: Points (..., 3) in the frame of the camera.

    Returns:
        Pixels (..., 2), column and row, inside the image or not. NaN where the lens cannot show
        the point: behind a perspective camera, or beyond where the lens folds over.
    """
    x, y, z = np.moveaxis(point, -1, 0)
    if camera.projection == "equirectangular":
        column = (np.arctan2(x, z) / (2.0 * np.pi) + 0.5) * camera.width
        row = (np.arctan2(y, np.hypot(x, z)) / np.pi + 0.5) * camera.height
        return np.stack([column, row], axis=-1)
    if camera.projection == "fisheye":
        fx, fy, cx, cy = camera.intrinsics
        coefficients = camera.fisheye_k or EQUIDISTANT
        sideways = np.hypot(x, y)
        angle = np.arctan2(sideways, z)
        radius = radius_of_angle(angle, coefficients)
        scale = radius / np.where(sideways > 0.0, sideways, 1.0)
        scale = np.where(angle < largest_angle_rad(coefficients), scale, np.nan)
        return point[..., :2] * scale[..., None] * [fx, fy] + [cx, cy]
    ahead = z > 0.0
    normalised = point[..., :2] / np.where(ahead, z, 1.0)[..., None]
    # Beyond its fold a lens model maps what is far outside back into the image.
    radius = np.hypot(normalised[..., 0], normalised[..., 1])
    shown = ahead & (radius < fold_radius(camera.distortion))
    return np.where(shown[..., None], pixels_of_normalised(camera, normalised), np.nan)


def depth_of_points(camera: AnyCamera, point: Array) -> Array:
    """Return the depths (...) of points (..., 3) in the frame of a camera, metres.

    z for a perspective camera, the distance from its centre for others.
    """
    return np.asarray(point[..., 2] if camera.projection is None else _lengths(point))


def is_shown(camera: AnyCamera, pixel: Array) -> NDArray[np.bool_]:
    """Check which pixels (..., 2) are inside the image, (...); NaN is not."""
    with np.errstate(invalid="ignore"):
        inside = (pixel >= 0.0) & (pixel <= [camera.width, camera.height])
    return np.asarray(inside.all(axis=-1), np.bool_)


def pixel_offset(camera: AnyCamera, from_pixel: Array, to_pixel: Array) -> Array:
    """Return ``to_pixel - from_pixel`` (..., 2), the short way round in a panorama."""
    offset = to_pixel - from_pixel
    if camera.projection == "equirectangular":
        turns = np.round(offset[..., 0] / camera.width)
        offset = offset - np.stack([turns * camera.width, np.zeros_like(turns)], axis=-1)
    return np.asarray(offset)


def pixels_per_radian(camera: AnyCamera) -> tuple[float, float]:
    """Return the resolution along x and y in the middle of the image, pixels per radian."""
    if camera.projection == "equirectangular":
        return camera.width / (2.0 * np.pi), camera.height / np.pi
    fx, fy, _, _ = camera.intrinsics
    return fx, fy


def horizontal_fov_rad(camera: AnyCamera) -> float:
    """Return the angle between what the middles of the left and right edge show, at most 2 pi."""
    if camera.projection == "equirectangular":
        return 2.0 * math.pi
    if camera.projection is None:
        return 2.0 * math.atan(camera.width / 2.0 / camera.intrinsics.fx)
    fx, _, cx, _ = camera.intrinsics
    radii = np.array([cx, camera.width - cx]) / fx
    coefficients = camera.fisheye_k or EQUIDISTANT
    angles = angle_of_radius(radii, coefficients)
    return float(np.nan_to_num(angles, nan=largest_angle_rad(coefficients)).sum())


def _lengths(vector: Array) -> Array:
    return np.asarray(np.linalg.norm(vector, axis=-1))


def normalised_of_pixels(camera: Camera, pixel: Array) -> Array:
    """Map pixels of a perspective camera to normalised image coordinates, without distortion.

    Args:
        camera: The camera.
        pixel: Column and row (..., 2), pixels.

    Returns:
        x / z and y / z (..., 2); NaN where the lens folds over before it reaches the pixel.
    """
    fx, fy, cx, cy = camera.intrinsics
    return undistort((pixel - [cx, cy]) / [fx, fy], camera.distortion)


def pixels_of_normalised(camera: Camera, normalised: Array) -> Array:
    """Return pixels (..., 2) of normalised image coordinates (..., 2) of a perspective camera."""
    fx, fy, cx, cy = camera.intrinsics
    return distort(normalised, camera.distortion) * [fx, fy] + [cx, cy]


def cell_centres_px(camera: Camera, columns: int, rows: int) -> Array:
    """Divide an image into equal cells and return their centres.

    Args:
        camera: Camera of the image.
        columns: Number of cells across; with the image's width, the cells are its pixels.
        rows: Number of cells down.

    Returns:
        Centres (rows, columns, 2): x and y in the image, pixels.
    """
    x = (np.arange(columns) + 0.5) * camera.width / columns
    y = (np.arange(rows) + 0.5) * camera.height / rows
    return np.stack(np.meshgrid(x, y), axis=-1)


def cell_directions(camera: AnyCamera, columns: int, rows: int) -> Array:
    """Return the points at depth 1 that the centres of equal cells of an image show.

    Args:
        camera: A camera of any model.
        columns: Number of cells across the image.
        rows: Number of cells down the image.

    Returns:
        Points (rows, columns, 3) in the frame of the camera, as :func:`rays_of_pixels` gives
        them: NaN where the lens shows nothing.
    """
    return rays_of_pixels(camera, cell_centres_px(camera, columns, rows))


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
