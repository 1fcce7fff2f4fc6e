"""The first stage: a scene from its source, in the form all later stages read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import ClutterConfig
from synfeal.config.load import check_mesh_file
from synfeal.config.models import SceneConfig
from synfeal.dataset.finish import CLUTTER
from synfeal.errors import InputError
from synfeal.files import file_sha256, write_json
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.properties import mesh_properties
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import Triangles, merge_vertices, save_collision_mesh
from synfeal.planning.plan import sampling_box_of
from synfeal.scenes.collision import Rung, collision_mesh, write_curve
from synfeal.seeds import generator_of


def prepare_scene(
    name: str, scene: SceneConfig, collision_agreement: float | None, seed: int, out_mesh: Path
) -> None:
    """Write what later stages read of a scene: ``out_mesh`` (``mesh.glb``, world frame).

    Beside it ``collision.ply``, how that was chosen (``collision_curve.csv``, whose times differ
    between runs), ``clutter.json`` (what was placed in it, if anything) and ``properties.json``.

    Raises:
        InputError: the mesh cannot be used, is not the expected file, or contradicts the
            sampling box; or no pose in that box has a free view.
    """
    out_dir = out_mesh.parent
    mesh, n_faces = prepare_mesh(name, scene, collision_agreement, seed, out_dir)
    origin = scene.builder if scene.source == "procedural" else str(scene.path)
    details = {"source": scene.source, "origin": origin, "collision_faces": n_faces}
    found = {"findings": list(mesh.findings)}
    properties = {"scene": name, **mesh_properties(mesh), **details, **found}
    write_json(out_dir / "properties.json", properties)


def prepare_mesh(
    name: str, scene: SceneConfig, collision_agreement: float | None, seed: int, out_dir: Path
) -> tuple[TexturedMesh, int]:
    """Write ``collision.ply``, ``collision_curve.csv``, ``clutter.json``, and ``mesh.glb`` last.

    Without ``collision_agreement`` the collision mesh is the mesh itself, and the curve is empty.

    Returns:
        The mesh, and how many faces its collision mesh has.
    """
    mesh = build_or_load(scene, seed, name)
    box = sampling_box_of(scene, mesh.bounds_m, f"scenes.{name}")
    curve: list[Rung] = []
    if collision_agreement is None:
        collision = merge_vertices(*mesh.merged())
    else:
        rng = generator_of(seed, "collision", name)
        collision, curve = collision_mesh(mesh, scene, box, collision_agreement, rng)
    places: list[dict[str, Any]] = []
    if scene.clutter is not None:
        mesh, collision, places = _with_clutter(name, scene.clutter, mesh, collision, box)
    write_json(out_dir / CLUTTER, places)
    save_collision_mesh(out_dir / "collision.ply", collision)
    write_curve(out_dir / "collision_curve.csv", curve)
    save_glb(out_dir / "mesh.glb", mesh)
    return mesh, len(collision.faces)


def _with_clutter(
    name: str,
    clutter: ClutterConfig,
    mesh: TexturedMesh,
    collision: Triangles,
    box: NDArray[np.float64],
) -> tuple[TexturedMesh, Triangles, list[dict[str, Any]]]:
    """Scene and collision mesh with objects, none simplified: paths avoid them; where they are."""
    from synfeal.scenes.objects import cluttered  # paints, so takes time to load

    rng = generator_of("clutter", clutter.seed)
    objects, places = cluttered(mesh, box, clutter, rng, f"scenes.{name}.clutter")
    vertices, faces = objects.merged()
    joined = Triangles(
        np.concatenate([collision.vertices_m, vertices]),
        np.concatenate([collision.faces, faces + len(collision.vertices_m)]),
    )
    return TexturedMesh((*mesh.parts, *objects.parts), mesh.findings), joined, places


def build_or_load(scene: SceneConfig, seed: int, name: str) -> TexturedMesh:
    """The scene's mesh: the stand-in of its ``builder``, or the file at its ``path``."""
    if scene.source == "procedural":
        from synfeal.scenes import build_scene  # only a procedural scene needs the builders

        return build_scene(str(scene.builder), seed if scene.seed is None else scene.seed)
    path = Path(str(scene.path))
    if scene.sha256 is not None:
        check_sha256(path, scene.sha256, name)
    return load_mesh(path, scene.up_axis, scene.unit_m)


def check_sha256(path: Path, expected: str, name: str) -> None:
    """Check the mesh file itself; textures that lie beside it are not part of the hash."""
    check_mesh_file(path, f"scenes.{name}.path")
    found = file_sha256(path)
    if found != expected:
        raise InputError(
            f"scenes.{name}.sha256: {path} has {found}, expected {expected}; download it again,"
            " or correct the hash if another version is meant"
        )
