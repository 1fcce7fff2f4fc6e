"""Exact test of a least distance between points and the surfaces of a mesh.

A ray says how far it is along one line. A camera that looks along a wall a hand's breadth away
passes any test of its view, and half of its image is that wall. Embree, as ``embreex`` wraps it,
has no query for the nearest point, so triangles are found by a k-d tree of their centres and
distances to them are computed in closed form (Ericson, "Real-Time Collision Detection", 2005,
section 5.1.5).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

# Triangles are cut until their edges are this many clearances long, or this share of the mesh's
# extent if that is longer: so their centres stand for where they are, and they stay few.
EDGE_CLEARANCES, EDGE_SHARE = 4.0, 1 / 200
POINTS = 2000  # at a time


def point_triangle_distances(points: Array, triangles: Array) -> Array:
    """Return the distance of each point to its triangle.

    Args:
        points: Points (N, 3).
        triangles: Corners (N, 3, 3); a triangle without area is the line between its corners.

    Returns:
        Distances (N,), in the unit of the points.
    """
    edge = np.roll(triangles, -1, axis=1) - triangles
    to_point = points[:, None] - triangles
    square = np.maximum((edge**2).sum(axis=-1), np.finfo(float).tiny)
    along = np.clip((to_point * edge).sum(axis=-1) / square, 0.0, 1.0)
    to_edge = np.linalg.norm(to_point - along[..., None] * edge, axis=-1).min(axis=1)
    normal = np.cross(edge[:, 0], edge[:, 1])
    length = np.linalg.norm(normal, axis=1)
    turns = (np.cross(edge, to_point) * normal[:, None]).sum(axis=-1)
    above = (turns >= 0).all(axis=1) & (length > 0)
    to_plane = np.abs((to_point[:, 0] * normal).sum(axis=1)) / np.where(length > 0, length, 1.0)
    return np.asarray(np.where(above, np.minimum(to_plane, to_edge), to_edge))


def cut_to_size(triangles: Array, longest_m: float) -> Array:
    """Cut triangles in halves until no edge is longer.

    Args:
        triangles: Corners (F, 3, 3), metres.
        longest_m: Longest edge that is left.

    Returns:
        Corners (P, 3, 3) of pieces that cover the same surface.
    """
    done = []
    while len(triangles):
        length = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=-1)
        long = length.max(axis=1) > longest_m
        done.append(triangles[~long])
        triangles = triangles[long]
        # Turned so that the longest edge is the first.
        order = (length[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(triangles, order[..., None], axis=1), 1, 0)
        middle = (a + b) / 2
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        triangles = np.concatenate(halves)
    return np.concatenate(done) if done else triangles


class Clearance:
    """A least distance from the triangles of a mesh."""

    def __init__(self, vertices_m: ArrayLike, faces: ArrayLike, min_clearance_m: float) -> None:
        """Prepare a mesh.

        Args:
            vertices_m: Vertices (V, 3), world, metres.
            faces: Corners (F, 3) of the triangles, indices of vertices.
            min_clearance_m: Least distance from all of them, above 0.
        """
        self.min_clearance_m = min_clearance_m
        vertices = np.asarray(vertices_m, dtype=np.float64)
        extent_m = float(np.ptp(vertices, axis=0).max())
        longest_m = max(EDGE_CLEARANCES * min_clearance_m, EDGE_SHARE * extent_m)
        self._pieces = cut_to_size(vertices[np.asarray(faces)], longest_m)
        centre = self._pieces.mean(axis=1)
        self._tree = cKDTree(centre)
        radius = np.linalg.norm(self._pieces - centre[:, None], axis=-1)
        self._reach_m = min_clearance_m + float(radius.max())

    def keeps(self, points_m: ArrayLike) -> NDArray[np.bool_]:
        """Tell which points (N, 3) are at least the clearance away from every triangle, (N,)."""
        points = np.asarray(points_m, dtype=np.float64)
        to_centre, _ = self._tree.query(points)
        clear = to_centre >= self.min_clearance_m  # a centre lies on the surface
        doubtful = np.flatnonzero(clear & (to_centre <= self._reach_m))
        for start in range(0, len(doubtful), POINTS):
            rows = doubtful[start : start + POINTS]
            near = self._tree.query_ball_point(points[rows], self._reach_m)
            row = np.repeat(rows, [len(found) for found in near])
            piece = np.concatenate([np.asarray(found, dtype=np.int64) for found in near])
            distance_m = point_triangle_distances(points[row], self._pieces[piece])
            clear[row[distance_m < self.min_clearance_m]] = False
        return np.asarray(clear)
