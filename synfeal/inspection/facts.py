"""Facts about a mesh, collected for a file."""

from __future__ import annotations

import hashlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import cross

import synfeal
from synfeal.inspection.doubts import (
    Inspection,
    color_doubts,
    doubts_of,
    floor_areas_m2,
    pieces_doubts,
    suggestion_doubts,
)
from synfeal.inspection.freespace import DEFINITION, FreeSpace
from synfeal.inspection.suggest import COUNTS
from synfeal.inspection.surface import area_by_color, color_of, triangle_areas_m2
from synfeal.mesh.gltf import slug_of, title_of
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties, mesh_topology
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import merge_vertices
from synfeal.records.files import file_sha256

Array = NDArray[np.float64]

N_HOLES = 10  # largest holes whose length is reported


def facts_of(found: Inspection) -> dict[str, Any]:
    """Collect numbers, findings and doubts, ready for JSON."""
    scene, mesh, space, suggestion = found.scene, found.mesh, found.space, found.suggestion
    title = title_of(Path(str(scene.path)))
    detail, collect = detail_of(mesh), None
    area_m2, surface = detail["area_m2"], found.surface
    floors_m2 = floor_areas_m2(surface.normal, surface.position_m, sum(area_m2.values()))
    extents_m = np.ptp(found.searched.bounds_m, axis=0)
    topology = mesh_topology(*merge_vertices(*mesh.merged()))
    lengths = topology.pop("hole_lengths_m")
    if suggestion is not None:  # the command, and what planning it once showed
        collect = {
            "command": suggestion.command(f"{slug_of(title)}-frames"),
            "frames": COUNTS,
            "covered": suggestion.covered,
            "empty_pixels": asdict(suggestion.empty),
            "of_one_color": suggestion.one_color,
            "shade": suggestion.shade,
            "min_view_distance_m": suggestion.scene.min_view_distance_m,
            "min_path_m": suggestion.collection.min_path_m,
            "min_seen": suggestion.scene.min_seen,
            "min_clearance_m": suggestion.scene.min_clearance_m,
        }
    return {
        "title": title,
        "mesh": {
            "path": str(scene.path),
            "sha256": file_sha256(Path(str(scene.path))),
            "up_axis": scene.up_axis,
            "unit_m": scene.unit_m,
        },
        "properties": mesh_properties(mesh),
        "materials": len({_material_key(part) for part in mesh.parts}),
        "parts": [_part(part) for part in mesh.parts],
        "detail": detail,
        "topology": {**topology, "holes": len(lengths), "longest_holes_m": lengths[:N_HOLES]},
        "findings": list(mesh.findings),
        "free_space": {
            "definition": DEFINITION,
            "box_m": found.box_m.tolist(),
            "volume_m3": space.share * float(np.prod(np.ptp(found.box_m, axis=0))),
            **{key: getattr(space, key) for key in ("share", "enclosure", "floor_m", "elsewhere")},
        },
        "back_faces_share": back_face_share(mesh, found.caster, space),
        "suggested_sampling_boxes": [
            dict(zip("xyz", box_m.T.tolist(), strict=True)) for box_m in found.suggested_m
        ],
        "collect": collect,
        "doubts": [
            *found.assumed,
            *color_doubts(mesh, area_m2),
            *pieces_doubts(found.left_out),
            *doubts_of(extents_m, floors_m2, space, found.scene.unit_m),
            *([] if suggestion is None else suggestion_doubts(suggestion)),
        ],
        "version": synfeal.__version__,
    }


def _part(part: MeshPart) -> dict[str, Any]:
    texture = None if part.texture is None else [part.texture.shape[1], part.texture.shape[0]]
    return {
        "name": part.name,
        "faces": len(part.faces),
        "area_m2": _area_m2([part]),
        "color": color_of(part),
        "texture_px": texture,
        "alpha_cutoff": part.alpha_cutoff,
    }


def _material_key(part: MeshPart) -> tuple[str, str, bytes, float | None]:
    """Return a key that is equal for parts that are drawn alike."""
    texels = b"" if part.texture is None else part.texture.tobytes()
    texture = hashlib.sha256(texels).hexdigest()
    return color_of(part), texture, part.base_color.tobytes(), part.alpha_cutoff


QUANTILES = (0.05, 0.5, 0.95)


def detail_of(mesh: TexturedMesh) -> dict[str, Any]:
    """Measure surface by what colours it, and the density of texels and of coloured vertices.

    ``texels_per_m`` holds the 5 %, 50 % and 95 % quantiles over the textured surface, weighted by
    area, of the square root of texels per square metre; ``colored_vertices_per_m`` is the square
    root of vertices per square metre over all parts coloured by their vertices. None where there
    are no such parts.
    """
    textured, by_vertex = (
        [part for part in mesh.parts if color_of(part) == color]
        for color in ("texture", "vertices")
    )
    vertex_m2, per_m = _area_m2(by_vertex), None
    if vertex_m2 > 0.0:
        per_m = float(np.sqrt(sum(len(np.unique(part.faces)) for part in by_vertex) / vertex_m2))
    return {
        "area_m2": area_by_color(mesh),
        "texels_per_m": texels_per_m(textured),
        "colored_vertices_per_m": per_m,
    }


def texels_per_m(parts: list[MeshPart]) -> list[float] | None:
    """Compute quantiles of texel density over textured parts; see :func:`detail_of`."""
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
    """Count the texels (F,) that each triangle of a textured part covers."""
    assert part.texture is not None
    assert part.uv is not None
    size = part.texture.shape[1::-1]
    a, b, c = (part.uv[part.faces[:, corner]] * size for corner in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return np.asarray(np.abs(ux * vy - uy * vx) / 2.0)


def _area_m2(parts: list[MeshPart]) -> float:
    return float(sum(triangle_areas_m2(part).sum() for part in parts))


N_RAYS = 5000


def back_face_share(mesh: TexturedMesh, caster: RayCaster, space: FreeSpace) -> float | None:
    """Estimate the share of hits on back faces by random rays from a space's clear points.

    A face shows its front where its vertices run counter-clockwise.

    Args:
        mesh: The mesh.
        caster: Rays against ``mesh.merged()``, whose triangles are numbered in the same way.
        space: Free space with the points that rays start from.

    Returns:
        Share from 0 to 1; None if there is no clear point, or nothing is hit.
    """
    clear_m = space.clear_m
    if not len(clear_m):
        return None
    rng = np.random.default_rng(0)
    start = clear_m[rng.integers(len(clear_m), size=N_RAYS)]
    direction: NDArray[np.float64] = rng.standard_normal((N_RAYS, 3))
    _, face = caster.first_hits(start, direction)
    vertices, faces = mesh.merged()
    hit = face >= 0
    if not hit.any():
        return None
    normal = cross(vertices[faces[face[hit]]])
    return float(np.mean(np.einsum("ni,ni->n", normal, direction[hit]) > 0.0))
