"""Size of a scene (Table 1), and connectivity of its triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import merge_vertices


def mesh_properties(mesh: TexturedMesh) -> dict[str, Any]:
    """Measure vertices, faces, extents and volume of a scene.

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


Vertices = NDArray[np.float64]
Indices = NDArray[np.int64]


def mesh_topology(vertices_m: Vertices, faces: Indices) -> dict[str, Any]:
    """Analyse the edges of triangles (F, 3) over vertices (V, 3) in metres, seam copies merged.

    Copies of a vertex along a texture seam would show as a hole: merge them first, with
    :func:`synfeal.mesh.triangles.merge_vertices`. ``enclosed_volume_m3`` is signed, negative where
    triangles face inwards, as the walls of a room do; None unless the mesh is watertight and
    neighbours face one side.
    """
    directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, n_faces = _counted(np.sort(directed, axis=1), len(vertices_m))
    rim = edges[n_faces == 1]
    length_m = np.linalg.norm(vertices_m[rim[:, 0]] - vertices_m[rim[:, 1]], axis=1)
    holes_m = np.bincount(_group(rim)[1], weights=length_m)
    watertight = len(edges) > 0 and bool((n_faces == 2).all())
    volume_m3 = None
    if watertight and (_counted(directed, len(vertices_m))[1] == 1).all():
        # The sum over the tetrahedra between each triangle and one point.
        a, b, c = np.moveaxis(vertices_m[faces] - vertices_m.mean(axis=0), 1, 0)
        volume_m3 = float(np.sum(a * np.cross(b, c)) / 6.0)
    return {
        "components": _group(edges)[0],  # pieces of triangles joined at vertices
        "boundary_edges": len(rim),  # edges with one triangle
        "non_manifold_edges": int((n_faces > 2).sum()),  # edges with three or more
        # Of the rim of each hole, longest first; holes that touch count as one.
        "hole_lengths_m": np.sort(holes_m)[::-1].tolist(),
        "watertight": watertight,  # every edge belongs to exactly two triangles
        "enclosed_volume_m3": volume_m3,
    }


def _counted(pairs: Indices, n_vertices: int) -> tuple[Indices, Indices]:
    """Return distinct pairs (E, 2) of vertex indices and how often each occurs (E,)."""
    # One integer per pair sorts several times faster than rows do.
    keys, counts = np.unique(pairs[:, 0] * n_vertices + pairs[:, 1], return_counts=True)
    return np.stack([keys // n_vertices, keys % n_vertices], axis=1), counts.astype(np.int64)


def _group(edges: Indices) -> tuple[int, Indices]:
    """Join vertices along edges (E, 2): number of groups, and the group (E,) of each edge."""
    used, index = np.unique(edges, return_inverse=True)
    ends = index.reshape(-1, 2)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(len(used),) * 2)
    count, group = connected_components(graph, directed=False)
    return int(count), group[ends[:, 0]].astype(np.int64)
