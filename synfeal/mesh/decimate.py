"""Fewer triangles of about the same shape."""

from __future__ import annotations

import numpy as np

from synfeal.errors import InputError
from synfeal.mesh.triangles import Triangles


def simplify(mesh: Triangles, n_faces: int) -> Triangles:
    """Quadric simplification to about ``n_faces`` triangles.

    Open edges are given planes of their own (``boundary_weight``). Without them the rim of a flat
    sheet retracts within its plane at no cost: a column of four sheets without lids is the first
    thing to vanish, and cameras fly through it.

    Raises:
        InputError: Open3D is not installed.
    """
    try:
        import open3d as o3d  # a second to load, and needed by the workflow and by inspect alone
    except ModuleNotFoundError:
        raise InputError(
            "simplifying a mesh needs Open3D, which is not there; pip install 'synfeal[inspect]'"
        ) from None

    centre_m = mesh.vertices_m.mean(axis=0)  # far from the origin quadrics lose their digits
    full = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices_m - centre_m),
        o3d.utility.Vector3iVector(mesh.faces.astype(np.int32)),
    )
    reduced = full.simplify_quadric_decimation(n_faces, boundary_weight=1.0)
    vertices_m = np.asarray(reduced.vertices, dtype=np.float64) + centre_m
    return Triangles(vertices_m, np.asarray(reduced.triangles, dtype=np.int64))
