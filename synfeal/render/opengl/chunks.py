"""Triangles in chunks of neighbours, and which chunks a camera may see.

Chunks keep one order whatever is visible, so that culling never decides which of two coincident
surfaces shows. Front-to-back order was measured too and gains nothing on llvmpipe.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# 64 to 512 cost the same; with one sample per pixel culling takes a tenth off a frame at 640x480,
# a third at 128x96.
FACES_PER_CHUNK = 128
BITS_PER_AXIS = 10
MARGIN = 1e-4  # of the part's size: far beyond what single precision on the device can move


class Chunks(NamedTuple):
    """Spatially sorted faces and the boxes around each run of ``FACES_PER_CHUNK`` of them."""

    vertices: NDArray[np.int64]  # (V,) which vertices are used, in the order of their first use
    faces: NDArray[np.int64]  # (F, 3) indices into ``vertices``
    lower_m: Floats  # (C, 3) lower corners of the boxes
    upper_m: Floats  # (C, 3) upper corners


def chunks_of(vertices_m: Floats, faces: NDArray[np.int64]) -> Chunks:
    """Sort faces (F, 3) along a space-filling curve and box them."""
    faces = faces[np.argsort(_morton_codes(vertices_m[faces].mean(axis=1)), kind="stable")]
    used, first, inverse = np.unique(faces, return_index=True, return_inverse=True)
    by_first_use = np.argsort(first)
    rank = np.empty_like(by_first_use)
    rank[by_first_use] = np.arange(len(used))
    starts = np.arange(0, len(faces), FACES_PER_CHUNK)
    corners = vertices_m[faces]
    margin = MARGIN * np.ptp(vertices_m[used], axis=0).max()
    return Chunks(
        vertices=used[by_first_use],
        faces=rank[inverse.reshape(-1, 3)],
        lower_m=np.minimum.reduceat(corners.min(axis=1), starts) - margin,
        upper_m=np.maximum.reduceat(corners.max(axis=1), starts) + margin,
    )


def _morton_codes(points_m: Floats) -> NDArray[np.int64]:
    """Place of each point (N, 3) on a Z-order curve through their bounding cube."""
    lower = points_m.min(axis=0)
    side = max(float(np.ptp(points_m, axis=0).max()), np.finfo(np.float64).tiny)
    cells = 1 << BITS_PER_AXIS
    cell = np.minimum((points_m - lower) / side * cells, cells - 1).astype(np.int64)
    codes = np.zeros(len(points_m), np.int64)
    for bit in range(BITS_PER_AXIS):
        for axis in range(3):
            codes |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return codes


def visible_runs(chunks: Chunks, clip_from_mesh: Floats) -> list[tuple[int, int]]:
    """First index and number of indices of each run of chunks that may be in the frustum.

    ``clip_from_mesh`` (4, 4) maps to OpenGL's clip coordinates: -w <= x, y, z <= w is drawn.
    """
    seen = np.ones(len(chunks.lower_m), bool)
    for axis in range(3):
        for sign in (1.0, -1.0):
            plane = clip_from_mesh[3] + sign * clip_from_mesh[axis]  # inside where >= 0
            innermost = np.where(plane[:3] > 0.0, chunks.upper_m, chunks.lower_m)
            seen &= innermost @ plane[:3] + plane[3] >= 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], seen, [False]]).astype(np.int8)))
    stops = np.minimum(edges[1::2] * FACES_PER_CHUNK, len(chunks.faces))
    starts = edges[::2] * FACES_PER_CHUNK
    return [(3 * int(a), 3 * int(b - a)) for a, b in zip(starts, stops, strict=True)]
