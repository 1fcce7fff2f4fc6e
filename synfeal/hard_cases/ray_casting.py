"""Rays where triangles meet, along surfaces, from surfaces, on slivers and far from the origin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import RATIONAL, max_abs, mpf
from synfeal.hard_cases.exact_rays import distance_m, first_crossings
from synfeal.mesh import rays

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
N_AIMED = 4000
N_RAYS = 100
N_SLIVERS = 101
PARALLEL = 1e-6  # the textbook's threshold on the determinant
TURN = Rotation.from_rotvec([0.3, 0.6, -0.2]).as_matrix()
FLOOR = np.array([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [5.0, 5.0, 0.0], [-5.0, 5.0, 0.0]])


def leaks(mesh: trimesh.Trimesh, at_corners: bool) -> Trial:
    """Rays from within a closed surface at its edges or corners; a share of 0 must get out."""
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    rng = np.random.default_rng(3)
    ends = vertices[mesh.edges_unique[rng.integers(0, len(mesh.edges_unique), N_AIMED)]]
    along = np.zeros((N_AIMED, 1)) if at_corners else rng.uniform(0.0, 1.0, (N_AIMED, 1))
    targets = ends[:, 0] + along * (ends[:, 1] - ends[:, 0])
    origins = mesh.bounds.mean(axis=0) + rng.uniform(-0.1, 0.1, (N_AIMED, 3))
    caster = rays.RayCaster(vertices, faces)
    return Trial(
        naive=lambda: np.isinf(moller_trumbore(vertices, faces, origins, targets - origins)).mean(),
        ours=lambda: np.isinf(caster.first_hit_m(origins, targets - origins)).mean(),
        truth=mpf(0.0),
    )


def hits(vertices: Array, faces: Faces, origins: Array, directions: Array) -> Trial:
    """Distances of hits from the plane they are on, as a share of the mesh's extent.

    That is what the caster promises: the answers of a mesh whose points are moved by that much.
    """
    corners = vertices[faces]
    crossings = first_crossings(origins, directions, corners)
    normal = np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])
    cosine = np.abs(directions @ normal) / np.linalg.norm(directions, axis=1)
    scale = cosine / np.linalg.norm(normal) / np.ptp(vertices, axis=0).max()
    caster = rays.RayCaster(vertices, faces)
    return Trial(
        naive=lambda: moller_trumbore(vertices, faces, origins, directions),
        ours=lambda: caster.first_hit_m(origins, directions),
        truth=_distances_m(crossings, directions),
        error=lambda answer, exact: max(
            max_abs(a, t) * s for a, t, s in zip(answer, exact, scale.tolist(), strict=True)
        ),
    )


def grazing(angle_rad: float) -> Trial:
    """Rays that come down on a 10 m floor at a small angle."""
    rng = np.random.default_rng(4)
    heading = rng.uniform(0.0, 2.0 * np.pi, N_RAYS)
    flat = np.stack([np.cos(heading), np.sin(heading), np.full(N_RAYS, -np.tan(angle_rad))], axis=1)
    height_m = 3.0 * np.tan(angle_rad)  # met 3 m away
    origins = np.column_stack([rng.uniform(-1.0, 1.0, (N_RAYS, 2)), np.full(N_RAYS, height_m)])
    return hits(FLOOR @ TURN.T, np.array([[0, 1, 2], [0, 2, 3]]), origins @ TURN.T, flat @ TURN.T)


def from_a_surface() -> Trial:
    """Rays that start on a wall and look into the room: what they see is the wall opposite.

    The start itself may count, so a distance of 0 is right as well.
    """
    room = trimesh.creation.box((2.0, 2.0, 2.0))
    opposite = room.faces[room.face_normals[:, 0] < -0.5]
    vertices, faces = room.vertices @ TURN.T, np.asarray(room.faces, np.int64)
    rng = np.random.default_rng(5)
    starts, ends = (
        np.column_stack([np.full(N_RAYS, x), rng.uniform(-0.9, 0.9, (N_RAYS, 2))]) @ TURN.T
        for x in (1.0, -1.0)
    )
    crossings = first_crossings(starts, ends - starts, vertices[opposite])
    caster = rays.RayCaster(vertices, faces)
    return Trial(
        naive=lambda: moller_trumbore(vertices, faces, starts, ends - starts),
        ours=lambda: caster.first_hit_m(starts, ends - starts),
        truth=_distances_m(crossings, ends - starts),
        error=_off_start_or_far_side,
    )


def far_away(offset_m: float) -> Trial:
    """A box of 1.3 m a long way from the origin, seen from its middle."""
    box = trimesh.creation.box((1.3, 1.3, 1.3))
    centre_m = offset_m * np.array([1.00001, -0.70003, 0.30007])
    rng = np.random.default_rng(6)
    # Into one side only, so that one plane is met.
    directions = np.column_stack([np.ones(N_RAYS), rng.uniform(-0.8, 0.8, (N_RAYS, 2))])
    faces = np.asarray(box.faces, np.int64)
    faces = faces[np.argsort(-box.face_normals[:, 0], kind="stable")]
    origins = np.tile(centre_m, (N_RAYS, 1))
    return hits(np.asarray(box.vertices) + centre_m, faces, origins, directions)


def sliver_wall() -> trimesh.Trimesh:
    """A closed metre cube, one side of it cut into triangles a metre long and a micrometre wide."""
    cube = trimesh.creation.box((1.0, 1.0, 1.0))
    y = np.append(np.linspace(-0.5, -0.4999, N_SLIVERS), 0.5)
    low, high = (
        np.column_stack([np.full_like(y, 0.5), y, np.full_like(y, z)]) for z in (-0.5, 0.5)
    )
    k, up = np.arange(len(y) - 1), 8 + len(y)
    strips = [
        np.stack([8 + k, 9 + k, up + k], axis=1),
        np.stack([9 + k, up + 1 + k, up + k], axis=1),
    ]
    others = cube.faces[cube.face_normals[:, 0] < 0.5]
    return trimesh.Trimesh(
        np.vstack([cube.vertices, low, high]), np.vstack([others, *strips]), process=False
    )


def moller_trumbore(vertices: Array, faces: Faces, origins: Array, directions: Array) -> Array:
    """The textbook test, in float32 as on a graphics card: distances (N,), ``inf`` for none."""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    corners, start, way = (x.astype(np.float32) for x in (vertices[faces], origins, unit))
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    nearest = np.full(len(origins), np.inf, np.float32)
    for corner, a, b in zip(corners[:, 0], first, second, strict=True):
        across, offset = np.cross(way, b), start - corner
        determinant = across @ a
        beside = np.cross(offset, a)
        u = (offset * across).sum(axis=1) / determinant
        v = (way * beside).sum(axis=1) / determinant
        distance = beside @ b / determinant
        met = (np.abs(determinant) > PARALLEL) & (u >= 0) & (v >= 0) & (u + v <= 1)
        met &= distance > 0
        nearest = np.where(met, np.minimum(nearest, distance), nearest)
    return np.asarray(nearest, dtype=np.float64)


def _distances_m(crossings: Sequence[Fraction | None], directions: Array) -> list[Any]:
    return [
        math.inf if crossing is None else distance_m(crossing, direction)
        for crossing, direction in zip(crossings, directions, strict=True)
    ]


def _off_start_or_far_side(answer: Array, truth: Sequence[Any]) -> float:
    """Largest distance from 0 or the far side, whichever is nearer, as a share of the 2 m room."""
    pairs = zip(answer.tolist(), truth, strict=True)
    return max(float(min(abs(a), max_abs(a, t))) for a, t in pairs) / 2.0


def _ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=2)


_RAYS = partial(
    Case, "ray casting", naive="Möller-Trumbore in float32", ours="RayCaster.first_hit_m"
)
_LEAKS = partial(
    _RAYS,
    quantity="rays out of a closed surface",
    unit="share",
    reference="the surface is closed",
    bound=0.0,
)
_HITS = partial(
    _RAYS, quantity="hit off its plane", unit="of the extent", reference=RATIONAL, bound=1e-6
)

CASES = (
    _LEAKS("through corners", trial=lambda: leaks(_ball(), True)),
    _LEAKS("through edges", trial=lambda: leaks(_ball(), False)),
    _LEAKS("slivers of 1 m by 1 µm", trial=lambda: leaks(sliver_wall(), False)),
    _HITS("grazing, 1e-3 rad", trial=partial(grazing, 1e-3)),
    _HITS("grazing, 1e-5 rad", trial=partial(grazing, 1e-5)),
    _HITS("from a surface", trial=from_a_surface),
    _HITS("1e5 m from the origin", trial=partial(far_away, 1e5)),
)
