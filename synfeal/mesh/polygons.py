"""Polygons as triangles.

A polygon is cut from one of its corners where that covers it, which leaves triangles and convex
polygons as every program draws them. What is concave otherwise, such as a wall around a doorway, is
cut by ear clipping (mapbox's earcut) in the plane that its corners lie in.
"""

from __future__ import annotations

from typing import NamedTuple

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK = 1 << 18  # polygons looked at together, for the sake of memory
TOLERANCE = 1e-9  # share of a polygon's area by which a triangle may be turned over


class Triangulation(NamedTuple):
    """Triangles of polygons.

    Attributes:
        corners: Which corners (T, 3) of the list of all polygons' each triangle joins.
        polygon: Polygon (T,) that each triangle is of, ascending.
        area: Area (P,) of each polygon in the plane that fits it.
        covered: Area (P,) that its triangles cover there; more where it crosses itself.
    """

    corners: Ints
    polygon: Ints
    area: Floats
    covered: Floats

    @property
    def crossing(self) -> NDArray[np.bool_]:
        """Mark polygons (P,) that cross themselves."""
        return np.asarray(self.covered > 1.001 * self.area + 1e-15, np.bool_)


def triangulated(points: Floats, counts: Ints, corners: Ints) -> Triangulation:
    """Cut polygons into triangles that turn the same way round.

    Args:
        points: Positions (V, 3).
        counts: Number of corners (P,) of each polygon, at least three.
        corners: Indices into ``points`` of all corners, polygon after polygon.
    """
    first = np.cumsum(counts) - counts
    area, covered = np.zeros(len(counts)), np.zeros(len(counts))
    pieces, owners = [], []
    for count in np.flatnonzero(np.bincount(counts)):
        group = np.flatnonzero(counts == count)
        for start in range(0, len(group), BLOCK):
            block = group[start : start + BLOCK]
            of_corners = first[block, None] + np.arange(count)
            triangles, area[block], covered[block] = _cut(points[corners[of_corners]])
            if count > 3:
                of_corners = np.take_along_axis(of_corners[:, None], triangles, axis=2)
            pieces.append(of_corners.reshape(-1, 3))
            owners.append(np.repeat(block, count - 2))
    if not pieces:
        return Triangulation(np.zeros((0, 3), np.int64), np.zeros(0, np.int64), area, covered)
    found, polygon = np.concatenate(pieces), np.concatenate(owners)
    if counts.min() < counts.max():
        order = np.argsort(polygon, kind="stable")
        found, polygon = found[order], polygon[order]
    return Triangulation(found, polygon, area, covered)


def _cut(outlines: Floats) -> tuple[Ints, Floats, Floats]:
    """Cut polygons of equally many corners.

    Args:
        outlines: Positions (P, n, 3) of the corners.

    Returns:
        Corners (P, n - 2, 3) of triangles, and areas (P,) of the polygons and of what is covered.
    """
    number, count = outlines.shape[:2]
    sides = outlines - outlines[:, :1]
    doubled = np.cross(sides[:, 1:-1], sides[:, 2:])
    total = doubled.sum(axis=1)
    length = np.linalg.norm(total, axis=1)
    fan = np.stack([np.zeros(count - 2, int), *(np.arange(k, count - 2 + k) for k in (1, 2))], 1)
    triangles = np.tile(fan.astype(np.int64), (number, 1, 1))
    if count == 3:
        return triangles, length / 2.0, length / 2.0
    normal = total / np.where(length > 0.0, length, 1.0)[:, None]
    turned = np.einsum("pti,pi->pt", doubled, normal)
    covered = np.where(length > 0.0, np.abs(turned).sum(axis=1), _lengths(doubled)) / 2.0
    # Not "any is turned over": what is not a number is refused elsewhere.
    bad = (turned < -TOLERANCE * length[:, None]).any(axis=1)
    if count == 4 and bad.any():  # the other diagonal of a concave quadrilateral
        rest = np.flatnonzero(bad)
        shifted = np.roll(outlines[rest], -1, axis=1)
        sides = shifted - shifted[:, :1]
        doubled = np.cross(sides[:, 1:-1], sides[:, 2:])
        turned = np.einsum("pti,pi->pt", doubled, normal[rest])
        fits = (turned >= -TOLERANCE * length[rest, None]).all(axis=1)
        triangles[rest[fits]] = (fan + 1) % 4
        covered[rest[fits]] = length[rest[fits]] / 2.0
        bad[rest[fits]] = False
    for index in np.flatnonzero(bad):
        ears = _ears(outlines[index], normal[index])
        if ears is not None:
            triangles[index], share = ears
            covered[index] = share * length[index] / 2.0
    return triangles, length / 2.0, covered


def _lengths(doubled: Floats) -> Floats:
    return np.asarray(np.linalg.norm(doubled, axis=2).sum(axis=1))


def _ears(outline: Floats, normal: Floats) -> tuple[Ints, float] | None:
    """Clip the ears of one polygon.

    Args:
        outline: Corners (n, 3).
        normal: Normal of the plane that fits them; not zero.

    Returns:
        Triangles (n - 2, 3), those left over without an area, and how much of the polygon's area
        they cover; None if there are none.
    """
    across = int(np.abs(normal).argmax())
    flat = np.ascontiguousarray(np.delete(outline - outline[0], across, axis=1))
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    ears = np.asarray(found, np.int64).reshape(-1, 3)
    if not len(ears):
        return None
    a, b, c = (flat[ears[:, corner]] for corner in range(3))
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    x, y = flat.T
    outer = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    ears[doubled * outer < 0.0] = ears[doubled * outer < 0.0][:, ::-1]
    triangles = np.zeros((len(outline) - 2, 3), np.int64)
    triangles[: len(ears)] = ears[: len(triangles)]
    return triangles, float(np.abs(doubled).sum() / abs(outer)) if outer else 1.0
