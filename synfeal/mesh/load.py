"""Reading any textured mesh into the world frame: z up, metres, one base colour source per part."""

from __future__ import annotations

import io
import json
import logging
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.errors import InputError, why
from synfeal.mesh import checks
from synfeal.mesh.claims import (
    check_accessors,
    check_extent,
    check_instances,
    check_ply,
    check_size,
)
from synfeal.mesh.compressed import decoded
from synfeal.mesh.gltf import Gltf, read_gltf, simplified
from synfeal.mesh.materials import BaseMaterial, MaterialReader, large_images_allowed
from synfeal.mesh.model import Findings, MeshPart, TexturedMesh
from synfeal.mesh.references import ReferenceResolver, report_missing

UpAxis = Literal["auto", "y", "z"]
# What trimesh, the decoders, and our reading of a glTF's JSON raise for damaged files (found by
# flipping bytes and changing values). ``AttributeError`` and ``MemoryError`` are not among them: a
# fault in this program, and a lack of memory, are raised as what they are.
DAMAGE = (
    ArithmeticError,
    AssertionError,
    LookupError,
    OSError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
)
GLTF_SUFFIXES = (".glb", ".gltf")

# Rotates y-up files: their y becomes the world's z, their z points towards the viewer (-y).
WORLD_FROM_Y_UP: NDArray[np.float64] = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])


def load_mesh(path: Path, up_axis: UpAxis = "auto", unit_m: float = 1.0) -> TexturedMesh:
    """Read a mesh, apply its scene graph, turn it z-up and scale it to metres.

    What had to be left out, converted or removed is named in the findings of the result.

    Args:
        path: GLB, glTF, OBJ with MTL, or PLY with vertex colours or texture coordinates.
        up_axis: axis that points up in the file; ``auto`` is y for glTF and z otherwise.
        unit_m: length of one unit of the file in metres.

    Raises:
        InputError: the file is missing, empty, of an unknown kind, unreadable, without faces, with
            coordinates that are not finite, stored in a way that is not read, such as Draco,
            claims more than it holds, or refers to a file outside of its folder.
    """
    path = Path(path)
    checks.refuse_file(path)
    if path.suffix.lower() == ".ply":
        check_ply(path)
    findings = Findings(path)
    gltf = read_gltf(path) if path.suffix.lower() in GLTF_SUFFIXES else None
    world_from_file = WORLD_FROM_Y_UP if is_y_up(path, up_axis) else np.eye(3)
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused below
            parts = _read_parts(path, gltf, unit_m * world_from_file, findings)
    except DAMAGE as error:
        raise InputError(f"{path}: cannot be read as a mesh ({why(error)})") from error
    mesh = TexturedMesh(parts, findings.sentences)
    checks.check_mesh(mesh, path)
    check_size(path, mesh)
    return mesh


def is_y_up(path: Path, up_axis: UpAxis) -> bool:
    """Check whether y points up in a file; ``auto`` means y up for glTF only."""
    return path.suffix.lower() in GLTF_SUFFIXES if up_axis == "auto" else up_axis == "y"


def _read_parts(
    path: Path, gltf: Gltf | None, world_from_file: NDArray[np.float64], findings: Findings
) -> tuple[MeshPart, ...]:
    """Read all visible parts in the order of the file's geometry, then of its nodes."""
    if gltf is not None:
        gltf = decoded(gltf, ReferenceResolver(path).get)
        checks.refuse_extensions(path, gltf.header)
        check_accessors(path, gltf.header)
    materials = MaterialReader(None if gltf is None else gltf.header, findings, path)
    with large_images_allowed():
        scene = _read_scene(path, gltf, findings)
        order = {name: index for index, name in enumerate(scene.geometry)}
        nodes = sorted(
            scene.graph.nodes_geometry, key=lambda node: (order[scene.graph[node][1]], node)
        )
        drawn = [scene.geometry[scene.graph[node][1]] for node in nodes]
        check_instances(path, sum(len(getattr(geometry, "faces", ())) for geometry in drawn))
        parts = []
        for node in nodes:
            file_from_part, name = scene.graph[node]
            geometry = scene.geometry[name]
            if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
                prefix, _, rest = name.partition(":")  # save_glb writes their order before names
                own = rest if prefix.isdigit() and rest else name
                part = _part(own, geometry, materials, findings)
                checks.check_indices(part, path)
                placed = _placed(part, file_from_part, world_from_file)
                check_extent(path, placed)
                parts.append(placed)
    kept = [part for part in (checks.repaired(part, findings) for part in parts) if len(part.faces)]
    for part in kept:
        if not part.is_drawn:
            findings.note(f"part '{part.name}': nowhere opaque enough to be seen; left out")
    return tuple(part for part in kept if part.is_drawn)


def _read_scene(path: Path, gltf: Gltf | None, findings: Findings) -> Any:
    """Read the file as a trimesh scene, without merging or reordering vertices."""
    resolver = ReferenceResolver(path, gltf)
    # It prints tracebacks of what the findings name.
    logging.getLogger("trimesh").setLevel(logging.ERROR)
    try:
        source: Any = str(path)
        if gltf is not None:
            source = io.BytesIO(json.dumps(simplified(gltf)).encode())
        kind = None if gltf is None else "gltf"
        return trimesh.load_scene(source, kind, resolver=resolver, process=False)
    finally:
        resolver.raise_refusal()
        report_missing(resolver.missing, findings, gltf)
        for name in dict.fromkeys(resolver.unreadable):
            findings.warn(f"'{name}' cannot be read as an image; base colours are used instead")


def _placed(
    part: MeshPart, file_from_part: NDArray[np.float64], world_from_file: NDArray[np.float64]
) -> MeshPart:
    """Place the part in the world; a mirrored one is turned inside out again, as glTF asks."""
    vertices = trimesh.transform_points(part.vertices_m, file_from_part) @ world_from_file.T
    is_mirrored = np.linalg.det(file_from_part[:3, :3]) < 0
    faces = part.faces[:, ::-1].copy() if is_mirrored else part.faces
    return replace(part, vertices_m=vertices, faces=faces)


def _part(
    name: str, geometry: trimesh.Trimesh, materials: MaterialReader, findings: Findings
) -> MeshPart:
    """Read one geometry of the file, in its own frame."""
    vertices = np.asarray(geometry.vertices, dtype=np.float64)
    faces = np.asarray(geometry.faces, dtype=np.int64)
    visual = geometry.visual
    if visual.kind == "face":  # a colour per face: every face gets vertices of its own
        soup = np.arange(faces.size).reshape(-1, 3)
        face_rgb = np.repeat(np.asarray(visual.face_colors, np.uint8)[:, :3], 3, axis=0)
        return MeshPart(name, vertices[faces.ravel()], soup, vertex_rgb=face_rgb)
    part = MeshPart(name, vertices, faces, vertex_rgb=materials.vertex_rgb(geometry))
    if visual.kind != "texture":
        return part
    return _with_material(part, visual.uv, materials.read(visual.material), findings)


def _with_material(part: MeshPart, uv: Any, material: BaseMaterial, findings: Findings) -> MeshPart:
    """Attach a material to the part; without a texture its coordinates are dropped."""
    part = replace(part, base_color=material.base_color, alpha_cutoff=material.alpha_cutoff)
    if material.texture is None:
        return part
    if uv is None or np.shape(uv)[0] != len(part.vertices_m):
        findings.warn(
            f"part '{part.name}': has a texture but no texture coordinates; its base colour is used"
        )
        return part
    coordinates = material.transformed(np.asarray(uv, dtype=np.float64)[:, :2])
    return replace(part, uv=coordinates, texture=material.texture)
