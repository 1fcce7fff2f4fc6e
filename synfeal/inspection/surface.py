"""Coloured points spread evenly over a mesh, and a small coloured copy for the viewer in a page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from trimesh.triangles import cross

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.triangles import merge_vertices, simplify

N_POINTS = 300_000

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SurfacePoints:
    """Points on the triangles of a mesh."""

    position_m: Array  # (N, 3), world, metres
    normal: Array  # (N, 3), unit length, of the triangle
    rgb: NDArray[np.uint8]  # (N, 3) uint8
    is_drawn: NDArray[np.bool_]  # (N,), False where the alpha test cuts the surface out

    @classmethod
    def of(cls, mesh: TexturedMesh, rng: np.random.Generator, count: int = N_POINTS) -> Self:
        """Sample about ``count`` points in proportion to area, at least one on every triangle."""
        areas = [triangle_areas_m2(part) for part in mesh.parts]
        per_m2 = count / max(sum(float(area.sum()) for area in areas), 1e-12)
        pieces = [
            _sample(part, area, per_m2, rng) for part, area in zip(mesh.parts, areas, strict=True)
        ]
        return cls(*(np.concatenate(column) for column in zip(*pieces, strict=True)))


def triangle_areas_m2(part: MeshPart) -> Array:
    """Compute the area (F,) of each triangle, square metres."""
    return np.asarray(np.linalg.norm(cross(part.vertices_m[part.faces]), axis=1) / 2.0)


def _sample(
    part: MeshPart, area_m2: Array, per_m2: float, rng: np.random.Generator
) -> tuple[Array, Array, NDArray[np.uint8], NDArray[np.bool_]]:
    """Sample points on one part: positions, normals, colours and whether they are drawn."""
    expected = area_m2 * per_m2
    counts = np.maximum(1, np.floor(expected + rng.random(len(expected)))).astype(np.int64)
    index = np.repeat(np.arange(len(counts)), counts)
    u, v = rng.random((2, len(index)))
    root = np.sqrt(u)
    weight = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)  # uniform on triangles
    corners = part.faces[index]
    position = np.einsum("nc,ncd->nd", weight, part.vertices_m[corners])
    normal = _normals(part.vertices_m[part.faces])[index]
    rgba = _rgba(part, corners, weight)
    cutoff = -1.0 if part.alpha_cutoff is None else part.alpha_cutoff
    return position, normal, np.round(rgba[:, :3]).astype(np.uint8), rgba[:, 3] / 255.0 >= cutoff


def _rgba(part: MeshPart, corners: NDArray[np.int64], weight: Array) -> Array:
    """Return colours (N, 4) in 0 to 255: texture or vertex colours times the base colour."""
    rgba = np.full((len(corners), 4), 255.0)
    if part.texture is not None and part.uv is not None:
        uv = np.einsum("nc,ncd->nd", weight, part.uv[corners])
        below_1 = np.nextafter(1.0, 0.0)  # the last texel; at 1 the texture begins again
        uv = np.where(part.clamped_uv, np.clip(uv, 0.0, below_1), uv)
        texel = nearest_texels(part.texture, uv)
        rgba[:, : texel.shape[1]] = texel
    elif part.vertex_rgb is not None:
        rgba[:, :3] = np.einsum("nc,ncd->nd", weight, part.vertex_rgb[corners].astype(np.float64))
    return rgba * (part.base_color / 255.0)


def nearest_texels(texture: NDArray[np.uint8], uv: Array) -> NDArray[np.uint8]:
    """Look up the nearest texels, repeating the texture beyond 0 to 1.

    Args:
        texture: Pixels (H, W, C).
        uv: Texture coordinates (N, 2), origin at the bottom left.

    Returns:
        Texels (N, C).
    """
    height, width = texture.shape[:2]
    column = np.floor((uv[:, 0] % 1.0) * width).astype(np.int64) % width
    row = height - 1 - np.floor((uv[:, 1] % 1.0) * height).astype(np.int64) % height
    return np.asarray(texture[row, column])


def color_of(part: MeshPart) -> str:
    """Return what colours a part: ``texture``, ``vertices``, or ``plain`` for one colour."""
    if part.texture is not None:
        return "texture"
    return "plain" if part.vertex_rgb is None else "vertices"


def area_by_color(mesh: TexturedMesh) -> dict[str, float]:
    """Return the surface in square metres by what colours it."""
    named = {"texture": "textured", "vertices": "colored_by_vertex", "plain": "plain"}
    area_m2 = dict.fromkeys(named.values(), 0.0)
    for part in mesh.parts:
        area_m2[named[color_of(part)]] += float(triangle_areas_m2(part).sum())
    return area_m2


MAX_FACES = 60_000
SIMPLIFY_ABOVE = 30_000  # the rest of the budget goes to splitting what large triangles remain
NORMAL_M = 0.1  # how far apart two colours seem that face opposite ways, halved
MIN_EDGE_SHARE = 1 / 400  # share of the longest extent: no triangle is split finer
N_NEAREST = 4
ACROSS_RAD = -2.2  # across the corners of a room
STEPS = 32_000  # int16 on either side of the middle


@dataclass(frozen=True)
class ViewerMesh:
    """Mesh as :file:`viewer.js` draws it."""

    # (V, 3) int16; metres are ``offset_m + step_m * positions``, world, z up
    positions: NDArray[np.int16]
    rgb: NDArray[np.uint8]  # (V, 3) uint8
    faces: NDArray[np.uint32]  # (F, 3) uint32
    offset_m: Array  # (3,) middle of the mesh
    step_m: float  # metres per unit of ``positions``

    def scene(
        self, polylines: Sequence[tuple[ArrayLike, Sequence[int]]] = (), yaw_rad: float = ACROSS_RAD
    ) -> dict[str, Any]:
        """Build the argument of ``synfealViewer``, ready for JSON.

        Args:
            polylines: Points (N, 3) of each line, world, metres, and its red, green and blue from 0
                to 255.
            yaw_rad: Heading of the first view, radians, 0 along x.
        """
        return {
            "positions": _base64(self.positions, "<i2"),
            "colors": _base64(self.rgb, "u1"),
            "faces": _base64(self.faces, "<u4"),
            "offset_m": self.offset_m.tolist(),
            "step_m": self.step_m,
            "yaw": yaw_rad,
            "polylines": [
                {"points": np.round(np.asarray(points, np.float64), 4).tolist(), "color": [*rgb]}
                for points, rgb in polylines
            ],
        }


def viewer_js() -> str:
    """Read the script that defines ``synfealViewer(canvas, scene)``."""
    return files("synfeal.inspection").joinpath("viewer.js").read_text(encoding="utf-8")


def viewer_mesh(mesh: TexturedMesh, surface: SurfacePoints) -> ViewerMesh:
    """Reduce a mesh to at most 60,000 triangles with colours at their corners.

    Large triangles are split until the budget is used, since corners are all that carries colour.
    Triangles that the alpha test cuts out are left out.
    """
    merged = merge_vertices(*mesh.merged())
    if len(merged.faces) > SIMPLIFY_ABOVE:
        merged = simplify(merged, SIMPLIFY_ABOVE)
    min_edge_m = MIN_EDGE_SHARE * float(np.ptp(mesh.bounds_m, axis=0).max())
    corners = split_longest_edges(merged.vertices_m[merged.faces], MAX_FACES, min_edge_m)
    normals = _normals(corners)
    tree = cKDTree(_features(surface.position_m, surface.normal))
    if not surface.is_drawn.all():
        _, nearest = tree.query(_features(corners.mean(axis=1), normals))
        corners, normals = corners[surface.is_drawn[nearest]], normals[surface.is_drawn[nearest]]
    return _indexed(mesh.bounds_m, corners, normals, surface, tree)


def split_longest_edges(corners: Array, max_faces: int, min_edge_m: float) -> Array:
    """Split triangles at the middle of their longest edge, the longest edges first.

    Args:
        corners: Corners (F, 3, 3) of the triangles, metres.
        max_faces: Number of triangles at which splitting stops.
        min_edge_m: Longest edge that is not split, metres.

    Returns:
        Corners (G, 3, 3) of the triangles after splitting.
    """
    while len(corners) < max_faces:
        edges_m = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        longest_m = edges_m.max(axis=1)
        chosen = np.flatnonzero(longest_m > max(0.7 * float(longest_m.max()), min_edge_m))
        if not len(chosen):
            break
        chosen = chosen[np.argsort(-longest_m[chosen], kind="stable")][: max_faces - len(corners)]
        order = (edges_m[chosen].argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners[chosen], order[..., None], axis=1), 1, 0)
        middle = (a + b) / 2.0
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        corners = np.concatenate([np.delete(corners, chosen, axis=0), *halves])
    return corners


def _indexed(
    bounds_m: Array, corners: Array, normals: Array, surface: SurfacePoints, tree: Any
) -> ViewerMesh:
    """Join corners that agree in place and normal to one vertex, coloured by the surface nearby."""
    offset_m = bounds_m.mean(axis=0)
    from_middle_m = corners.reshape(-1, 3) - offset_m
    reach_m = max(
        float(np.ptp(bounds_m, axis=0).max()) / 2.0,
        float(np.abs(from_middle_m).max(initial=0.0)),  # simplification moves corners outwards
    )
    step_m = max(reach_m / STEPS, 1e-9)
    steps = np.round(from_middle_m / step_m)
    facing = np.round(np.repeat(normals, 3, axis=0) * 8.0)
    keys, index = np.unique(
        np.hstack([steps, facing]).astype(np.int16), axis=0, return_inverse=True
    )
    place = offset_m + step_m * keys[:, :3]
    _, nearest = tree.query(_features(place, keys[:, 3:] / 8.0), k=N_NEAREST)
    rgb = np.round(surface.rgb[nearest].mean(axis=1)).astype(np.uint8)
    faces = index.reshape(-1, 3).astype(np.uint32)
    return ViewerMesh(np.ascontiguousarray(keys[:, :3]), rgb, faces, offset_m, step_m)


def _normals(corners: Array) -> Array:
    normals = cross(corners)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))


def _features(position_m: Array, normal: Array) -> Array:
    """Join place and facing (N, 6), so that two sides of a thin wall keep their own colours."""
    return np.hstack([position_m, NORMAL_M * normal])


def _base64(values: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
