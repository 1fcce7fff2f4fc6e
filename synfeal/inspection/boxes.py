"""Boxes of free space at camera heights: as few as cover most of a place, room by room."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from synfeal.inspection.freespace import CAMERA_HEIGHT_M, FreeSpace, step_m_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Corner = tuple[int, int, int]

# A layer of points is worth adding to a box if more than 2/3 of it are wanted. A bound on the whole
# box instead would let it grow into the walls until the bound is used up.
UNWANTED_WEIGHT = 2.0
MOST_BOXES = 10
LEAST_GAIN = 0.04  # share of all wanted points that another box must add
WALL = 1 / 3  # an upright layer of a box of which less is wanted is a wall, with a door or without


def suggest_box(space: FreeSpace) -> Array | None:
    """Suggest the largest of :func:`suggest_boxes`, (2, 3), or None."""
    boxes, _ = suggest_boxes([space])
    return boxes[0] if len(boxes) else None


def suggest_boxes(spaces: Sequence[FreeSpace]) -> tuple[Array, Array]:
    """Suggest boxes at camera heights above the floors of some spaces.

    Each is as large as can be while it is mostly clear of surfaces and of earlier boxes, and does
    not reach through walls: paths in it could not.

    Returns:
        Boxes (B, 2, 3), metres, the largest first; and the points (N, 3) that cameras may be at,
        which the boxes are to hold.
    """
    wanted = np.logical_or.reduce([_at_camera_height(space) for space in spaces])
    axes_m = spaces[0].axes_m
    grid_m = np.stack(np.meshgrid(*axes_m, indexing="ij"), axis=-1)
    left = wanted.copy()
    boxes: list[Array] = []
    while len(boxes) < MOST_BOXES and left.any():
        lower, upper = largest_box(left, is_neutral=wanted & ~left)
        lower, upper = one_room(wanted, left, lower, upper)
        inside = tuple(slice(a, b + 1) for a, b in zip(lower, upper, strict=True))
        if left[inside].sum() < LEAST_GAIN * wanted.sum():
            break
        left[inside] = False
        limits = [
            (axis[first] - step_m_of(axis) / 4.0, axis[last] + step_m_of(axis) / 4.0)
            for axis, first, last in zip(axes_m, lower, upper, strict=True)
        ]
        boxes.append(np.round(np.array(limits, np.float64).T, 2))
    return np.reshape(boxes, (-1, 2, 3)), grid_m[wanted]


def one_room(wanted: Mask, left: Mask, lower: Corner, upper: Corner) -> tuple[Corner, Corner]:
    """Cut a box at the walls that cross it.

    Args:
        wanted: Points (X, Y, Z) that cameras may be at.
        left: Those of them that no box holds yet.
        lower: First indices of the box.
        upper: Last indices, included.

    Returns:
        First and last indices of the piece between two walls that holds most of what is left.
    """
    first, last = list(lower), list(upper)
    cut = True
    while cut:
        cut = False
        for axis in (0, 1):
            inside = tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))
            others = tuple(other for other in range(3) if other != axis)
            is_open = wanted[inside].mean(axis=others) >= WALL
            if is_open.all() or not is_open.any():
                continue
            counts = left[inside].sum(axis=others)
            edges = np.flatnonzero(np.diff(np.pad(is_open.astype(np.int8), 1)))
            runs = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
            start, stop = max(runs, key=lambda run: int(counts[run[0] : run[1]].sum()))
            first[axis], last[axis] = first[axis] + start, first[axis] + stop - 1
            cut = True
    return (first[0], first[1], first[2]), (last[0], last[1], last[2])


def _at_camera_height(space: FreeSpace) -> Mask:
    """Mark the clear points (X, Y, Z) that lie 0.8 to 2.0 m above a floor of the space."""
    low, high = CAMERA_HEIGHT_M
    at_height = np.zeros(len(space.axes_m[2]), dtype=np.bool_)
    for floor_m in space.floors_m or (() if space.floor_m is None else (space.floor_m,)):
        height_m = space.axes_m[2] - floor_m
        at_height |= (height_m >= low) & (height_m <= high)
    return np.asarray(space.is_clear & at_height)


def share_inside(points_m: Array, boxes_m: Array) -> float:
    """Measure the share of points (N, 3) in at least one of the boxes (B, 2, 3)."""
    inside = np.zeros(len(points_m), dtype=np.bool_)
    for low_m, high_m in boxes_m:
        inside |= ((points_m >= low_m) & (points_m <= high_m)).all(axis=1)
    return float(inside.mean())


def largest_box(is_wanted: Mask, is_neutral: Mask | None = None) -> tuple[Corner, Corner]:
    """Find the box of greatest worth and return its first and last indices, both included.

    Worth is the number of wanted points less twice the number of others, neutral ones not
    counted; at least one of (X, Y, Z) is wanted. Every pair of limits along x and z that may be
    best is tried; along y the best run of layers is found in one pass (Kadane).
    """
    worth = np.where(is_wanted, 1.0, -UNWANTED_WEIGHT)
    if is_neutral is not None:
        worth[is_neutral] = 0.0
    best: tuple[float, Corner, Corner] = (-np.inf, (0, 0, 0), (0, 0, 0))
    layers = np.flatnonzero(is_wanted.any(axis=(0, 1))).tolist()  # the best box ends at such
    for z0, z1 in ((a, b) for a in layers for b in layers if a <= b):
        layer = worth[:, :, z0 : z1 + 1].sum(axis=2)
        value, (x0, y0), (x1, y1) = _best_rectangle(layer)
        if value > best[0]:
            best = (value, (x0, y0, z0), (x1, y1, z1))
    return best[1], best[2]


def _best_rectangle(worth: NDArray[np.float64]) -> tuple[float, tuple[int, int], tuple[int, int]]:
    """Find the rectangle of (X, Y) with the greatest sum: that sum, first and last indices."""
    sums = np.vstack([np.zeros(worth.shape[1]), np.cumsum(worth, axis=0)])
    pairs = np.array(_pairs(worth.shape[0]))
    strips = sums[pairs[:, 1] + 1] - sums[pairs[:, 0]]
    until = np.cumsum(np.pad(strips, ((0, 0), (1, 0))), axis=1)
    gains = until[:, 1:] - np.minimum.accumulate(until[:, :-1], axis=1)
    y1, pair = (int(index) for index in np.unravel_index(gains.T.argmax(), gains.T.shape))
    (x0, x1), before = pairs[pair].tolist(), until[pair, : y1 + 1]
    y0 = int(np.flatnonzero(before == before.min())[-1])  # the shortest run if there are several
    return float(gains[pair, y1]), (x0, y0), (x1, y1)


def _pairs(count: int) -> list[tuple[int, int]]:
    """List all (first, last) with first <= last < count."""
    return [(first, last) for first in range(count) for last in range(first, count)]
