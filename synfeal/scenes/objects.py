"""Objects that stand about in a scene: files of the user's, or cartons; none touches another."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import ClutterConfig
from synfeal.effects.scene import CARTONS, carton_files
from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.standing import Ground, described, moved
from synfeal.scenes import fronts
from synfeal.scenes.canvas import pick
from synfeal.scenes.patches import Maker
from synfeal.scenes.pictures import VIVID
from synfeal.seeds import generator_of

Array = NDArray[np.float64]
TRIES = 2000  # places, before a scene is called too full
DIM = 0.75  # of the built-in cartons beside their pictures: rooms are dimmer than paper


def cluttered(
    mesh: TexturedMesh, bounds_m: Array, clutter: ClutterConfig, rng: np.random.Generator, key: str
) -> tuple[TexturedMesh, list[dict[str, Any]]]:
    """The objects placed in a scene, and where each stands.

    They are let down from the space between the corners ``bounds_m`` (2, 3); ``key`` is that of the
    scene's settings, for messages.

    Raises:
        InputError: an object is larger than the scene, cannot be read, or finds no place.
    """
    room_m = np.ptp(mesh.bounds_m, axis=0)
    kinds = [(path.stem, load_mesh(path)) for path in clutter.files]
    if not kinds:
        _refuse_larger(np.full(3, clutter.size_m[1]), room_m, f"{key}: size_m: a carton")
        kinds = [(f"carton-{n}", _carton(clutter, rng)) for n in range(min(clutter.count, CARTONS))]
    for name, kind in kinds:
        _refuse_larger(np.ptp(kind.bounds_m, axis=0), room_m, f"{key}: {name}")
    vertices, faces = mesh.merged()
    corners = vertices[faces]
    parts: list[MeshPart] = []
    places: list[dict[str, Any]] = []
    for number in range(clutter.count):
        name, kind = kinds[number % len(kinds)]
        found = Ground(corners).place(kind, bounds_m, rng, TRIES)
        if found is None:
            raise InputError(
                f"{key}: no place left for {name}, object {number + 1} of {clutter.count}; give"
                " fewer or smaller ones"
            )
        foot_m, yaw_rad = found
        standing = moved(kind, foot_m, yaw_rad, f"object-{number}")
        parts += standing
        corners = np.concatenate([corners, *(p.vertices_m[p.faces] for p in standing)])
        places.append(described(name, kind, foot_m, yaw_rad))
    return TexturedMesh(tuple(parts)), places


def save_cartons(mesh: Path) -> None:
    """Write the built-in objects beside the mesh of a scene, where rendering finds them."""
    rng, usual = generator_of("cartons"), ClutterConfig()
    for path in carton_files(mesh):
        save_glb(path, _carton(usual, rng))


def _refuse_larger(size_m: Array, room_m: Array, what: str) -> None:
    if (np.sort(size_m) > np.sort(room_m)).any():
        shown = " x ".join(f"{side:.3g}" for side in size_m)
        raise InputError(f"{what} is {shown} m, larger than the scene; check its unit")


def _carton(clutter: ClutterConfig, rng: np.random.Generator) -> TexturedMesh:
    """A carton with labels."""
    wide, deep, high = rng.uniform(*clutter.size_m, 3)
    painter = partial(fronts.label, colour=pick(rng, VIVID))
    parts = []
    for patch in Maker(rng).box((wide, deep, high), painter, 120).patches:
        rows, columns = patch.points_m.shape[:2]
        index = np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = (i.ravel() for i in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1],
                                          index[1:, 1:]))  # fmt: skip
        faces = np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])
        down, right = np.meshgrid(patch.row_shares, patch.column_shares, indexing="ij")
        uv = np.stack([right.ravel(), 1 - down.ravel()], axis=1)
        picture = (patch.picture * DIM).astype(np.uint8)
        parts.append(MeshPart("side", patch.points_m.reshape(-1, 3), faces, uv, picture))
    return TexturedMesh(tuple(parts))
