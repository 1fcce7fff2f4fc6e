"""The first stage: a scene from its source, in the form all later stages read."""

from __future__ import annotations

import hashlib
from pathlib import Path

from synfeal.config.models import SceneConfig
from synfeal.errors import InputError
from synfeal.files import write_json
from synfeal.mesh.decimate import collision_mesh, save_collision_mesh
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.properties import mesh_properties
from synfeal.mesh.save import save_glb
from synfeal.planning.plan import sampling_box_of


def prepare_scene(
    name: str, scene: SceneConfig, collision_faces: int, seed: int, out_dir: Path
) -> None:
    """Write ``mesh.glb`` (world frame), ``collision.ply`` and ``properties.json`` into ``out_dir``.

    Raises:
        InputError: the mesh cannot be used, is not the expected file, or contradicts the
            sampling box.
    """
    mesh = build_or_load(scene, seed, name)
    sampling_box_of(scene, mesh.bounds_m, f"scenes.{name}")
    vertices, faces = collision_mesh(mesh, collision_faces)
    save_glb(out_dir / "mesh.glb", mesh)
    save_collision_mesh(out_dir / "collision.ply", vertices, faces)
    origin = scene.builder if scene.source == "procedural" else str(scene.path)
    details = {"source": scene.source, "origin": origin, "collision_faces": len(faces)}
    write_json(out_dir / "properties.json", {"scene": name, **mesh_properties(mesh), **details})


def build_or_load(scene: SceneConfig, seed: int, name: str) -> TexturedMesh:
    """The scene's mesh: the stand-in of its ``builder``, or the file at its ``path``."""
    if scene.source == "procedural":
        from synfeal.scenes import build_scene  # only a procedural scene needs the builders

        return build_scene(str(scene.builder), seed)
    path = Path(str(scene.path))
    if scene.sha256 is not None:
        check_sha256(path, scene.sha256, name)
    return load_mesh(path, scene.up_axis, scene.unit_m)


def check_sha256(path: Path, expected: str, name: str) -> None:
    """Check the mesh file itself; textures that lie beside it are not part of the hash.

    Raises:
        InputError: the file is missing or is not the expected one.
    """
    if not path.is_file():
        raise InputError(f"scenes.{name}.path: {path} does not exist; download the mesh to it")
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    if found != expected:
        raise InputError(
            f"scenes.{name}.sha256: {path} has {found}, expected {expected}; download it again,"
            " or correct the hash if another version is meant"
        )
