"""Does what one frame sees lie where another frame sees it?

The depth of frame a, lifted and moved by the two poses, predicts for each of its pixels a pixel and
a depth in frame b. Depth in b is interpolated as 1/z, which is exact on planes, and only where its
neighbours lie on one surface. What may differ is worked out for each pixel: depth is rounded
to millimetres in both frames; rounding along a ray of a is seen in b magnified where b looks along
the surface; and between four pixels that are on no plane depth is not known any better than they
differ from one. Differences are counted in multiples of that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.geometry.poses import relative
from synfeal.validation.camera import Lens

Array = NDArray[np.float64]

BEND = 0.05  # 1/z bends by less, of itself, from pixel to pixel on one surface; planes do not bend
OCCLUSION_RATIO = 1.05  # a point more than 5 % behind the surface is hidden by it
MIN_PIXELS = 100
ROUNDING = 0.5  # units of stored depth
POSE_ROUNDING = 1e-10  # positions of both frames are stored with eleven digits
GREY_NOISE = 5.0  # grey levels, in rendered frames as resampled here
MAX_SHIFT_ERROR_PX = 0.05


@dataclass(frozen=True)
class ComparedFrame:
    """One frame."""

    world_from_cam: Array  # (4, 4)
    depth_m: NDArray[Any]  # (H, W), inf where there is none
    grey: NDArray[Any]  # (H, W), 0 to 255
    unit_m: float = 0.001  # in which depth is stored

    @cached_property
    def inverse_depth(self) -> NDArray[Any]:
        """One over the depth (H, W), 0 where there is none."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.depth_m)

    @cached_property
    def is_surface(self) -> NDArray[np.bool_]:
        """Pixels (H, W) whose neighbours lie on the same surface, however slanted."""
        inverse = np.pad(self.inverse_depth, 1, mode="edge")
        middle = inverse[1:-1, 1:-1]
        bend = np.maximum(
            np.abs(inverse[:-2, 1:-1] - 2.0 * middle + inverse[2:, 1:-1]),
            np.abs(inverse[1:-1, :-2] - 2.0 * middle + inverse[1:-1, 2:]),
        )
        return np.asarray((bend < BEND * middle) & np.isfinite(self.depth_m), np.bool_)


@dataclass(frozen=True)
class Residual:
    """Disagreement of a pair of frames; medians over the pixels both see."""

    overlap: float  # share of the pixels of a with depth that b sees, hidden ones included
    # whether so many of them are behind what b sees that all that follows is NaN
    hidden: bool = True
    # difference in depth of a share of the points, half of perspective images, in multiples of what
    # may differ there
    depth: float = math.nan
    in_front: float = math.nan  # share of points that lie in front of what b sees, which cannot be
    grey: float = math.nan  # median difference of grey levels
    # by how much b's image must be moved, turned and zoomed to explain the differences of grey
    # best; NaN where there is too little texture to tell to 0.05 pixels
    shift_px: float = math.nan


@dataclass(frozen=True)
class _Reprojected:
    """The pixels of a that b sees: predicted depth, depth and grey of b there, its gradient."""

    mask: NDArray[np.bool_]
    predicted_m: Array
    depth_m: Array
    tolerance_m: Array  # by how much the two depths may differ
    grey: Array
    gradient: Array


def compare(a: ComparedFrame, b: ComparedFrame, lens: Lens) -> Residual | None:
    """Compute the residuals of a pair; None if b sees fewer than ``MIN_PIXELS`` of a's grid."""
    seen = _look(a, b, lens)
    if np.count_nonzero(seen.mask) < MIN_PIXELS:
        return None
    known = np.isfinite(a.depth_m[lens.rows, lens.columns])
    overlap = float(np.sum(seen.mask) / np.sum(known))
    ratio = seen.predicted_m / seen.depth_m
    visible = np.isfinite(seen.depth_m) & (ratio < OCCLUSION_RATIO)
    if np.count_nonzero(visible) < MIN_PIXELS:
        return Residual(overlap)
    difference_m = np.abs(seen.predicted_m - seen.depth_m)[visible]
    grey_a = a.grey[lens.rows, lens.columns].astype(np.float64)[visible]
    grey_error = seen.grey[visible] - grey_a
    return Residual(
        overlap,
        hidden=False,
        depth=float(np.quantile(difference_m / seen.tolerance_m[visible], lens.share)),
        in_front=float(np.mean(ratio[visible] * OCCLUSION_RATIO < 1.0)),
        grey=float(np.median(np.abs(grey_error))),
        shift_px=_shift_px(grey_error, seen.gradient[visible], lens.places[visible]),
    )


def _look(a: ComparedFrame, b: ComparedFrame, lens: Lens) -> _Reprojected:
    """Move the grid of a into b and read b there."""
    depth = a.depth_m[lens.rows, lens.columns].astype(np.float64)
    b_from_a = relative(b.world_from_cam, a.world_from_cam)
    known = np.isfinite(depth)
    points = np.where(known, depth, np.nan)[:, None] * lens.rays
    points = points @ b_from_a[:3, :3].T + b_from_a[:3, 3]
    pixels = lens.project(points) - 0.5
    height, width = b.depth_m.shape
    with np.errstate(invalid="ignore"):
        mask = np.all((pixels >= 0.0) & (pixels < [width - 1, height - 1]), axis=1)
    corner = np.floor(np.where(mask[:, None], pixels, 0.0)).astype(int)
    fraction = np.where(mask[:, None], pixels - corner, 0.0)
    on_surface = _corners(b.is_surface, corner).all(axis=0)
    with np.errstate(divide="ignore"):
        inverse, slope = _interpolate(b.inverse_depth, corner, fraction)
        seen = np.where(mask & on_surface, 1.0 / inverse, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        magnified = _magnification(points, lens.rays @ b_from_a[:3, :3].T, inverse, slope, lens)
        seen[magnified <= 0.0] = np.nan
        v00, v01, v10, v11 = _corners(b.inverse_depth, corner)
        off_plane = seen**2 * np.abs(v00 + v11 - v01 - v10) / 2.0
    rounding_m = ROUNDING * max(a.unit_m, b.unit_m)
    tolerance = rounding_m * (1.0 + np.abs(magnified)) + off_plane + lens.curvature * seen
    tolerance += POSE_ROUNDING * max(np.abs(v.world_from_cam[:3, 3]).max() for v in (a, b))
    grey, gradient = _interpolate(b.grey, corner, fraction)
    return _Reprojected(mask, lens.depth_of(points), seen, tolerance, grey, gradient)


def _magnification(
    points: Array, rays_of_a: Array, inverse: Array, slope: Array, lens: Lens
) -> Array:
    """Compute how much depth in b changes per change of depth in a, (N,), for points (N, 3).

    Of ``inverse`` (N,) depth in b, which changes by ``slope`` (N, 2) from pixel to pixel; points
    and rays at depth 1 in a are in the frame of b.

    Moved along the ray of a, the plane ``normal @ point = 1`` is met in b nearer or farther by
    ``normal @ ray_of_a / normal @ ray_of_b``. Below 0, a sees the surface from its other side: it
    can only be another one, behind a thin wall.
    """
    normal = lens.normals(points, inverse, slope)
    return np.asarray(np.einsum("ni,ni->n", normal, rays_of_a) / inverse)


def _corners(image: NDArray[Any], corner: NDArray[np.int_]) -> Array:
    """Return values (4, N) at the pixel, its right, lower and lower right neighbour."""
    width = image.shape[1]
    upper_left = corner[:, 1] * width + corner[:, 0]
    # One look-up along the flat image is three times as fast as four by row and column.
    index = upper_left + np.array([[0], [1], [width], [width + 1]])
    corners: Array = np.take(image.reshape(-1), index)
    return corners


def _interpolate(
    image: NDArray[Any], corner: NDArray[np.int_], fraction: Array
) -> tuple[Array, Array]:
    """Interpolate values (N,) and gradients (N, 2) per pixel bilinearly."""
    v00, v01, v10, v11 = _corners(image, corner)
    x, y = fraction.T
    upper, lower = v00 + x * (v01 - v00), v10 + x * (v11 - v10)
    along_x = (1 - y) * (v01 - v00) + y * (v11 - v10)
    return upper + y * (lower - upper), np.stack([along_x, lower - upper], axis=1)


def _shift_px(grey_error: Array, gradient: Array, place: Array) -> float:
    """Solve ``error + gradient @ d = 0`` for shifts ``d`` and return their root mean square.

    A shift is that of an image moved, turned and zoomed, so a camera that goes forward shows too.
    Of errors (N,), gradients (N, 2) per pixel and places (N, 2), -1 to 1 across the image's width.
    """
    x, y = place.T
    shifts = np.stack([[1 + 0 * x, 0 * x, x, -y], [0 * x, 1 + 0 * x, y, x]])  # (2, 4, N)
    columns = np.einsum("nk,kpn->np", gradient, shifts)
    scale = 1.0 + 1.4826 * np.median(np.abs(grey_error))
    weight = 1.0 / (1.0 + (grey_error / scale) ** 2)
    normal = (columns * weight[:, None]).T @ columns
    told = np.linalg.eigvalsh(normal)[0] * MAX_SHIFT_ERROR_PX**2
    if told < GREY_NOISE**2:
        return math.nan
    solution = np.linalg.solve(normal, columns.T @ (weight * grey_error))
    left = 1.4826 * float(np.median(np.abs(grey_error - columns @ solution)))
    if told < left**2:
        return math.nan  # seen from elsewhere, a texture differs by more than a shift
    moved = np.einsum("kpn,p->kn", shifts, solution)
    return float(np.sqrt(np.mean(np.sum(moved**2, axis=0))))


def camera_normal(
    a: ComparedFrame, b: ComparedFrame, lens: Lens, moved: Sequence[Lens], delta: Array
) -> Array:
    """Build the normal equations of errors in depth against the parameters of the camera.

    Args:
        a: Frame whose points are projected.
        b: Frame they are projected into.
        lens: Lens of both.
        moved: Lenses with one parameter each moved a little, P of them.
        delta: How far each parameter is moved (P,).

    Returns:
        Matrix and right side (P, P + 1); depths count in multiples of what may differ.
    """
    here, *there = (_look(a, b, each) for each in (lens, *moved))
    residual = here.predicted_m - here.depth_m
    derivative = np.stack([t.predicted_m - t.depth_m - residual for t in there], axis=1) / delta
    system = np.column_stack([derivative, -residual]) / here.tolerance_m[:, None]
    with np.errstate(invalid="ignore"):
        good = np.isfinite(system).all(axis=1) & (np.abs(residual) < 0.02 * here.depth_m)
        good &= np.all(np.abs(derivative * delta) < 0.02 * here.depth_m[:, None], axis=1)
    system = system[good]
    return system[:, :-1].T @ system
