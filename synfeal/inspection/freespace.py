"""Free space of a mesh where a camera can be, and a box in it to sample poses from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import mode

from synfeal.mesh.rays import RayCaster
from synfeal.planning.space import ConnectedSpace, seeing_groups

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

N_POINTS = 30_000
MAX_CELLS = 300  # along one axis
MAX_LAYER_M = 0.3
N_RAYS = 64
MAX_ELEVATION_DEG = 30.0  # as high as cameras look: a scan without a ceiling is a room too
REACH_M = 50.0  # what is farther encloses nobody
MIN_ENCLOSURE = 0.25  # a corner of two walls, all else open
SLACK = 0.25  # by which a point may be less enclosed than the best of the mesh
CLEARANCE_M = 0.3
CAMERA_HEIGHT_M = (0.8, 2.0)  # hand-held cameras, above the floor
FLOOR_BIN_M = 0.05
N_PLACES = 400  # that are tested for seeing each other
N_HUBS = 100  # places from which the rest of their space is told
LEAST_GROUP = 0.2  # share of the places: smaller groups are nooks and insides of things
LEAST_FLOOR = 0.15  # share of a space's places to stand
FLOORS_APART_M = 0.5

DEFINITION = (
    f"Of {N_RAYS} rays from a point, spread evenly from level to {MAX_ELEVATION_DEG:.0f} degrees"
    f" above, the share that hit the mesh within {REACH_M:.0f} m is how enclosed it is. Free points"
    " of a regular grid are about as enclosed as the best places to stand in the mesh and can be"
    " seen from the largest group of such places that see each other: neither inside walls, slabs"
    " and cupboards nor outside."
)


@dataclass(frozen=True)
class Survey:
    """Measurements by rays at a regular grid of points in a box; nothing is decided yet."""

    axes_m: tuple[Array, Array, Array]  # coordinates along x, y and z
    points_m: Array  # (N, 3) all points, x slowest
    enclosure: Array  # (N,) share of the rays that hit the mesh
    is_clear: Mask  # (N,) at least 0.3 m from any surface
    is_stand: Mask  # (N,) clear, and 0.8 to 2.0 m above what lies straight below


@dataclass(frozen=True)
class FreeSpace:
    """A regular grid of points in a box, and which of them are free."""

    axes_m: tuple[Array, Array, Array]  # coordinates along x, y and z
    is_free: Mask  # (X, Y, Z); see ``DEFINITION``
    is_clear: Mask  # (X, Y, Z); free points at least 0.3 m from any surface
    enclosure: float  # median over free points; 1 in a closed room
    # height at which most of the places to stand find a surface below; None without any
    floor_m: float | None
    # places to stand as enclosed as these that cannot be seen from here, as a share of all of them:
    # other floors, other rooms
    elsewhere: float = 0.0
    # heights at which many of the places to stand find a surface below, the most frequent first
    floors_m: tuple[float, ...] = ()

    @property
    def share(self) -> float:
        """Share of the box that is free."""
        return float(self.is_free.mean())

    @property
    def clear_m(self) -> Array:
        """The clear points (N, 3)."""
        return np.stack(np.meshgrid(*self.axes_m, indexing="ij"), axis=-1)[self.is_clear]


def survey(caster: RayCaster, surface_m: Array, box_m: Array) -> Survey:
    """Cast rays from a grid of points in a box, to tell inside from outside.

    Winding cannot tell that in a scan, which is open; what rays hit can.

    Args:
        caster: Rays against the mesh.
        surface_m: Points (N, 3) spread densely over the mesh, world, metres.
        box_m: Lower and upper corner (2, 3) of the box, world, metres.
    """
    axes, step_m = _grid(box_m)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    directions = (np.broadcast_to(way, points.shape) for way in ray_directions())
    hits = sum(caster.first_hit_m(points, way) <= REACH_M for way in directions)
    enclosure = np.asarray(hits / N_RAYS)
    is_clear = enclosure >= MIN_ENCLOSURE
    distance_m, _ = cKDTree(surface_m).query(points[is_clear])
    # A quarter of a step more, by which the suggested box reaches beyond its outermost points.
    is_clear[is_clear] = distance_m >= CLEARANCE_M + step_m / 4.0
    is_stand = is_clear.copy()
    height_m = points[is_clear, 2] - _floors_m(caster, points[is_clear])
    half_m = step_m_of(axes[2]) / 2.0
    low, high = CAMERA_HEIGHT_M
    is_stand[is_clear] = (height_m >= low - half_m) & (height_m <= high + half_m)
    return Survey(axes, points, enclosure, is_clear, is_stand)


def find_free_space(caster: RayCaster, found: Survey, slack: float = SLACK) -> FreeSpace:
    """Find the largest space in which cameras see each other; see :func:`find_free_spaces`."""
    return find_free_spaces(caster, found, slack)[0]


def find_free_spaces(caster: RayCaster, found: Survey, slack: float = SLACK) -> list[FreeSpace]:
    """Find the spaces in which cameras see each other; see ``DEFINITION``.

    Args:
        caster: Rays against the mesh.
        found: What rays tell of a grid of points.
        slack: By how much less enclosed a point may be than the best places to stand.

    Returns:
        Spaces that hold at least a fifth of the places to stand, the largest first; an empty one
        where there is no place to stand.
    """
    if not found.is_stand.any():
        nothing = np.zeros(tuple(len(axis) for axis in found.axes_m), dtype=np.bool_)
        return [FreeSpace(found.axes_m, nothing, nothing, 0.0, None)]
    best = float(np.quantile(found.enclosure[found.is_stand], 0.95))
    is_enclosed = found.enclosure >= max(best - slack, MIN_ENCLOSURE)
    # Some of the places, in groups that see each other.
    stands_m = found.points_m[found.is_stand & is_enclosed]
    places_m = np.random.default_rng(0).permutation(stands_m)[:N_PLACES]
    group = seeing_groups(caster, places_m)
    counts = np.bincount(group)
    by_size = np.argsort(-counts, kind="stable")
    large = [index for index in by_size if counts[index] >= LEAST_GROUP * len(places_m)]
    large = large or [by_size[0]]
    elsewhere = 1.0 - sum(int(counts[index]) for index in large) / len(places_m)
    return [
        _space_seen_from(caster, found, is_enclosed, places_m[group == index], elsewhere)
        for index in large
    ]


def _space_seen_from(
    caster: RayCaster, found: Survey, is_enclosed: Mask, places_m: Array, elsewhere: float
) -> FreeSpace:
    """Survey the space of one group of places (P, 3); ``elsewhere`` are those of no group."""
    shape = tuple(len(axis) for axis in found.axes_m)
    is_free = is_enclosed.copy()
    space = ConnectedSpace(caster, places_m[:N_HUBS])
    is_free[is_enclosed] = space.contains(found.points_m[is_enclosed])
    floors_m = _frequent(_floors_m(caster, found.points_m[is_free & found.is_stand]))
    return FreeSpace(
        axes_m=found.axes_m,
        is_free=is_free.reshape(shape),
        is_clear=(is_free & found.is_clear).reshape(shape),
        enclosure=float(np.median(found.enclosure[is_free])),
        floor_m=floors_m[0] if floors_m else None,
        elsewhere=elsewhere,
        floors_m=floors_m,
    )


def together(spaces: Sequence[FreeSpace]) -> FreeSpace:
    """Return the free points of several spaces as one; all else is that of the first, largest."""
    return replace(
        spaces[0],
        is_free=np.logical_or.reduce([space.is_free for space in spaces]),
        is_clear=np.logical_or.reduce([space.is_clear for space in spaces]),
    )


def viewpoint(space: FreeSpace, box_m: Array | None) -> Array | None:
    """Find the clear point (3,) nearest to the centre of the box, or of the clear space."""
    points = space.clear_m
    if not len(points):
        return None
    middle = points.mean(axis=0) if box_m is None else box_m.mean(axis=0)
    return np.asarray(points[np.argmin(np.linalg.norm(points - middle, axis=1))])


def ray_directions() -> Array:
    """Return directions (64, 3) spread evenly, from level to the greatest elevation."""
    index = np.arange(N_RAYS) + 0.5
    z = index / N_RAYS * np.sin(np.deg2rad(MAX_ELEVATION_DEG))
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    radius = np.sqrt(1.0 - z**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def _grid(box_m: Array) -> tuple[tuple[Array, Array, Array], float]:
    """Return the centres of cells along each axis, and the longest side of a cell, metres.

    Cells are cubes unless those would leave too few layers at camera heights; then they are wider.
    """
    extents = np.maximum(box_m[1] - box_m[0], 1e-6)
    height = min(float(np.prod(extents) / N_POINTS) ** (1.0 / 3.0), MAX_LAYER_M)
    width = np.sqrt(np.prod(extents) / N_POINTS / height)
    counts = np.clip(np.round(extents / [width, width, height]), 1, MAX_CELLS).astype(np.int64)
    x, y, z = (
        low + (np.arange(count) + 0.5) * extent / count
        for low, count, extent in zip(box_m[0], counts, extents, strict=True)
    )
    return (x, y, z), float(np.max(extents / counts))


def step_m_of(axis: Array) -> float:
    """Return the distance of neighbouring points along an axis of a grid, metres."""
    return float(axis[1] - axis[0]) if len(axis) > 1 else 0.1


def _floors_m(caster: RayCaster, points: Array) -> Array:
    """Return the height (N,) of the surface straight below points (N, 3); -inf where none is."""
    return points[:, 2] - caster.first_hit_m(
        points, np.broadcast_to([0.0, 0.0, -1.0], points.shape)
    )


def _frequent(heights_m: Array) -> tuple[float, ...]:
    """Find heights that many of the heights (N,) are near, the most frequent first, metres."""
    heights_m = heights_m[np.isfinite(heights_m)]
    least = LEAST_FLOOR * len(heights_m)
    found: list[float] = []
    while len(heights_m):
        bins = np.round(heights_m / FLOOR_BIN_M)
        floor_m = float(np.median(heights_m[bins == mode(bins).mode]))
        is_near = np.abs(heights_m - floor_m) < FLOORS_APART_M
        if found and is_near.sum() < least:
            break
        found.append(floor_m)
        heights_m = heights_m[~is_near]
    return tuple(found)
