"""Everything that is said about a mesh, as one value that goes into a file."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

import synfeal
from synfeal.config.models import SceneConfig
from synfeal.files import file_sha256
from synfeal.inspect.doubts import (
    colour_doubts,
    doubts_of,
    floor_areas_m2,
    load_as_meant,
    suggestion_doubts,
)
from synfeal.inspect.freespace import DEFINITION, FreeSpace, survey, viewpoint
from synfeal.inspect.suggest import N_FRAMES, Suggestion, suggest
from synfeal.inspect.surface import SurfacePoints, back_face_share, detail_of, triangle_areas_m2
from synfeal.mesh.gltf import slug_of, title_of
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties, mesh_topology
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import merge_vertices
from synfeal.planning.plan import sampling_box_of
from synfeal.seeds import generator_of

Array = NDArray[np.float64]

N_HOLES = 10  # of which the length is told


@dataclass(frozen=True)
class Inspection:
    """What is known of a mesh."""

    scene: SceneConfig  # path, axis and unit as they were taken
    mesh: TexturedMesh
    assumed: tuple[str, ...]  # sentences about what the file did not say
    surface: SurfacePoints  # points spread over the mesh
    caster: RayCaster  # rays against it
    box_m: Array  # (2, 3) the box that was searched
    space: FreeSpace  # its free space
    suggestion: Suggestion | None  # a sampling box that works, if one was found

    @classmethod
    def of(cls, scene: SceneConfig, unit_is_given: bool) -> Self:
        """Load and look at a mesh; see :func:`synfeal.inspect.run.inspect_mesh`."""
        scene, mesh, assumed = load_as_meant(scene, unit_is_given)
        box_m = sampling_box_of(scene, mesh.bounds_m, str(scene.path))
        surface = SurfacePoints.of(mesh, generator_of(0, "inspect"))
        caster = RayCaster(*mesh.merged())
        found = survey(caster, surface.position_m, box_m)
        space, suggestion = suggest(caster, found, scene)
        return cls(scene, mesh, tuple(assumed), surface, caster, box_m, space, suggestion)

    @property
    def suggested_m(self) -> Array | None:
        """The suggested box (2, 3)."""
        return None if self.suggestion is None else self.suggestion.box_m

    @property
    def viewpoint_m(self) -> Array:
        """Where the pictures are taken from, (3,): in the free space if there is any."""
        found_m = viewpoint(self.space, self.suggested_m)
        return self.mesh.bounds_m.mean(axis=0) if found_m is None else found_m


def facts_of(found: Inspection) -> dict[str, Any]:
    """Numbers, findings and doubts, ready for JSON."""
    scene, mesh, space, suggestion = found.scene, found.mesh, found.space, found.suggestion
    title = title_of(Path(str(scene.path)))
    detail, collect, box = detail_of(mesh), None, None
    topology = asdict(mesh_topology(*merge_vertices(*mesh.merged())))
    lengths = list(topology.pop("hole_lengths_m"))
    if suggestion is not None:  # the command, and what planning it once showed
        box = dict(zip("xyz", suggestion.box_m.T.tolist(), strict=True))
        command = suggestion.command(f"{slug_of(title)}-frames")
        collect = {"command": command, "frames": N_FRAMES, "empty_pixels": asdict(suggestion.empty)}
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
            "share": space.share,
            "volume_m3": space.share * float(np.prod(found.box_m[1] - found.box_m[0])),
            "enclosure": space.enclosure,
            "floor_m": space.floor_m,
            "elsewhere": space.elsewhere,
        },
        "back_faces_share": back_face_share(mesh, found.caster, space),
        "suggested_sampling_box": box,
        "collect": collect,
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
