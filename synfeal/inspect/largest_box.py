"""The axis-aligned box of a grid that holds many wanted points and few others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Corner = tuple[int, int, int]

# A layer of points is worth adding to a box if more than 2/3 of it are wanted. A bound on the whole
# box instead would let it grow into the walls until the bound is used up.
UNWANTED_WEIGHT = 2.0


def largest_box(is_wanted: Mask) -> tuple[Corner, Corner]:
    """First and last indices, both included, of the box with the greatest worth.

    Worth is the number of wanted points less twice the number of others. Every pair of limits
    along x and z is tried; along y the best run of layers is found in one pass (Kadane).

    Args:
        is_wanted: (X, Y, Z) with at least one True.
    """
    worth = np.where(is_wanted, 1.0, -UNWANTED_WEIGHT)
    best: tuple[float, Corner, Corner] = (-np.inf, (0, 0, 0), (0, 0, 0))
    for z0, z1 in _pairs(worth.shape[2]):
        layer = worth[:, :, z0 : z1 + 1].sum(axis=2)
        value, (x0, y0), (x1, y1) = _best_rectangle(layer)
        if value > best[0]:
            best = (value, (x0, y0, z0), (x1, y1, z1))
    return best[1], best[2]


def _best_rectangle(worth: NDArray[np.float64]) -> tuple[float, tuple[int, int], tuple[int, int]]:
    """Greatest sum over a rectangle of (X, Y), with its first and last indices."""
    sums = np.vstack([np.zeros(worth.shape[1]), np.cumsum(worth, axis=0)])
    pairs = np.array(_pairs(worth.shape[0]))
    strips = sums[pairs[:, 1] + 1] - sums[pairs[:, 0]]
    run, start = np.full(len(pairs), -np.inf), np.zeros(len(pairs), np.int64)
    best: tuple[float, tuple[int, int], tuple[int, int]] = (-np.inf, (0, 0), (0, 0))
    for y in range(worth.shape[1]):
        start = np.where(run > 0, start, y)
        run = np.maximum(run, 0.0) + strips[:, y]
        pair = int(run.argmax())
        if run[pair] > best[0]:
            x0, x1 = (int(index) for index in pairs[pair])
            best = (float(run[pair]), (x0, int(start[pair])), (x1, y))
    return best


def _pairs(count: int) -> list[tuple[int, int]]:
    """All (first, last) with first <= last < count."""
    return [(first, last) for first in range(count) for last in range(first, count)]
