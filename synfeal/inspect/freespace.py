"""Where a camera can be: the free space of a mesh, and a box in it to sample poses from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.spatial import cKDTree

from synfeal.inspect.largest_box import largest_box
from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

N_POINTS = 30_000
MAX_CELLS = 300  # along one axis
MAX_LAYER_M = 0.3
N_RAYS = 64
MAX_ELEVATION_DEG = 30.0  # as high as cameras look: a scan without a ceiling is a room too
MIN_HITS = 0.7  # an endless plain blocks 2/3 of these rays; a point inside sees more than a floor
NEAR_M = 0.2
CLEARANCE_M = 0.3
CAMERA_HEIGHT_M = (0.8, 2.0)  # hand-held cameras, above the floor
FLOOR_BIN_M = 0.05

DEFINITION = (
    f"A point of a regular grid is free if at least {MIN_HITS:.0%} of {N_RAYS} rays, spread evenly"
    f" over all directions up to {MAX_ELEVATION_DEG:.0f} degrees above the horizon, hit the mesh,"
    f" and most of those that hit are longer than {NEAR_M} m."
)


@dataclass(frozen=True)
class FreeSpace:
    """A regular grid of points in a box, and which of them are free.

    Attributes:
        axes_m: coordinates along x, y and z.
        is_free: (X, Y, Z); see ``DEFINITION``.
        is_clear: (X, Y, Z); the largest connected set of free points at least 0.3 m from any
            surface: the room, not the inside of a cupboard.
        enclosure: median share of rays that hit the mesh, over free points; 1 in a closed room.
        floor_m: height at which most of the clear points find a surface below; None without any.
    """

    axes_m: tuple[Array, Array, Array]
    is_free: Mask
    is_clear: Mask
    enclosure: float
    floor_m: float | None

    @property
    def share(self) -> float:
        """Share of the box that is free."""
        return float(self.is_free.mean())


def find_free_space(caster: RayCaster, surface_m: Array, box_m: Array) -> FreeSpace:
    """The free space in a box.

    Winding cannot tell inside from outside in a scan, which is open; what rays hit can.

    Args:
        caster: rays against the mesh.
        surface_m: (N, 3) points spread densely over the mesh, metres.
        box_m: (2, 3) lower and upper corner of the box to look in, metres.
    """
    axes, step_m = _grid(box_m)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    shape, points = points.shape[:3], points.reshape(-1, 3)
    hits, far_hits = _hit_shares(caster, points)
    is_free = (hits >= MIN_HITS) & (far_hits > hits / 2.0)
    distance_m, _ = cKDTree(surface_m).query(points[is_free])
    is_clear = is_free.copy()
    # A quarter of a step more, by which the suggested box reaches beyond its outermost points.
    is_clear[is_free] = distance_m >= CLEARANCE_M + step_m / 4.0
    is_clear = _largest_piece(is_clear.reshape(shape))
    enclosure = float(np.median(hits[is_free])) if is_free.any() else 0.0
    floor_m = _floor_m(caster, points[is_clear.reshape(-1)])
    return FreeSpace(axes, is_free.reshape(shape), is_clear, enclosure, floor_m)


def suggest_box(space: FreeSpace) -> Array | None:
    """A box (2, 3) at camera heights to sample in: as large as can be while mostly clear.

    None if no clear point lies 0.8 to 2.0 m above the floor.
    """
    if space.floor_m is None:
        return None
    z_m = space.axes_m[2] - space.floor_m
    at_height = (z_m >= CAMERA_HEIGHT_M[0]) & (z_m <= CAMERA_HEIGHT_M[1])
    is_candidate = space.is_clear & at_height
    if not is_candidate.any():
        return None
    lower, upper = largest_box(is_candidate)
    reach_m = [_step(axis) / 4.0 for axis in space.axes_m]
    axes = list(zip(space.axes_m, lower, upper, reach_m, strict=True))
    low = [axis[first] - reach for axis, first, _, reach in axes]
    high = [axis[last] + reach for axis, _, last, reach in axes]
    return np.round(np.array([low, high]), 2)


def viewpoint(space: FreeSpace, box_m: Array | None) -> Array | None:
    """The clear point (3,) nearest to the middle of the box; of the clear space without a box."""
    if not space.is_clear.any():
        return None
    index = np.argwhere(space.is_clear)
    points = np.stack([space.axes_m[i][index[:, i]] for i in range(3)], axis=1)
    middle = points.mean(axis=0) if box_m is None else box_m.mean(axis=0)
    nearest: Array = points[np.argmin(np.linalg.norm(points - middle, axis=1))]
    return nearest


def ray_directions() -> Array:
    """Directions (64, 3) spread evenly, from straight down to the greatest elevation."""
    index = np.arange(N_RAYS) + 0.5
    z = -1.0 + index / N_RAYS * (1.0 + np.sin(np.deg2rad(MAX_ELEVATION_DEG)))
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    radius = np.sqrt(1.0 - z**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def _grid(box_m: Array) -> tuple[tuple[Array, Array, Array], float]:
    """Centres of cells along each axis, and the longest side of a cell.

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


def _step(axis: Array) -> float:
    return float(axis[1] - axis[0]) if len(axis) > 1 else 0.1


def _hit_shares(caster: RayCaster, points: Array) -> tuple[Array, Array]:
    """Shares (N,) of the rays from each point that hit, and that hit beyond 0.2 m."""
    directions = ray_directions()
    hits = np.empty((len(directions), len(points)))
    for row, direction in enumerate(directions):
        hits[row] = caster.first_hit_m(points, np.broadcast_to(direction, points.shape))
    found = np.isfinite(hits)
    return found.mean(axis=0), (found & (hits > NEAR_M)).mean(axis=0)


def _largest_piece(mask: Mask) -> Mask:
    """The largest set of neighbouring points."""
    pieces, count = label(mask)
    if count == 0:
        return mask
    sizes = np.bincount(pieces.ravel())
    sizes[0] = 0
    return np.asarray(pieces == sizes.argmax(), dtype=np.bool_)


def _floor_m(caster: RayCaster, points: Array) -> float | None:
    """Most frequent height of what lies straight below the points."""
    if not len(points):
        return None
    down = caster.first_hit_m(points, np.broadcast_to([0.0, 0.0, -1.0], points.shape))
    heights = points[:, 2] - down
    heights = heights[np.isfinite(heights)]
    if not len(heights):
        return None
    bins, counts = np.unique(np.round(heights / FLOOR_BIN_M), return_counts=True)
    chosen = np.round(heights / FLOOR_BIN_M) == bins[counts.argmax()]
    return float(np.median(heights[chosen]))
