"""Geometry alone: what rays are cast against, and the file it is kept in."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.files import atomic_path

MERGE_M = 1e-5  # copies of a vertex on a texture seam differ by rounding only


class Triangles(NamedTuple):
    """Vertices (V, 3), world, metres, and faces (F, 3)."""

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int64]


def merge_vertices(vertices_m: NDArray[np.float64], faces: NDArray[np.int64]) -> Triangles:
    """Join vertices at the same place, or a simplifier tears the mesh along its seams."""
    places_m, index = weld(vertices_m)
    joined = index[faces]
    corners = np.sort(joined, axis=1)
    has_area = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    return Triangles(places_m, joined[has_area])


def weld(points_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distinct places (W, 3) of points (V, 3), and the place (V,) of each point."""
    keys = np.round(points_m / MERGE_M).astype(np.int64)
    _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return points_m[first], index.reshape(-1).astype(np.int64)


def save_collision_mesh(path: Path, mesh: Triangles) -> None:
    """Write a binary PLY in double precision: scans may lie at map coordinates."""
    import open3d as o3d  # takes a second: who only reads does not need it

    vertices = o3d.utility.Vector3dVector(mesh.vertices_m)
    faces = o3d.utility.Vector3iVector(mesh.faces.astype(np.int32))
    with atomic_path(path) as temporary:
        if not o3d.io.write_triangle_mesh(temporary, o3d.geometry.TriangleMesh(vertices, faces)):
            raise OSError(f"{temporary}: Open3D could not write the collision mesh")


def load_collision_mesh(path: Path) -> Triangles:
    """Read what :func:`save_collision_mesh` wrote.

    Raises:
        InputError: the file is missing, is no PLY with faces, or holds faces without vertices or
            vertices that are not finite.
    """
    try:
        mesh = trimesh.load_mesh(str(path), process=False)
        found = Triangles(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64))
        in_range = (found.faces >= 0) & (found.faces < len(found.vertices_m))
        if not (found.faces.size and in_range.all() and np.isfinite(found.vertices_m).all()):
            raise ValueError("its faces or vertices are damaged; make the scene again")
        return found
    except Exception as error:  # parsers of foreign files fail in every way there is
        raise InputError(f"{path}: cannot be read as a collision mesh ({error})") from None
