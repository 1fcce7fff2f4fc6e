"""Objects that stand about in a scene: files of the user's, or cartons; none touches another.

An object stands upright on what lies flat below it, turned at random. Its bounding box meets no
triangle of the scene or of an object before it, by the separating-axis test of Akenine-Möller
(Fast 3D triangle-box overlap testing, JGT 6(1), 2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import ClutterConfig
from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.scenes import fronts
from synfeal.scenes.canvas import pick
from synfeal.scenes.patches import box
from synfeal.scenes.pictures import VIVID

Array = NDArray[np.float64]
CARTONS = 8  # that differ
TRIES = 2000  # places, before a scene is called too full
CLEARANCE_M = 0.002  # between an object and what it stands on
FLAT_M = 0.008  # what it stands on may differ by at the corners
DIM = 0.75  # of the built-in cartons beside their pictures: rooms are dimmer than paper


def cluttered(
    mesh: TexturedMesh, bounds_m: Array, clutter: ClutterConfig, rng: np.random.Generator, key: str
) -> tuple[TexturedMesh, list[dict[str, Any]]]:
    """The objects placed in a scene, and where each stands.

    Args:
        mesh: the scene.
        bounds_m: (2, 3) corners of the space that objects are let down from.
        clutter: how many, and which.
        rng: of sizes, places and turns.
        key: of the scene's settings, for messages.

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
        found = _place(corners, kind, bounds_m, rng)
        if found is None:
            raise InputError(
                f"{key}: no place left for {name}, object {number + 1} of {clutter.count}; give"
                " fewer or smaller ones"
            )
        foot_m, yaw_rad = found
        standing = _moved(kind, foot_m, yaw_rad, f"object-{number}")
        parts += standing
        corners = np.concatenate([corners, *(p.vertices_m[p.faces] for p in standing)])
        place = {"position_m": foot_m.round(4).tolist(), "yaw_deg": round(np.degrees(yaw_rad), 2)}
        size_m = np.ptp(kind.bounds_m, axis=0).round(4).tolist()
        places.append({"name": name, **place, "size_m": size_m})
    return TexturedMesh(tuple(parts)), places


def _refuse_larger(size_m: Array, room_m: Array, what: str) -> None:
    if (np.sort(size_m) > np.sort(room_m)).any():
        shown = " x ".join(f"{side:.3g}" for side in size_m)
        raise InputError(f"{what} is {shown} m, larger than the scene; check its unit")


def _carton(clutter: ClutterConfig, rng: np.random.Generator) -> TexturedMesh:
    """A carton with labels."""
    wide, deep, high = rng.uniform(*clutter.size_m, 3)
    painter = partial(fronts.label, colour=pick(rng, VIVID))
    parts = []
    for patch in box(rng, (wide, deep, high), painter, 120).patches:
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


def _moved(kind: TexturedMesh, foot_m: Array, yaw_rad: float, name: str) -> list[MeshPart]:
    """An object with the middle of its bottom at a place, turned."""
    lower, upper = kind.bounds_m
    middle = np.array([*(lower + upper)[:2] / 2, lower[2]])
    turn = _about_z(yaw_rad)
    return [
        replace(part, name=name, vertices_m=(part.vertices_m - middle) @ turn.T + foot_m)
        for part in kind.parts
    ]


def _about_z(yaw_rad: float) -> Array:
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _place(
    corners: Array, kind: TexturedMesh, bounds_m: Array, rng: np.random.Generator
) -> tuple[Array, float] | None:
    """Where an object can stand (3,), and how it is turned; None after many tries."""
    half_m = np.ptp(kind.bounds_m, axis=0) / 2
    caster = RayCaster(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    base = np.array([(x, y, 0.0) for x in (-1, 0, 1) for y in (-1, 0, 1)]) * half_m
    for _ in range(TRIES):
        start_m, yaw_rad = rng.uniform(bounds_m[0], bounds_m[1]), float(rng.uniform(0, 2 * np.pi))
        above = base @ _about_z(yaw_rad).T + start_m
        height_m = above[:, 2] - caster.first_hit_m(above, np.tile([0.0, 0.0, -1.0], (9, 1)))
        if not np.isfinite(height_m).all() or np.ptp(height_m) > FLAT_M:
            continue
        foot_m = np.array([*start_m[:2], height_m.max() + CLEARANCE_M])
        if not meets_box(corners, foot_m + np.array([0.0, 0.0, half_m[2]]), half_m, yaw_rad).any():
            return foot_m, yaw_rad
    return None


def meets_box(
    corners: Array, centre_m: Array, half_m: Sequence[float] | Array, yaw_rad: float
) -> NDArray[np.bool_]:
    """Which triangles (N, 3, 3) meet a box that is turned about z, its inside included: (N,)."""
    half = np.asarray(half_m, np.float64)
    corners = (corners - centre_m) @ _about_z(yaw_rad)
    meets = ((corners.min(axis=1) <= half) & (corners.max(axis=1) >= -half)).all(axis=1)
    near = corners[meets]
    sides = np.roll(near, -1, axis=1) - near
    axes = [np.cross(sides[:, 0], sides[:, 1])]
    axes += [np.cross(unit, sides[:, side]) for unit in np.eye(3) for side in range(3)]
    still = np.ones(len(near), bool)
    for axis in axes:
        along = np.einsum("nij,nj->ni", near, axis)
        reach = np.abs(axis) @ half
        still &= (along.min(axis=1) <= reach) & (along.max(axis=1) >= -reach)
    meets[meets] = still
    return np.asarray(meets)
