"""Opacity of vertices, cut out of the triangles themselves.

What is less opaque than a cutoff is not drawn. Opacity is linear over a triangle, so where it falls
below is a line across: cut along it, a mesh looks alike to every renderer, and rays agree.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import MeshPart

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def opaque_side(part: MeshPart, opacity: Floats, cutoff: float) -> MeshPart:
    """Keep the surface whose opacity is at least a cutoff.

    Args:
        part: In any frame.
        opacity: Opacity of each vertex (V,), 0 to 1.
        cutoff: Above 0.

    Returns:
        The part with triangles across the limit cut, and new vertices behind the old ones.
    """
    kept = opacity[part.faces] >= cutoff
    n_kept = kept.sum(axis=1)
    whole = part.faces[n_kept == 3]
    crossed = np.flatnonzero((n_kept == 1) | (n_kept == 2))
    if not len(crossed):
        return replace(part, faces=whole)
    # Turned so that the corner that is alone on its side of the limit comes first.
    is_alone = kept[crossed] == (n_kept[crossed] == 1)[:, None]
    corner = is_alone.argmax(axis=1)
    faces = np.take_along_axis(part.faces[crossed], (corner[:, None] + np.arange(3)) % 3, axis=1)
    first, second, third = faces.T
    ends = np.concatenate([np.stack([first, second], axis=1), np.stack([first, third], axis=1)])
    low, high = opacity[ends].T
    share = (cutoff - low) / (high - low)
    count, total = len(part.vertices_m), len(crossed)
    near, far = count + np.arange(total), count + total + np.arange(total)
    one = n_kept[crossed] == 1
    pieces = [
        whole,
        np.stack([first, near, far], axis=1)[one],
        np.stack([near, second, third], axis=1)[~one],
        np.stack([near, third, far], axis=1)[~one],
    ]

    def extended(values: NDArray[np.generic]) -> Floats:
        start, stop = (np.asarray(values, np.float64)[ends[:, k]] for k in range(2))
        return np.asarray(start + share[:, None] * (stop - start))

    uv, rgb = part.uv, part.vertex_rgb
    if uv is not None:
        uv = np.concatenate([uv, extended(uv)])
    if rgb is not None:
        rgb = np.concatenate([rgb, np.round(extended(rgb)).astype(np.uint8)])
    vertices_m = np.concatenate([part.vertices_m, extended(part.vertices_m)])
    faces = np.concatenate(pieces).astype(np.int64)
    return replace(part, vertices_m=vertices_m, faces=faces, uv=uv, vertex_rgb=rgb)
