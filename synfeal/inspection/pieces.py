"""Small pieces apart from the rest of a mesh: what a scanner saw in dust, mirrors and windows."""

from __future__ import annotations

import numpy as np

from synfeal.inspection.surface import triangle_areas_m2
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import pieces_of, weld

SMALL = 0.01  # share of the area of the largest piece


def without_small_pieces(mesh: TexturedMesh) -> TexturedMesh:
    """Return the pieces of a mesh that are not small; the mesh itself where none is.

    A piece is what hangs together by vertices at the same place, of any parts. Pieces are measured
    against the largest, so that neither the unit counts nor how much is in small ones.
    """
    vertices_m, faces = mesh.merged()
    places_m, place = weld(vertices_m)
    piece = pieces_of(place[faces], len(places_m))
    area_m2 = np.concatenate([triangle_areas_m2(part) for part in mesh.parts])
    piece_m2 = np.bincount(piece, area_m2)
    kept = piece_m2[piece] >= SMALL * piece_m2.max()
    if kept.all():
        return mesh
    ends = np.cumsum([len(part.faces) for part in mesh.parts])[:-1]
    parts = [
        part.over(part.faces[keep])
        for part, keep in zip(mesh.parts, np.split(kept, ends), strict=True)
        if keep.any()
    ]
    return TexturedMesh(tuple(parts))
