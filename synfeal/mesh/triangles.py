"""Geometry alone: what rays are cast against, fewer triangles of about the same shape, its file."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.errors import InputError, why
from synfeal.files import atomic_path

PLY_HEADER = """\
ply
format binary_little_endian 1.0
element vertex {vertices}
property double x
property double y
property double z
element face {faces}
property list uchar uint vertex_indices
end_header
"""
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
    """Write a binary PLY in double precision: scans may lie at map coordinates.

    Open3D's writer is not used: on a full disk it leaves an empty file and says that all is well.
    """
    header = PLY_HEADER.format(vertices=len(mesh.vertices_m), faces=len(mesh.faces))
    faces = np.empty(len(mesh.faces), [("corners", "u1"), ("index", "<u4", 3)])
    faces["corners"], faces["index"] = 3, mesh.faces
    with atomic_path(path) as temporary:
        vertices = np.ascontiguousarray(mesh.vertices_m, "<f8")
        temporary.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


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
        raise InputError(f"{path}: cannot be read as a collision mesh ({why(error)})") from None


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
