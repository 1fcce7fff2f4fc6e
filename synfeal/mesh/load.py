"""Reading any textured mesh into the world frame: z up, metres, one base colour source per part."""

from __future__ import annotations

import io
import json
import logging
import struct
from collections.abc import Iterable, Iterator
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
    check_size,
)
from synfeal.mesh.compressed import decoded
from synfeal.mesh.cutting import opaque_side
from synfeal.mesh.gltf import CLAMP_TO_EDGE, MIRRORED_REPEAT, Gltf, read_gltf, simplified
from synfeal.mesh.gltf_features import declared_triangles, report_features, without_surface
from synfeal.mesh.materials import BaseMaterial, MaterialReader, large_images_allowed
from synfeal.mesh.model import Findings, MeshPart, TexturedMesh
from synfeal.mesh.obj import read_obj
from synfeal.mesh.ply import read_ply
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
    findings = Findings(path)
    gltf = read_gltf(path) if path.suffix.lower() in GLTF_SUFFIXES else None
    world_from_file = WORLD_FROM_Y_UP if is_y_up(path, up_axis) else np.eye(3)
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused below
            parts = _read_parts(path, gltf, unit_m * world_from_file, findings)
    except DAMAGE as error:
        raise InputError(path, f"cannot be read as a mesh ({why(error)})") from error
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
    with large_images_allowed():
        if gltf is None:
            read = _read_text_parts(path, findings)
        else:
            read = _read_gltf_parts(path, gltf, findings)
        parts, hidden = [], []
        for part, file_from_part in read:
            if not len(part.faces):
                hidden.append(part)
                continue
            checks.check_indices(part, path)
            placed = _placed(part, file_from_part, world_from_file)
            check_extent(path, placed)
            parts.append(placed)
    kept = [part for part in (checks.repaired(part, findings) for part in parts) if len(part.faces)]
    drawn = tuple(part for part in kept if part.is_drawn)
    hidden += [part for part in kept if not part.is_drawn]
    for part in hidden:
        findings.note(f"part '{part.name}': nowhere opaque enough to be seen; left out")
    if hidden and not drawn:
        raise InputError(
            path,
            "is transparent everywhere by its materials, so nothing would be seen",
            "make them opaque, in an MTL by 'd 1'",
        )
    return drawn


Placed = tuple[MeshPart, NDArray[np.float64]]  # a part, and the transform (4, 4) into its file


def _read_text_parts(path: Path, findings: Findings) -> Iterable[Placed]:
    """Read the parts of an OBJ or PLY file, which stand where they are."""
    resolver = ReferenceResolver(path)
    read = read_obj if path.suffix.lower() == ".obj" else read_ply
    try:
        parts = read(path, resolver, findings)
    finally:
        _report_files(resolver, findings, None)
    return [(part, np.eye(4)) for part in parts]


def _read_gltf_parts(path: Path, gltf: Gltf, findings: Findings) -> Iterator[Placed]:
    """Read the parts of a glTF, once for each node that draws them."""
    gltf = decoded(gltf, ReferenceResolver(path).get)
    checks.refuse_extensions(path, gltf.header)
    check_accessors(path, gltf.header)
    materials = MaterialReader(gltf.header, findings, path)
    report_features(gltf.header, findings)
    scene = _read_scene(path, gltf, findings)
    order = {name: index for index, name in enumerate(scene.geometry)}
    nodes = sorted(scene.graph.nodes_geometry, key=lambda node: (order[scene.graph[node][1]], node))
    drawn = [scene.geometry[scene.graph[node][1]] for node in nodes]
    n_faces = sum(len(getattr(geometry, "faces", ())) for geometry in drawn)
    check_instances(path, n_faces)
    n_declared = declared_triangles(gltf.header)
    if n_faces != n_declared:
        findings.warn(f"declares {n_declared} triangles, of which {n_faces} could be read")
    instead = without_surface(gltf.header)
    if not n_faces and instead is not None:
        raise InputError(path, instead)
    for node in nodes:
        file_from_part, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            prefix, _, rest = name.partition(":")  # save_glb writes their order before names
            own = rest if prefix.isdigit() and rest else name
            yield _part(own, geometry, materials, findings), file_from_part
    materials.report_lost_textures()


def _read_scene(path: Path, gltf: Gltf, findings: Findings) -> Any:
    """Read the file as a trimesh scene, without merging or reordering vertices."""
    resolver = ReferenceResolver(path, gltf)
    # It prints tracebacks of what the findings name.
    logging.getLogger("trimesh").setLevel(logging.ERROR)
    try:
        source = io.BytesIO(json.dumps(simplified(gltf)).encode())
        return trimesh.load_scene(source, "gltf", resolver=resolver, process=False)
    finally:
        _report_files(resolver, findings, gltf)


def _report_files(resolver: ReferenceResolver, findings: Findings, gltf: Gltf | None) -> None:
    """Name the files that could not be read; raise a refusal if there was one."""
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
    """Read one geometry of a glTF, in its own frame."""
    vertices = np.asarray(geometry.vertices, dtype=np.float64)
    faces = np.asarray(geometry.faces, dtype=np.int64)
    visual = geometry.visual
    part = MeshPart(name, vertices, faces, vertex_rgb=materials.vertex_rgb(geometry))
    if visual.kind != "texture":
        return part
    material = materials.read(visual.material)
    part = _with_material(part, visual.uv, material, findings)
    opacity, cutoff = materials.vertex_opacity(geometry), material.vertex_cutoff
    if opacity is None or not cutoff or len(opacity) != len(vertices):
        return part
    opacity = opacity * (part.base_color[3] / 255.0)
    if opacity.min() >= cutoff:
        return part
    findings.note(f"{material.owner}: cut where its vertices are less opaque than {cutoff:.2g}")
    return opaque_side(part, opacity, cutoff)


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
    return _wrapped(replace(part, uv=coordinates, texture=material.texture), material, findings)


def _wrapped(part: MeshPart, material: BaseMaterial, findings: Findings) -> MeshPart:
    """Let the texture go on beyond 0 and 1 as the material has it.

    A mirrored one is doubled by its mirror image, which then repeats; where no coordinate lies
    beyond, that is no different from an edge that goes on.
    """
    uv = part.uv
    assert uv is not None
    beyond = [bool(((along < 0.0) | (along > 1.0)).any()) for along in uv.T]
    doubled_u, doubled_v = (
        mode == MIRRORED_REPEAT and is_beyond
        for mode, is_beyond in zip(material.wrap, beyond, strict=True)
    )
    clamped_u, clamped_v = (
        mode == CLAMP_TO_EDGE or (mode == MIRRORED_REPEAT and not is_beyond)
        for mode, is_beyond in zip(material.wrap, beyond, strict=True)
    )
    part = replace(part, clamped_uv=(clamped_u, clamped_v))
    if not (doubled_u or doubled_v):
        return part
    texture = material.doubled(doubled_u, doubled_v, findings)
    return replace(part, texture=texture, uv=uv / np.array([1 + doubled_u, 1 + doubled_v]))
