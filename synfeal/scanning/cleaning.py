"""Small floating pieces of a fused surface dropped: noise, and what a camera saw from afar."""

from __future__ import annotations

import numpy as np

from synfeal.mesh.triangles import pieces_of
from synfeal.scanning.fusion import FusedSurface


def without_small_pieces(surface: FusedSurface, min_area_m2: float) -> tuple[FusedSurface, int]:
    """Drop connected pieces that are smaller than an area.

    Args:
        surface: Triangles; those that share a vertex are connected.
        min_area_m2: Pieces below are dropped, but never the largest.

    Returns:
        The rest, without unused vertices, and how many pieces were dropped.
    """
    piece = pieces_of(surface.faces, len(surface.vertices_m))
    corners = surface.vertices_m[surface.faces]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area_m2 = np.bincount(piece, np.linalg.norm(sides, axis=1) / 2.0)
    kept = area_m2 >= min(min_area_m2, float(area_m2.max()))
    used, faces = np.unique(surface.faces[kept[piece]], return_inverse=True)
    rest = FusedSurface(
        vertices_m=surface.vertices_m[used],
        normals=surface.normals[used],
        faces=faces.reshape(-1, 3).astype(np.int64),
    )
    return rest, int(np.sum(~kept & (area_m2 > 0)))
