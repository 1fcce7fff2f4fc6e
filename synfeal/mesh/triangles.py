"""Triangles for ray casting, and simplification: fewer triangles, smaller textures."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from synfeal.errors import InputError, read_as
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.records.files import atomic_path

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
PLY_PATTERN = PLY_HEADER.format(vertices=r"(\d{1,12})", faces=r"(\d{1,12})").encode()
PLY_END = b"end_header\n"
PLY_VERTEX = np.dtype(("<f8", 3))
PLY_FACE = np.dtype([("corners", "u1"), ("index", "<u4", 3)])
MERGE_M = 1e-5  # copies of a vertex on a texture seam differ by rounding only
NO_LIMIT = 1e9  # error in diameters of the mesh: the number of faces alone decides


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
    """Return distinct places (W, 3) of points (V, 3), and the place (V,) of each point."""
    keys = np.round(points_m / MERGE_M).astype(np.int64)
    # What np.unique(keys, axis=0) finds, in half the time.
    order = np.lexsort(keys.T[::-1])
    ordered = keys[order]
    is_new = np.ones(len(keys), bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    index = np.empty(len(keys), np.int64)
    index[order] = np.cumsum(is_new) - 1
    return points_m[order[is_new]], index


def pieces_of(faces: NDArray[np.int64], n_vertices: int) -> NDArray[np.int64]:
    """Label each triangle (F, 3) with the number (F,) of the connected piece it belongs to."""
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(ends), np.int8), (ends[:, 0], ends[:, 1])), (n_vertices,) * 2)
    label = connected_components(graph, directed=False)[1]
    return np.asarray(label[faces[:, 0]], np.int64)


def save_collision_mesh(path: Path, mesh: Triangles) -> None:
    """Write a binary PLY in double precision: scans may lie at map coordinates.

    Open3D's writer is not used: on a full disk it leaves an empty file and says that all is well.
    """
    header = PLY_HEADER.format(vertices=len(mesh.vertices_m), faces=len(mesh.faces))
    faces = np.empty(len(mesh.faces), PLY_FACE)
    faces["corners"], faces["index"] = 3, mesh.faces
    with atomic_path(path) as temporary:
        vertices = np.ascontiguousarray(mesh.vertices_m, "<f8")
        temporary.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def load_collision_mesh(path: Path) -> Triangles:
    """Read what :func:`save_collision_mesh` wrote.

    Raises:
        InputError: the file is missing or something else, is cut short, holds no faces, faces
            without vertices, or vertices that are not finite.
    """
    with read_as(path, "a collision mesh", remedy="; make the scene again"):
        header, end, body = path.read_bytes().partition(PLY_END)
        counts = re.fullmatch(PLY_PATTERN, header + end)
        if counts is None:
            raise ValueError("its header is another")
        n_vertices, n_faces = map(int, counts.groups())
        if len(body) != n_vertices * PLY_VERTEX.itemsize + n_faces * PLY_FACE.itemsize:
            raise ValueError("its length is not that of its vertices and faces")
        vertices_m = np.frombuffer(body, PLY_VERTEX, n_vertices).astype(np.float64)
        rows = np.frombuffer(body, PLY_FACE, offset=n_vertices * PLY_VERTEX.itemsize)
        faces = rows["index"].astype(np.int64)
        is_whole = bool(n_faces) and (rows["corners"] == 3).all() and faces.max() < n_vertices
        if not (is_whole and np.isfinite(vertices_m).all()):
            raise ValueError("its faces or vertices are damaged")
    return Triangles(vertices_m, faces)


def simplify(mesh: Triangles, n_faces: int) -> Triangles:
    """Simplify by quadrics to about ``n_faces`` triangles.

    Open edges are given planes of their own (``boundary_weight``). Without them the rim of a flat
    sheet retracts within its plane at no cost: a column of four sheets without lids is the first
    thing to vanish, and cameras fly through it.

    Raises:
        InputError: Open3D is not installed.
    """
    try:
        import open3d as o3d  # a second to load, and needed by the workflow and by inspect alone
    except ModuleNotFoundError as error:
        raise InputError(
            "simplifying a mesh needs Open3D, which is not there; pip install 'synfeal[inspect]'"
        ) from error

    centre_m = mesh.vertices_m.mean(axis=0)  # far from the origin quadrics lose their digits
    full = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices_m - centre_m),
        o3d.utility.Vector3iVector(mesh.faces.astype(np.int32)),
    )
    reduced = full.simplify_quadric_decimation(n_faces, boundary_weight=1.0)
    vertices_m = np.asarray(reduced.vertices, dtype=np.float64) + centre_m
    return Triangles(vertices_m, np.asarray(reduced.triangles, dtype=np.int64))


def with_smaller_textures(mesh: TexturedMesh, factor: int) -> TexturedMesh:
    """Shrink every texture ``factor`` times along each axis, averaging over boxes.

    Colours are weighted with their alpha: what is cut out does not shine through.
    """
    return replace(mesh, parts=tuple(_smaller_texture(part, factor) for part in mesh.parts))


def _smaller_texture(part: MeshPart, factor: int) -> MeshPart:
    if part.texture is None:
        return part
    rgb, alpha = part.texture[..., :3].astype(np.float32), part.texture[..., 3:]
    if not alpha.size:
        return replace(part, texture=_rounded(_box_means(rgb, factor)))
    cover = _box_means(alpha.astype(np.float32), factor)
    visible = _box_means(rgb * alpha, factor) / np.maximum(cover, 1e-3)
    return replace(part, texture=_rounded(np.concatenate([visible, cover], axis=2)))


def _box_means(image: NDArray[np.float32], factor: int) -> NDArray[np.float32]:
    """Average an image (H, W, C) over boxes, without the rounding to 8 bits that Pillow does."""
    size = tuple(max(1, round(side / factor)) for side in image.shape[1::-1])
    channels = (Image.fromarray(np.ascontiguousarray(c)) for c in np.moveaxis(image, 2, 0))
    return np.stack([np.asarray(c.resize(size, Image.Resampling.BOX)) for c in channels], axis=2)


def _rounded(image: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.round(image).clip(0, 255).astype(np.uint8)


def with_fewer_faces(mesh: TexturedMesh, n_faces: int) -> TexturedMesh:
    """Simplify the mesh to about ``n_faces`` triangles, which use a subset of its vertices.

    Triangles are taken away by joining vertices to neighbours that are there already, so what
    remains has its own place, texture coordinates and colour. Copies of a vertex on both sides of a
    texture seam, or of the border between two parts, move together along it: nothing tears, and no
    triangle reaches into another chart.

    More are left where corners of charts, which never move, forbid to go on. Only the shape decides
    which vertices go: where a texture is stretched unevenly over a smooth surface, it shifts.

    Raises:
        ImportError: the package ``meshoptimizer`` is not installed.
    """
    # The other function, which would weigh texture coordinates too, crashes as published: its
    # wrapper (0.2.30a0) does not say which types of numbers the library takes.
    from meshoptimizer import simplify

    vertices_m, faces = mesh.merged()
    places_m, index = weld(vertices_m - vertices_m.mean(axis=0))  # copies are alike to the bit
    left = np.empty(faces.size, np.uint32)
    count = simplify(
        left,
        faces.reshape(-1).astype(np.uint32),
        places_m[index].astype(np.float32),
        target_index_count=3 * n_faces,
        target_error=NO_LIMIT,
    )
    kept = left[:count].reshape(-1, 3).astype(np.int64)
    first = np.cumsum([0, *(len(part.vertices_m) for part in mesh.parts)])
    of_part = np.searchsorted(first, kept[:, 0], side="right") - 1
    parts = (
        part.over(kept[of_part == number] - first[number])
        for number, part in enumerate(mesh.parts)
        if (of_part == number).any()
    )
    return replace(mesh, parts=tuple(parts))
