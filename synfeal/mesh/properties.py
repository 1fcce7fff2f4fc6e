"""The numbers of Table 1: how large a scene is."""

from __future__ import annotations

from typing import Any

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import merge_vertices


def mesh_properties(mesh: TexturedMesh) -> dict[str, Any]:
    """Vertices, faces, extents and volume of a scene.

    ``vertices`` counts distinct positions, as the file of a scan does; ``vertices_with_seams``
    counts a vertex on a texture seam once per copy, as a renderer needs it. ``volume_m3`` is the
    volume of the axis-aligned bounding box: a scan is an open surface, which encloses no volume of
    its own.
    """
    extents = mesh.bounds_m[1] - mesh.bounds_m[0]
    return {
        "vertices": len(merge_vertices(*mesh.merged())[0]),
        "vertices_with_seams": mesh.n_vertices,
        "faces": mesh.n_faces,
        "parts": len(mesh.parts),
        "volume_m3": float(np.prod(extents)),
        "extents_m": extents.tolist(),
        "bounds_m": mesh.bounds_m.tolist(),
        "texture_pixels": sum(
            part.texture.shape[0] * part.texture.shape[1]
            for part in mesh.parts
            if part.texture is not None
        ),
    }
