"""How much detail a mesh shows: texels or coloured vertices per metre of surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.inspect.surface import triangle_areas_m2
from synfeal.mesh.model import MeshPart, TexturedMesh

Array = NDArray[np.float64]

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
