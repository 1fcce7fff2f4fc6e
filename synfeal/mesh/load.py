"""Reading any textured mesh into the world frame: z up, metres, one base colour source per part."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.mesh.checks import check_mesh
from synfeal.mesh.materials import BaseMaterial, reduce_material
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.textures import RecordingResolver, warn_missing_textures

UpAxis = Literal["auto", "y", "z"]
SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", ".off", ".dae")
GLTF_SUFFIXES = (".glb", ".gltf")

# Rotates y-up files: their y becomes the world's z, their z points towards the viewer (-y).
WORLD_FROM_Y_UP: NDArray[np.float64] = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])


def load_mesh(path: Path, up_axis: UpAxis = "auto", unit_m: float = 1.0) -> TexturedMesh:
    """Read a mesh, apply its scene graph, turn it z-up and scale it to metres.

    Args:
        path: GLB, glTF, OBJ with MTL, or PLY with vertex colours or texture coordinates.
        up_axis: axis that points up in the file; ``auto`` is y for glTF and z otherwise.
        unit_m: length of one unit of the file in metres.

    Raises:
        InputError: the file is missing, empty, of an unknown kind, unreadable, without faces, with
            coordinates that are not finite, or without any colour.
    """
    path = Path(path)
    scene = _read_scene(path)
    scale = unit_m * _world_from_file(path, up_axis)
    parts: list[MeshPart] = []
    for node in sorted(scene.graph.nodes_geometry):  # a fixed order, whatever the parser does
        file_from_part, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            vertices = trimesh.transform_points(geometry.vertices, file_from_part) @ scale.T
            parts.append(_part(_part_name(name), vertices, geometry, str(path)))
    mesh = TexturedMesh(tuple(part for part in parts if part.is_drawn))
    check_mesh(mesh, path)
    return mesh


def _world_from_file(path: Path, up_axis: UpAxis) -> NDArray[np.float64]:
    """Rotation (3, 3) from the axes of the file to the world."""
    y_up = path.suffix.lower() in GLTF_SUFFIXES if up_axis == "auto" else up_axis == "y"
    return WORLD_FROM_Y_UP if y_up else np.eye(3)


def _part_name(name: str) -> str:
    """Name without the order prefix that :func:`synfeal.mesh.save.save_glb` writes."""
    prefix, _, rest = name.partition(":")
    return rest if prefix.isdigit() and rest else name


def _read_scene(path: Path) -> Any:
    """The file as a trimesh scene, without merging or reordering vertices."""
    _check_file(path)
    resolver = RecordingResolver(str(path))
    try:
        scene = trimesh.load_scene(str(path), resolver=resolver, process=False)
    except Exception as error:  # parsers of foreign files fail in every way there is
        reason = str(error) or type(error).__name__
        raise InputError(f"{path}: cannot be read as a mesh ({reason})") from None
    warn_missing_textures(path, resolver.missing)
    return scene


def _check_file(path: Path) -> None:
    if not path.is_file():
        raise InputError(f"{path}: no such mesh file; check the path")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the mesh file is empty; download or export it again")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"{path}: unknown kind of mesh '{path.suffix}'; convert it to one of"
            f" {', '.join(SUFFIXES)}"
        )


def _part(
    name: str, vertices: NDArray[np.float64], geometry: trimesh.Trimesh, origin: str
) -> MeshPart:
    """One geometry of the file; ``vertices`` are already in the world."""
    visual = geometry.visual
    faces = np.asarray(geometry.faces, dtype=np.int64)
    if visual.kind == "texture":
        material = reduce_material(visual.material, origin)
        return _textured_part(name, vertices, faces, visual, material)
    if visual.kind == "face":  # a colour per face: every face gets vertices of its own
        soup = np.arange(faces.size).reshape(-1, 3)
        face_rgb = _rgb(np.repeat(visual.face_colors, 3, axis=0))
        return MeshPart(name, vertices[faces.ravel()], soup, vertex_rgb=face_rgb)
    colors = visual.vertex_colors if visual.kind == "vertex" else None
    return MeshPart(name, vertices, faces, vertex_rgb=_rgb(colors))


def _rgb(colors: Any) -> NDArray[np.uint8] | None:
    """Colours (N, 3) of trimesh colours (N, 3 | 4), if there are any."""
    return None if colors is None else np.asarray(colors)[:, :3].astype(np.uint8)


def _textured_part(
    name: str,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    visual: Any,
    material: BaseMaterial,
) -> MeshPart:
    """A part with a material; without a texture its coordinates are of no use and are dropped."""
    has_texture = material.texture is not None and visual.uv is not None
    return MeshPart(
        name=name,
        vertices_m=vertices,
        faces=faces,
        uv=np.asarray(visual.uv, dtype=np.float64) if has_texture else None,
        texture=material.texture if has_texture else None,
        vertex_rgb=_rgb(visual.vertex_attributes.get("color")),
        base_color=material.base_color,
        alpha_cutoff=material.alpha_cutoff,
    )
