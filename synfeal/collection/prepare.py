"""Preparation of a scene: its mesh, and the objects placed in it."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from trimesh.util import append_faces

from synfeal.collection.collision import Rung, collision_mesh, write_curve
from synfeal.config.collection import BUILDERS, ClutterConfig, SceneConfig
from synfeal.config.dataset import Shade
from synfeal.config.load import check_mesh_file
from synfeal.effects.files import CARTONS, carton_files
from synfeal.errors import InputError
from synfeal.mesh.ambient import with_ambient_light
from synfeal.mesh.checks import refuse_colorless
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties
from synfeal.mesh.save import save_glb
from synfeal.mesh.standing import CLUTTER, refuse_larger, standing
from synfeal.mesh.triangles import Triangles, merge_vertices, save_collision_mesh
from synfeal.objects import materials
from synfeal.objects.canvas import VIVID, pick
from synfeal.objects.patches import Maker, cell_corners
from synfeal.planning.plan import sampling_box_of
from synfeal.records.files import file_sha256, write_json
from synfeal.records.provenance import generator_of


def prepare_scene(
    name: str,
    scene: SceneConfig,
    collision_agreement: float | None,
    seed: int,
    out_mesh: Path,
    shade: Shade | None = None,
) -> None:
    """Write what later stages read of a scene.

    Args:
        name: Name of the scene, for messages.
        scene: Settings of the scene.
        collision_agreement: Share of decisions in which the collision mesh must agree with the
            full one; None to use the full mesh.
        seed: Root of all random numbers.
        out_mesh: File ``mesh.glb`` to write, in the world frame. Beside it: ``collision.ply``; how
            that was chosen, ``collision_curve.csv``, whose times differ between runs;
            ``clutter.json``, what was placed, if anything; ``properties.json``.
        shade: Light that frames are drawn with, if any, see :func:`prepare_mesh`.

    Raises:
        InputError: the mesh cannot be used, is not the expected file, or contradicts the
            sampling box; or no pose in that box has a free view.
    """
    out_dir = out_mesh.parent
    mesh, n_faces = prepare_mesh(name, scene, collision_agreement, seed, out_dir, shade)
    properties = {
        "scene": name,
        "source": scene.source,
        "collision_faces": n_faces,
        "origin": scene.builder if scene.source == "procedural" else str(scene.path),
        **mesh_properties(mesh),
        "findings": list(mesh.findings),
    }
    write_json(out_dir / "properties.json", properties)


def prepare_mesh(
    name: str,
    scene: SceneConfig,
    collision_agreement: float | None,
    seed: int,
    out_dir: Path,
    shade: Shade | None = None,
    called: str | None = None,
) -> tuple[TexturedMesh, int]:
    """Write ``collision.ply``, ``collision_curve.csv``, ``clutter.json``, and ``mesh.glb`` last.

    Args:
        name: Name of the scene.
        scene: Its settings.
        collision_agreement: Decisions in which the collision mesh must agree with the mesh; None
            takes the mesh itself, and the curve is empty.
        seed: Root of all random numbers.
        out_dir: Directory to write to.
        shade: Light that frames are drawn with, which meshes without colours need; ``ambient`` is
            in the colours of ``mesh.glb``.
        called: What messages call the scene; None for its key in a profile.

    Returns:
        The mesh in its own colours, and how many faces its collision mesh has.
    """
    called = called or f"scenes.{name}"
    mesh = build_or_load(scene, seed, called)
    if shade is None:
        refuse_colorless(mesh, str(scene.path or called))
    box = sampling_box_of(scene, mesh.bounds_m, called)
    curve: list[Rung] = []
    if collision_agreement is None:
        collision = merge_vertices(*mesh.merged())
    else:
        rng = generator_of(seed, "collision", name)
        collision, curve = collision_mesh(mesh, scene, box, collision_agreement, rng)
    places: list[dict[str, Any]] = []
    if scene.clutter is not None:
        rng = generator_of("clutter", scene.clutter.seed)
        objects, places = cluttered(mesh, box, scene.clutter, rng, f"{called}: clutter")
        # Paths avoid the objects as they are: none of them is simplified.
        vertices, faces = zip(collision, objects.merged(), strict=True)
        collision = Triangles(*append_faces(vertices, faces))
        mesh = TexturedMesh((*mesh.parts, *objects.parts), mesh.findings)
    write_json(out_dir / CLUTTER, places)
    save_collision_mesh(out_dir / "collision.ply", collision)
    write_curve(out_dir / "collision_curve.csv", curve)
    save_glb(out_dir / "mesh.glb", with_ambient_light(mesh) if shade == "ambient" else mesh)
    return mesh, len(collision.faces)


def build_scene(builder: str, seed: int) -> TexturedMesh:
    """Build a procedural scene: textured, lit, z up, metres; the same bytes for one seed.

    Args:
        builder: Name of the scene among the entry points of :data:`BUILDERS`.
        seed: Seed of the scene.

    Raises:
        InputError: The entry point does not load, names no function, or its function returns no
            textured mesh.
    """
    entry = entry_points(group=BUILDERS)[builder]
    where = f"entry point {builder} of {BUILDERS}"
    try:
        build = entry.load()
    except (ImportError, AttributeError) as error:
        raise InputError(
            where, f"does not load ({error})", "install its package again, or remove it"
        ) from error
    if not callable(build):
        raise InputError(
            where, f"{entry.value} is no function", "name one after a colon, as in sheds:build"
        )
    mesh = build(builder, seed)
    if not isinstance(mesh, TexturedMesh):
        raise InputError(where, f"returned a {type(mesh).__name__}, not a TexturedMesh")
    return mesh


def build_or_load(scene: SceneConfig, seed: int, called: str) -> TexturedMesh:
    """Build the stand-in named by the scene's ``builder``, or load the file at its ``path``.

    Textures that lie beside the file are not part of its hash.

    Args:
        scene: Settings of the scene.
        seed: Seed of a procedural scene whose settings name none; unused for files.
        called: What messages call the scene.

    Raises:
        InputError: The file's SHA-256 is not the one that the settings give.
    """
    if scene.source == "procedural":
        return build_scene(str(scene.builder), seed if scene.seed is None else scene.seed)
    path = Path(str(scene.path))
    if scene.sha256 is not None:
        check_mesh_file(path, f"{called}: path")
        found = file_sha256(path)
        if found != scene.sha256:
            raise InputError(
                called,
                f"sha256: {path} has {found}, expected {scene.sha256}",
                "download it again, or correct the hash if another version is meant",
            )
    return load_mesh(path, scene.up_axis, scene.unit_m)


Array = NDArray[np.float64]
TRIES = 2000  # places, before a scene is called too full
DIM = 0.75  # brightness of built-in cartons: rooms are dimmer than paper


def cluttered(
    mesh: TexturedMesh, bounds_m: Array, clutter: ClutterConfig, rng: np.random.Generator, key: str
) -> tuple[TexturedMesh, list[dict[str, Any]]]:
    """Place objects in a scene.

    Args:
        mesh: The scene.
        bounds_m: Corners (2, 3) of the space that objects are let down from, world, metres.
        clutter: Which objects, and how many.
        rng: Source of the places.
        key: Key of the scene's settings, for messages.

    Returns:
        The scene with the objects in it, and a record of where each stands.

    Raises:
        InputError: an object is larger than the scene, cannot be read, or finds no place.
    """
    kinds = [(path.stem, load_mesh(path)) for path in clutter.files]
    if not kinds:
        refuse_larger(np.full(3, clutter.size_m[1]), mesh, f"{key}: size_m: a carton")
        kinds = [(f"carton-{n}", _carton(clutter, rng)) for n in range(min(clutter.count, CARTONS))]
    for name, kind in kinds:
        refuse_larger(np.ptp(kind.bounds_m, axis=0), mesh, f"{key}: {name}")
    vertices, faces = mesh.merged()
    parts: list[MeshPart] = []
    places: list[dict[str, Any]] = []
    found = standing(kinds, clutter.count, vertices[faces], bounds_m, rng, TRIES)
    for number, each in enumerate(found):
        if each is None:
            raise InputError(
                key,
                f"no place left for {kinds[number % len(kinds)][0]}, object {number + 1} of"
                f" {clutter.count}",
                "give fewer or smaller ones",
            )
        parts += each[0]
        places.append(each[1])
    return TexturedMesh(tuple(parts)), places


def save_cartons(mesh: Path) -> None:
    """Write the built-in objects beside the mesh of a scene, where rendering finds them."""
    rng, usual = generator_of("cartons"), ClutterConfig()
    for path in carton_files(mesh):
        save_glb(path, _carton(usual, rng))


def _carton(clutter: ClutterConfig, rng: np.random.Generator) -> TexturedMesh:
    """Build a carton with labels."""
    wide, deep, high = rng.uniform(*clutter.size_m, 3)
    painter = materials.label(pick(rng, VIVID))
    parts = []
    for patch in Maker(rng).box((wide, deep, high), painter, 120).patches:
        a, b, c, d = cell_corners(patch.points_m.shape[:2])
        faces = np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])
        down, right = np.meshgrid(patch.row_shares, patch.column_shares, indexing="ij")
        uv = np.stack([right.ravel(), 1 - down.ravel()], axis=1)
        picture = (patch.picture * DIM).astype(np.uint8)
        parts.append(MeshPart("side", patch.points_m.reshape(-1, 3), faces, uv, picture))
    return TexturedMesh(tuple(parts))
