"""Coloured points spread evenly over a mesh, how much detail it shows, and from which side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import cross

from synfeal.inspect.freespace import FreeSpace
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster

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
        """About ``count`` points, in proportion to area, at least one on every triangle."""
        areas = [triangle_areas_m2(part) for part in mesh.parts]
        per_m2 = count / max(sum(float(area.sum()) for area in areas), 1e-12)
        pieces = [
            _sample(part, area, per_m2, rng) for part, area in zip(mesh.parts, areas, strict=True)
        ]
        return cls(*(np.concatenate(column) for column in zip(*pieces, strict=True)))


def triangle_areas_m2(part: MeshPart) -> Array:
    """Area (F,) of each triangle, square metres."""
    return np.asarray(np.linalg.norm(_cross(part), axis=1) / 2.0)


def _cross(part: MeshPart) -> Array:
    """Normals (F, 3) of the triangles, as long as twice their area."""
    return np.asarray(cross(part.vertices_m[part.faces]))


def _sample(
    part: MeshPart, area_m2: Array, per_m2: float, rng: np.random.Generator
) -> tuple[Array, Array, NDArray[np.uint8], NDArray[np.bool_]]:
    """Positions, normals, colours and whether they are drawn, of points on one part."""
    expected = area_m2 * per_m2
    counts = np.maximum(1, np.floor(expected + rng.random(len(expected)))).astype(np.int64)
    index = np.repeat(np.arange(len(counts)), counts)
    weight = _barycentric(len(index), rng)
    corners = part.faces[index]
    position = np.einsum("nc,ncd->nd", weight, part.vertices_m[corners])
    cross = _cross(part)[index]
    normal = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-30)
    rgba = _rgba(part, corners, weight)
    cutoff = -1.0 if part.alpha_cutoff is None else part.alpha_cutoff
    return position, normal, np.round(rgba[:, :3]).astype(np.uint8), rgba[:, 3] / 255.0 >= cutoff


def _barycentric(count: int, rng: np.random.Generator) -> Array:
    """Weights (count, 3) of the corners, uniform over the triangle."""
    u, v = rng.random((2, count))
    root = np.sqrt(u)
    return np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)


def _rgba(part: MeshPart, corners: NDArray[np.int64], weight: Array) -> Array:
    """Colours (N, 4) in 0 to 255: texture or vertex colours times the base colour."""
    rgba = np.full((len(corners), 4), 255.0)
    if part.texture is not None and part.uv is not None:
        uv = np.einsum("nc,ncd->nd", weight, part.uv[corners])
        texel = nearest_texels(part.texture, uv)
        rgba[:, : texel.shape[1]] = texel
    elif part.vertex_rgb is not None:
        rgba[:, :3] = np.einsum("nc,ncd->nd", weight, part.vertex_rgb[corners].astype(np.float64))
    return rgba * (part.base_color / 255.0)


def nearest_texels(texture: NDArray[np.uint8], uv: Array) -> NDArray[np.uint8]:
    """Texels (N, C) at coordinates (N, 2), origin at the bottom left, repeated beyond 0 to 1."""
    height, width = texture.shape[:2]
    column = np.floor((uv[:, 0] % 1.0) * width).astype(np.int64) % width
    row = height - 1 - np.floor((uv[:, 1] % 1.0) * height).astype(np.int64) % height
    return np.asarray(texture[row, column])


QUANTILES = (0.05, 0.5, 0.95)


def detail_of(mesh: TexturedMesh) -> dict[str, Any]:
    """Surface by what colours it, and the density of texels and of coloured vertices.

    ``texels_per_m`` holds the 5 %, 50 % and 95 % quantiles over the textured surface, weighted by
    area, of the square root of texels per square metre; ``coloured_vertices_per_m`` is the square
    root of vertices per square metre over all parts coloured by their vertices. None where there
    are no such parts.
    """
    textured = [part for part in mesh.parts if part.texture is not None]
    by_vertex = [p for p in mesh.parts if p.texture is None and p.vertex_rgb is not None]
    plain = [p for p in mesh.parts if p.texture is None and p.vertex_rgb is None]
    return {
        "area_m2": {
            "textured": _area_m2(textured),
            "coloured_by_vertex": _area_m2(by_vertex),
            "plain": _area_m2(plain),
        },
        "texels_per_m": texels_per_m(textured),
        "coloured_vertices_per_m": _vertices_per_m(by_vertex),
    }


def texels_per_m(parts: list[MeshPart]) -> list[float] | None:
    """Quantiles of texel density over textured parts; see :func:`detail_of`."""
    if not parts:
        return None
    area = np.concatenate([triangle_areas_m2(part) for part in parts])
    texels = np.concatenate([_texels(part) for part in parts])
    usable = area > 0.0
    if not usable.any():
        return None
    density = np.sqrt(texels[usable] / area[usable])
    found = np.quantile(density, QUANTILES, weights=area[usable], method="inverted_cdf")
    return [float(value) for value in found]


def _texels(part: MeshPart) -> Array:
    """Texels (F,) that each triangle of a textured part covers."""
    assert part.texture is not None
    assert part.uv is not None
    size = part.texture.shape[1::-1]
    a, b, c = (part.uv[part.faces[:, corner]] * size for corner in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray(np.abs(ux * vy - uy * vx) / 2.0)


def _area_m2(parts: list[MeshPart]) -> float:
    return float(sum(triangle_areas_m2(part).sum() for part in parts))


def _vertices_per_m(parts: list[MeshPart]) -> float | None:
    area_m2 = _area_m2(parts)
    if area_m2 <= 0.0:
        return None
    return float(np.sqrt(sum(len(np.unique(part.faces)) for part in parts) / area_m2))


N_RAYS = 5000


def back_face_share(mesh: TexturedMesh, caster: RayCaster, space: FreeSpace) -> float | None:
    """Share of what random rays from the clear points of a space hit that is a back side.

    A face shows its front where its vertices run counter-clockwise. None if nothing is hit.
    """
    index = np.argwhere(space.is_clear)
    if not len(index):
        return None
    rng = np.random.default_rng(0)
    index = index[rng.integers(len(index), size=N_RAYS)]
    start = np.stack([axis[index[:, i]] for i, axis in enumerate(space.axes_m)], axis=1)
    direction: NDArray[np.float64] = rng.standard_normal((N_RAYS, 3))
    _, face = caster.first_hits(start, direction)
    vertices, faces = mesh.merged()
    hit = face >= 0
    if not hit.any():
        return None
    normal = cross(vertices[faces[face[hit]]])
    return float(np.mean(np.einsum("ni,ni->n", normal, direction[hit]) > 0.0))
