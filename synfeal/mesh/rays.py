"""Ray queries against a triangle mesh.

Uses Embree through ``embreex``: as fast as Open3D's scene, which is the same library (2.1 against
2.3 million rays a second on one core, 20,480 triangles), and loads in a fraction of the time.
"""

from __future__ import annotations

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import ArrayLike, NDArray

# Embree's robust mode is tight at edges, but of 100,000 rays aimed exactly at vertices several slip
# between the triangles that meet there. Whoever aims by hand aims at vertices: a camera in the
# middle of a room, a wall split in the middle. So all rays are moved sideways, by less than the
# accuracy promised and in a direction no mesh is built along.
SIDESTEP = 5e-7  # share of the mesh's extent
SIDEWAYS = np.array([0.3607, 0.7243, 0.5876])
NOTHING = -1  # what Embree answers where a ray meets no triangle


class RayCaster:
    """First hits of rays on triangles, from either side.

    Answers are those of a mesh whose points lie up to 1e-6 of its extent (the longest side of its
    bounding box) elsewhere, wherever it lies and however large it is, for rays that start no
    farther than that extent from it. A surface that close to a ray's start may count or not.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        """Build the acceleration structure over vertices (V, 3), metres, and faces (F, 3)."""
        points = np.asarray(vertices, dtype=np.float64)
        lower, upper = points.min(axis=0), points.max(axis=0)
        self.bounds_m = np.stack([lower, upper])
        # Embree computes in float32; relative to the centre that is enough anywhere on Earth.
        centre_m = (lower + upper) / 2.0
        self._ray_origin_m = centre_m + SIDESTEP * np.max(upper - lower) * SIDEWAYS
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(
            self._scene,
            np.ascontiguousarray(points - centre_m, dtype=np.float32),
            np.ascontiguousarray(faces, dtype=np.int32),
        )

    def first_hits(
        self, origins: ArrayLike, directions: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Find the first triangle on each ray.

        Args:
            origins: Starts of the rays (N, 3), world, metres.
            directions: Directions (N, 3), world, of any length but zero.

        Returns:
            The distance (N,) in metres and the triangle's index (N,); ``inf`` and -1 without a hit.
        """
        hit = self._scene.run(self._starts(origins), _unit(directions), output=True)
        face = hit["primID"].astype(np.int64)
        return np.where(face >= 0, hit["tfar"].astype(np.float64), np.inf), face

    def first_hit_m(self, origins: ArrayLike, directions: ArrayLike) -> NDArray[np.float64]:
        """Return distances (N,) in metres to the first triangle on each ray, ``inf`` if none.

        Args:
            origins: Starts of the rays (N, 3), world, metres.
            directions: Directions (N, 3) of any length but zero.
        """
        starts = self._starts(origins)
        limit_m = np.full(len(starts), np.inf, dtype=np.float32)
        hit_m = self._scene.run(starts, _unit(directions), dists=limit_m, query="DISTANCE")
        return np.asarray(hit_m, dtype=np.float64)

    def sees(self, origins: ArrayLike, targets: ArrayLike) -> NDArray[np.bool_]:
        """Check whether nothing blocks the line from each origin to its target.

        A point sees itself, and one that is not finite sees nothing. Any hit on the line settles
        it, which is several times faster to find than the first.

        Args:
            origins: Points (N, 3), world, metres.
            targets: Points (N, 3), world, metres.

        Returns:
            True (N,) where the line is free.
        """
        offset = np.asarray(targets, dtype=np.float64) - np.asarray(origins, dtype=np.float64)
        length_m = _lengths(offset)
        is_finite = np.isfinite(length_m)
        apart = (length_m > 0.0) & is_finite
        offset[~apart] = [1.0, 0.0, 0.0]  # any direction will do
        limit_m = np.where(is_finite, length_m, 0.0).astype(np.float32)
        hit = self._scene.run(self._starts(origins), _unit(offset), dists=limit_m, query="OCCLUDED")
        is_free = ((hit == NOTHING) | ~apart) & is_finite
        return np.asarray(is_free, dtype=np.bool_)

    def _starts(self, origins: ArrayLike) -> NDArray[np.float32]:
        """Shift starting points (N, 3) to the scene's own origin, near its middle, and sideways."""
        start = np.asarray(origins, dtype=np.float64) - self._ray_origin_m
        return np.ascontiguousarray(start, dtype=np.float32)


def _lengths(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return lengths (N,) of vectors (N, 3)."""
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", vectors, vectors)))


def _unit(directions: ArrayLike) -> NDArray[np.float32]:
    """Return vectors (N, 3) of length 1, normalised in double precision."""
    direction = np.asarray(directions, dtype=np.float64)
    unit = direction / _lengths(direction)[:, None]
    return np.ascontiguousarray(unit, dtype=np.float32)
