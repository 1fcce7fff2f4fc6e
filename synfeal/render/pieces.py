"""Parts too large for a driver, in pieces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from synfeal.mesh.model import MeshPart

# Mesa's software renderer silently draws nonsense from a buffer of 2^24 vertices on.
MOST_VERTICES = 1 << 23


def pieces(part: MeshPart, most_vertices: int = MOST_VERTICES) -> Iterator[MeshPart]:
    """The part in pieces of at most ``most_vertices``, each with the vertices of its own faces."""
    if len(part.vertices_m) <= most_vertices:
        yield part
        return
    step = max(1, most_vertices // 3)
    for start in range(0, len(part.faces), step):
        used, faces = np.unique(part.faces[start : start + step], return_inverse=True)
        yield replace(
            part,
            vertices_m=part.vertices_m[used],
            faces=faces.reshape(-1, 3),
            uv=None if part.uv is None else part.uv[used],
            vertex_rgb=None if part.vertex_rgb is None else part.vertex_rgb[used],
        )
