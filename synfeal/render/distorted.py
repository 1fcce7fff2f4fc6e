"""Images through a lens: a larger pinhole image, resampled.

Colours: the pinhole image has twice the resolution of the distorted image's centre, and each pixel
is the mean of 2x2 points, read bilinearly: within 3 % of the contrast (RMS) of a mean of 64 rays.
Depth: along the optical axis it is the same in both images. Its inverse is linear in the pixels of
a plane, so it is interpolated there and exact; elsewhere the nearest pixel's is taken. The triangle
that a pixel shows is that of the nearest pixel of the pinhole image, at most 0.36 pixels away.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from synfeal.camera.projection import normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.errors import Argument, InputError
from synfeal.render.base import Depth, Faces, Renderer, Rgb

Array = NDArray[np.float64]
# Rows of an image and an offset, pixels, to points (rows, W, 2) of a drawn image.
Locate = Callable[[range, tuple[float, float]], Array]

OVERSAMPLING = 2.0
MARGIN_PX = 3  # around the pixels that are read: neighbours, and differences between them
LONGEST_SIDE_PX = 8192  # what CameraConfig and OpenGL allow
# Points within a pixel whose mean is its colour, pixels from its centre.
_POINTS = [(x, y) for y in (-0.25, 0.25) for x in (-0.25, 0.25)]
_BAND = 64  # rows of the image that are mapped at a time
# Second difference of inverse depth, relative, from which neighbours lie on different surfaces.
_BENT = 0.01


class DistortedRenderer(Renderer):
    """Implements :class:`synfeal.render.base.Renderer` around one without distortion."""

    def __init__(self, open_pinhole: Callable[[CameraConfig], Renderer], camera: CameraConfig):
        """Open the inner renderer with the camera that :func:`covering_camera` gives."""
        self._shape = (camera.height, camera.width)
        pinhole = covering_camera(camera)
        self._color = color_matrix(
            lambda rows, offset: _seen_at(camera, pinhole, rows, offset),
            size=self._shape,
            drawn_size=(pinhole.height, pinhole.width),
        )
        self._depth_taps = taps(_seen_at(camera, pinhole, range(camera.height)), pinhole.width)
        self._inner = open_pinhole(pinhole)

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Render colours (H, W, 3) from a pose ``world_from_cam`` (4, 4)."""
        return self._resampled(self._inner.render(world_from_cam))

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W), metres along the optical axis or inf."""
        rgb, depth_m = self._inner.render_rgbd(world_from_cam)
        return self._resampled(rgb), resampled_depth(depth_m, *self._depth_taps)

    def render_depth(self, world_from_cam: NDArray[np.float64]) -> Depth:
        """Render depth (H, W) alone: metres along the optical axis, inf for nothing."""
        return resampled_depth(self._inner.render_depth(world_from_cam), *self._depth_taps)

    def render_faces(self, world_from_cam: NDArray[np.float64]) -> Faces:
        """Return the triangle (H, W) that the nearest pixel of the inner image shows, or -1."""
        index, weight = self._depth_taps
        nearest = np.take_along_axis(index, weight.argmax(axis=-1)[..., None], axis=-1)[..., 0]
        return self._inner.render_faces(world_from_cam).reshape(-1)[nearest]

    def close(self) -> None:
        """Close the inner renderer."""
        self._inner.close()

    def _resampled(self, rgb: Rgb) -> Rgb:
        mean = self._color @ rgb.reshape(-1, 3).astype(np.float32)
        pixels: Rgb = np.rint(mean).astype(np.uint8).reshape(*self._shape, 3)
        return pixels


def covering_camera(camera: CameraConfig) -> CameraConfig:
    """Find the pinhole that sees all that a lens sees, at least at the resolution of its centre.

    Raises:
        InputError: the view is so wide that the pinhole image would exceed 8192 pixels.
    """
    x, y = np.arange(camera.width + 1.0), np.arange(camera.height + 1.0)
    sides = [np.column_stack([x, 0.0 * x + edge]) for edge in (0.0, camera.height)]
    sides += [np.column_stack([0.0 * y + edge, y]) for edge in (0.0, camera.width)]
    edge = normalised_of_pixels(camera, np.concatenate(sides))
    fx, fy, _, _ = camera.intrinsics
    extent = np.ptp(edge, axis=0) * [fx, fy]
    scale = min(OVERSAMPLING, (LONGEST_SIDE_PX - 2 * MARGIN_PX - 2) / extent.max())
    if scale < 1.0:
        raise InputError(
            Argument("distortion"),
            f"the lens sees so much that a pinhole needs {extent.max():.0f} pixels for it, more"
            f" than {LONGEST_SIDE_PX}",
            "give a smaller width",
        )
    focal = np.array([fx, fy]) * scale
    low = np.floor(edge.min(axis=0) * focal) - MARGIN_PX
    width, height = np.ceil(edge.max(axis=0) * focal - low) + MARGIN_PX
    lens = dict(zip(("fx", "fy", "cx", "cy"), (*focal, *-low), strict=True))
    size = {"width": max(16, int(width)), "height": max(16, int(height))}
    return camera.model_copy(update={**lens, **size, "distortion": (0.0,) * 5})


def resampled_depth(
    depth_m: Depth, index: NDArray[np.int32], weight: NDArray[np.floating]
) -> Depth:
    """Interpolate the depth of a pinhole image between its pixels.

    Across edges and creases, and beside nothing, the nearest pixel is taken instead.

    Args:
        depth_m: Depth (h, w), metres, inf for nothing.
        index: Neighbours (..., 4) of each point in the flat image, see :func:`taps`.
        weight: Weights (..., 4) of the neighbours.

    Returns:
        Depth (...), metres, inf for nothing.
    """
    inverse = 1.0 / depth_m
    values = inverse.reshape(-1)[index]
    linear = (values * weight).sum(axis=-1)
    nearest = np.take_along_axis(values, weight.argmax(axis=-1)[..., None], axis=-1)[..., 0]
    bent = _bent(inverse).reshape(-1)[index].any(axis=-1)
    with np.errstate(divide="ignore"):
        return (1.0 / np.where(bent, nearest, linear)).astype(np.float32)


def _bent(inverse: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Mark (h, w) inverse depth that is not of a plane: edges, creases and beside nothing."""
    bent = np.zeros(inverse.shape, bool)
    for axis in (0, 1):
        values, into = np.moveaxis(inverse, axis, 0), np.moveaxis(bent, axis, 0)
        second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
        into[1:-1] |= second > _BENT * values[1:-1]
    return bent


def _seen_at(
    camera: CameraConfig, pinhole: CameraConfig, rows: range, offset: tuple[float, float] = (0, 0)
) -> Array:
    """Return the places (rows, W, 2) in the pinhole image that rows of the image show."""
    normalised = normalised_of_pixels(camera, pixels_of_rows(camera, rows, offset))
    fx, fy, cx, cy = pinhole.intrinsics
    return normalised * [fx, fy] + [cx, cy]


def pixels_of_rows(camera: CameraConfig, rows: range, offset: tuple[float, float]) -> Array:
    """Return pixel centres (rows, W, 2), column and row, of some rows, moved by ``offset``."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.array(rows) + 0.5)
    return np.stack([column, row], axis=-1) + offset


def taps(pixel: Array, width: int) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return neighbours (..., 4) of points (..., 2) in a flat image of ``width``, and weights.

    Of a point that is NaN all weights are 0.
    """
    shown = np.isfinite(pixel).all(axis=-1, keepdims=True)
    pixel = np.where(shown, pixel, 0.5)
    corner = np.floor(pixel - 0.5)
    x, y = np.moveaxis(pixel - 0.5 - corner, -1, 0)
    first = corner[..., 1] * width + corner[..., 0]
    index = np.stack([first, first + 1, first + width, first + width + 1], axis=-1)
    weight = np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=-1)
    return index.astype(np.int32), (weight * shown).astype(np.float32)


def color_matrix(
    locate: Locate, size: tuple[int, int], drawn_size: tuple[int, int]
) -> sparse.csr_matrix:
    """Build the matrix that makes the pixels of an image from those of a drawn one.

    Each is the mean of 2x2 points, read bilinearly.

    Args:
        locate: Gives where rows of the image, moved by an offset in pixels, lie in the drawn one.
        size: Height and width of the image.
        drawn_size: Height and width of the drawn image.

    Returns:
        Weights (pixels, drawn pixels); rows add up to less than 1 where points are NaN.
    """
    height, width = size
    per_row = 4 * len(_POINTS)
    index = np.empty((height, width, per_row), np.int32)
    weight = np.empty((height, width, per_row), np.float32)
    for start in range(0, height, _BAND):
        rows = range(start, min(start + _BAND, height))
        for number, point in enumerate(_POINTS):
            at = np.s_[start : rows.stop, :, 4 * number : 4 * number + 4]
            index[at], weight[at] = taps(locate(rows, point), drawn_size[1])
    ends = np.arange(0, index.size + 1, per_row)
    shape = (height * width, drawn_size[0] * drawn_size[1])
    values = weight.reshape(-1) / len(_POINTS)
    return sparse.csr_matrix((values, index.reshape(-1), ends), shape=shape)
