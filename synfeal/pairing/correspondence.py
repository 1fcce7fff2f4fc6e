"""Correspondences: places in one frame of points that another shows, and their visibility.

A point is *visible* in a frame if it projects into the image and its depth there is that of the
depth image, up to a relative tolerance (and two of the units that depth is stored in: 2 mm). It is
*hidden* if it projects into the image and is not visible: behind something, or where the other
frame has no depth. It is *outside* if it does not project into the image.

Depth between four pixels is interpolated as its inverse, which is exact on planes. Where a crease
runs between them, all depths from the least to the greatest of the four count as that of the image;
where an edge does, those of the pixels before it and those of the pixels behind it.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import depth_of_points, is_shown, pixels_of_points, rays_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import MILLIMETRES
from synfeal.geometry.poses import inverse

Array = NDArray[np.float64]

TOLERANCE = 0.01  # relative difference of depth
ROUNDING_UNITS = 2.0  # units of stored depth
# Second difference of inverse depth, relative, from which three pixels are on no plane.
BENT = 0.01
# Difference of inverse depth, relative, from which neighbours are parted by an edge, not a crease.
EDGE = 0.1


class State(IntEnum):
    """Fate of a pixel of one frame in another frame."""

    NO_DEPTH = 0
    VISIBLE = 1
    HIDDEN = 2
    OUTSIDE = 3


class ProjectedPoints(NamedTuple):
    """Points in a frame.

    Attributes:
        pixel: Column and row (..., 2); NaN where the camera cannot show the point.
        state: :class:`State` (...), uint8.
    """

    pixel: Array
    state: NDArray[np.uint8]


class DepthImage:
    """The depth of a frame, readable between pixels."""

    def __init__(self, depth_m: NDArray[np.floating]) -> None:
        """Prepare depth (H, W) in metres, inf for nothing."""
        with np.errstate(divide="ignore"):
            self._inverse = 1.0 / np.asarray(depth_m, np.float32)
        self._bent_along_y, self._bent_along_x = (self._bent(axis) for axis in (0, 1))

    def _bent(self, axis: int) -> NDArray[np.bool_]:
        """Mark pixels (H, W) that are on no plane with their two neighbours along an axis."""
        values = np.moveaxis(self._inverse, axis, 0)
        second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
        bent = np.zeros(self._inverse.shape, bool)
        np.moveaxis(bent, axis, 0)[1:-1] = second > BENT * values[1:-1]
        return bent

    def shows(self, pixel: Array, depth_m: Array, slack_m: Array) -> NDArray[np.bool_]:
        """Check whether the image has given depths (N,).

        Args:
            pixel: Columns and rows (N, 2) inside the image.
            depth_m: Depths (N,) to compare with.
            slack_m: By how much (N,) they may differ.
        """
        height, width = self._inverse.shape
        place = pixel - 0.5  # within half a pixel of the border, planes are continued
        left, upper = np.clip(np.floor(place).astype(np.int64), 0, [width - 2, height - 2]).T
        x, y = (place - np.stack([left, upper], axis=-1)).astype(np.float32).T
        first = upper * width + left
        corners = (first, first + 1, first + width, first + width + 1)
        a, b, c, d = values = [self._inverse.reshape(-1)[corner] for corner in corners]
        above, below = a + x * (b - a), c + x * (d - c)
        linear = above + y * (below - above)
        # Bent at one end alone, a crease runs along that end or beyond it.
        a_x, b_x, c_x, d_x = (self._bent_along_x.reshape(-1)[corner] for corner in corners)
        a_y, b_y, c_y, d_y = (self._bent_along_y.reshape(-1)[corner] for corner in corners)
        parted = (a_x & b_x) | (c_x & d_x) | (a_y & c_y) | (b_y & d_y)
        parted |= np.abs(a - b - c + d) > BENT * np.maximum.reduce(values)
        found = _within(depth_m, linear, linear, slack_m)
        rows = np.flatnonzero(parted)
        found[rows] = _on_either_side(np.stack(values, axis=-1)[rows], depth_m[rows], slack_m[rows])
        return found


def _on_either_side(
    inverse: NDArray[np.float32], depth_m: Array, slack_m: Array
) -> NDArray[np.bool_]:
    """Check depths (N,) against those of four pixels (N, 4), before and behind an edge."""
    ordered = np.sort(inverse, axis=-1)  # the farthest first
    ratio = np.ones((len(ordered), 3), np.float32)  # nothing beside nothing is no edge
    np.divide(ordered[:, :-1], ordered[:, 1:], out=ratio, where=ordered[:, 1:] > 0.0)
    is_edge = ratio.min(axis=-1) < 1.0 - EDGE
    last_behind = ratio.argmin(axis=-1)
    rows = np.arange(len(ordered))
    behind = np.where(is_edge, ordered[rows, last_behind], ordered[:, 3])
    before = np.where(is_edge, ordered[rows, last_behind + 1], ordered[:, 0])
    return _within(depth_m, behind, ordered[:, 0], slack_m) | _within(
        depth_m, ordered[:, 3], before, slack_m
    )


def _within(
    depth_m: Array,
    nearest: NDArray[np.float32],
    farthest: NDArray[np.float32],
    slack_m: Array,
) -> NDArray[np.bool_]:
    """Check whether depths (N,) are between two inverse depths, which are 0 for nothing."""
    with np.errstate(divide="ignore"):
        near_m, far_m = 1.0 / nearest, 1.0 / farthest
    return np.asarray((depth_m >= near_m - slack_m) & (depth_m <= far_m + slack_m), np.bool_)


def points_of_pixels(
    camera: CameraConfig, pixel: Array, depth_m: NDArray[np.floating], world_from_cam: Array
) -> Array:
    """Return the points (..., 3) in the world that pixels show; NaN without depth.

    Args:
        camera: Camera of the frame.
        pixel: Columns and rows (..., 2).
        depth_m: Depth (...) at these pixels, inf for nothing.
        world_from_cam: Pose (4, 4) of the frame.
    """
    known_m = np.where(np.isfinite(depth_m), depth_m, np.nan).astype(np.float64)
    point = known_m[..., None] * rays_of_pixels(camera, pixel)
    return np.asarray(point @ world_from_cam[:3, :3].T + world_from_cam[:3, 3])


def look_for(
    point_m: Array,
    camera: CameraConfig,
    depth: DepthImage,
    world_from_cam: Array,
    tolerance: float = TOLERANCE,
) -> ProjectedPoints:
    """Find points in a frame.

    Args:
        point_m: Points (..., 3) in the world; NaN where there is none.
        camera: Camera of the frame.
        depth: What the frame shows.
        world_from_cam: Pose (4, 4) of the frame.
        tolerance: Relative difference of depth up to which a point is visible.
    """
    cam_from_world = inverse(world_from_cam)
    in_cam = point_m @ cam_from_world[:3, :3].T + cam_from_world[:3, 3]
    known = np.isfinite(in_cam).all(axis=-1)
    pixel = pixels_of_points(camera, in_cam)
    inside = known & is_shown(camera, pixel)
    state = np.where(known, State.OUTSIDE, State.NO_DEPTH).astype(np.uint8)
    expected_m = depth_of_points(camera, in_cam[inside])
    unit_m = 1.0 / (camera.depth_units_per_m or MILLIMETRES)
    slack_m = np.maximum(ROUNDING_UNITS * unit_m, tolerance * expected_m)
    is_visible = depth.shows(pixel[inside], expected_m, slack_m)
    state[inside] = np.where(is_visible, State.VISIBLE, State.HIDDEN)
    return ProjectedPoints(pixel, state)
