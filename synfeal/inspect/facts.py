"""Everything that is said about a mesh, as one value that goes into a file."""

from __future__ import annotations

import hashlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import synfeal
from synfeal.inspect.density import detail_of
from synfeal.inspect.doubts import colour_doubts, doubts_of, floor_areas_m2, suggestion_doubts
from synfeal.inspect.freespace import DEFINITION
from synfeal.inspect.inspection import Inspection
from synfeal.inspect.sides import back_face_share
from synfeal.inspect.suggest import N_FRAMES, Suggestion
from synfeal.inspect.surface import triangle_areas_m2
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties
from synfeal.mesh.title import slug_of, title_of
from synfeal.mesh.topology import mesh_topology
from synfeal.mesh.triangles import merge_vertices

Array = NDArray[np.float64]

N_HOLES = 10  # of which the length is told


def facts_of(found: Inspection) -> dict[str, Any]:
    """Numbers, findings and doubts, ready for JSON."""
    scene, mesh, space, suggestion = found.scene, found.mesh, found.space, found.suggestion
    title = title_of(Path(str(scene.path)))
    detail = detail_of(mesh)
    return {
        "title": title,
        "mesh": {
            "path": str(scene.path),
            "sha256": sha256_of(Path(str(scene.path))),
            "up_axis": scene.up_axis,
            "unit_m": scene.unit_m,
        },
        "properties": mesh_properties(mesh),
        "materials": len({_material_key(part) for part in mesh.parts}),
        "parts": [_part(part) for part in mesh.parts],
        "detail": detail,
        "topology": _topology(mesh),
        "findings": list(mesh.findings),
        "free_space": {
            "definition": DEFINITION,
            "box_m": found.box_m.tolist(),
            "share": space.share,
            "volume_m3": space.share * float(np.prod(found.box_m[1] - found.box_m[0])),
            "enclosure": space.enclosure,
            "floor_m": space.floor_m,
            "elsewhere": space.elsewhere,
        },
        "back_faces_share": back_face_share(mesh, found.caster, space),
        "suggested_sampling_box": None if suggestion is None else as_box(suggestion.box_m),
        "collect": None if suggestion is None else _collect(suggestion, title),
        "doubts": _doubts(found, detail["area_m2"]),
        "version": synfeal.__version__,
    }


def _doubts(found: Inspection, area_m2: dict[str, float]) -> list[str]:
    """What was assumed first, then what looks wrong."""
    bounds_m, surface = found.mesh.bounds_m, found.surface
    floors_m2 = floor_areas_m2(surface.normal, surface.position_m, sum(area_m2.values()))
    return [
        *found.assumed,
        *colour_doubts(found.mesh, area_m2),
        *doubts_of(bounds_m[1] - bounds_m[0], floors_m2, found.space),
        *([] if found.suggestion is None else suggestion_doubts(found.suggestion)),
    ]


def _collect(suggestion: Suggestion, title: str) -> dict[str, Any]:
    """The command, and what planning it once showed."""
    return {
        "command": suggestion.command(f"{slug_of(title)}-frames"),
        "frames": N_FRAMES,
        "empty_pixels": asdict(suggestion.empty),
    }


def as_box(box_m: Array) -> dict[str, list[float]]:
    """A box (2, 3) as the mapping a configuration file holds."""
    return {axis: box_m[:, index].tolist() for index, axis in enumerate("xyz")}


def sha256_of(path: Path) -> str:
    """Hash of the mesh file itself, as ``sha256`` of a scene expects it."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _topology(mesh: TexturedMesh) -> dict[str, Any]:
    topology = asdict(mesh_topology(*merge_vertices(*mesh.merged())))
    lengths = topology.pop("hole_lengths_m")
    return {**topology, "holes": len(lengths), "longest_holes_m": list(lengths[:N_HOLES])}


def _part(part: MeshPart) -> dict[str, Any]:
    texture = None if part.texture is None else [part.texture.shape[1], part.texture.shape[0]]
    return {
        "name": part.name,
        "faces": len(part.faces),
        "area_m2": float(triangle_areas_m2(part).sum()),
        "colour": _colour(part),
        "texture_px": texture,
        "alpha_cutoff": part.alpha_cutoff,
    }


def _colour(part: MeshPart) -> str:
    if part.texture is not None:
        return "texture"
    return "plain" if part.vertex_rgb is None else "vertices"


def _material_key(part: MeshPart) -> tuple[str, bytes, float | None]:
    """Equal for parts that are drawn alike."""
    texture = b"" if part.texture is None else part.texture.tobytes()
    kind = f"{_colour(part)} {hashlib.sha256(texture).hexdigest()}"
    return kind, part.base_color.tobytes(), part.alpha_cutoff
