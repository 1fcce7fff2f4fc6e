"""The vertical of a fused surface: rooms are made of level planes and plumb ones.

Floor, tables and ceiling have normals along gravity, walls across it. The direction that most of
the surface agrees with in this way is up; of the several that a box-shaped room offers, the one
nearest to the upper edge of the photographs is taken, for people hold cameras more or less upright.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.scanning.fusion import FusedSurface

Array = NDArray[np.float64]
SAMPLES = 30_000
# How far up may be from the mean upper edge of the photographs, and how closely directions are
# tried; windows in which normals count as level or plumb, narrower with each refinement.
MOST_TILT_DEG, STEP_DEG = 50.0, 1.5
WINDOWS_DEG = (8.0, 5.0, 3.0, 2.0, 2.0, 2.0)
# Least length of the mean of the upper edges of photographs that are held upright.
LEAST_EDGE = 0.3
# Share of the surface that must be level or plumb within the last window (of normals spread evenly
# over all directions 3.6 % are), and share that must hold up where it is: level planes do, and the
# lesser of two walls, but one wall leaves the rotation about its normal free.
MIN_AGREEING, MIN_HOLDING = 0.12, 0.02
REMEDY = (
    "give `gravity=(X, Y, Z)`, the way things fall in the world of the poses, or `keep_axes=True`"
)


class GravityError(InputError):
    """Neither the surface nor the photographs tell which way is up."""


@dataclass(frozen=True)
class Gravity:
    """The direction up, and how much of the surface supports it.

    Attributes:
        up: Unit vector (3,) in the world of the sequence.
        level: Share of the surface that is level within two degrees.
        plumb: Share of it that is plumb within two degrees.
    """

    up: Array
    level: float
    plumb: float


def find_gravity(surface: FusedSurface, world_from_cam: Array) -> Gravity:
    """Find the way up from the planes of a surface.

    Args:
        surface: In the world of the poses.
        world_from_cam: Poses (N, 4, 4) of the photographs, held upright in the mean.

    Raises:
        GravityError: The surface has no planes that tell, or the photographs no upper edge.
    """
    guess = -world_from_cam[:, :3, 1].mean(axis=0)
    if np.linalg.norm(guess) < LEAST_EDGE:
        raise GravityError(
            "scan", "the photographs are turned all ways, so up is not known", REMEDY
        )
    guess /= np.linalg.norm(guess)
    normals = area_weighted_normals(surface, SAMPLES)
    tried = _directions_near(guess)
    window = np.sin(np.deg2rad(WINDOWS_DEG[0]))
    cosine = np.abs(tried.astype(np.float32) @ normals.T.astype(np.float32))
    # A level plane is worth more than a plumb one: chance normals are plumb 14 times as often.
    level = (cosine > np.cos(np.deg2rad(WINDOWS_DEG[0]))).mean(axis=1)
    plumb = (cosine < window).mean(axis=1)
    up = tried[int(np.argmax(2.0 * level + plumb))]
    holding = 0.0
    for degrees in WINDOWS_DEG:
        up, holding = _refined(up, normals, np.deg2rad(degrees))
    cosine = np.abs(normals @ up)
    last = np.deg2rad(WINDOWS_DEG[-1])
    found = Gravity(
        up=up,
        level=float((cosine > np.cos(last)).mean()),
        plumb=float((cosine < np.sin(last)).mean()),
    )
    if holding < MIN_HOLDING or found.level + found.plumb < MIN_AGREEING:
        raise GravityError(
            "scan",
            f"no gravity found: {found.level:.1%} of the surface is level and {found.plumb:.1%}"
            " plumb at the best",
            REMEDY,
        )
    return found


def likely_up(world_from_cam: Array) -> Array:
    """Return the axis (3,) of the world nearest to the upper edge of the photographs.

    Worlds of captures mostly have one axis along the vertical, up or down. Where photographs are
    turned all ways it is z.

    Args:
        world_from_cam: Poses (N, 4, 4) of the photographs.
    """
    edge = -world_from_cam[:, :3, 1].mean(axis=0)
    if np.linalg.norm(edge) < LEAST_EDGE:
        return np.array([0.0, 0.0, 1.0])
    axis = int(np.abs(edge).argmax())
    return np.asarray(np.sign(edge[axis]) * np.eye(3)[axis])


def area_weighted_normals(surface: FusedSurface, count: int) -> Array:
    """Draw unit normals (count, 3) of triangles in proportion to their area."""
    corners = surface.vertices_m[surface.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_area = np.linalg.norm(normal, axis=1)
    edges = np.cumsum(double_area)
    places = (np.arange(count) + 0.5) / count * edges[-1]
    chosen = np.searchsorted(edges, places).clip(0, len(normal) - 1)
    return np.asarray(normal[chosen] / double_area[chosen, None])


def _directions_near(guess: Array) -> Array:
    """Return unit vectors (N, 3) within ``MOST_TILT_DEG`` of one, evenly ``STEP_DEG`` apart."""
    step, most = np.deg2rad(STEP_DEG), np.deg2rad(MOST_TILT_DEG)
    count = int(np.ceil(2.0 * np.pi * (1.0 - np.cos(most)) / step**2))
    index = np.arange(count) + 0.5
    cosine = 1.0 - index / count * (1.0 - np.cos(most))
    angle = np.pi * (1.0 + np.sqrt(5.0)) * index  # Fibonacci's spiral
    sine = np.sqrt(1.0 - cosine**2)
    across = np.linalg.svd(guess[None])[2][1:]
    return np.asarray(
        cosine[:, None] * guess
        + (sine * np.cos(angle))[:, None] * across[0]
        + (sine * np.sin(angle))[:, None] * across[1]
    )


def _refined(up: Array, normals: Array, window_rad: float) -> tuple[Array, float]:
    """Find the direction with which normals that are nearly level or plumb agree best.

    Also return the share of normals that fixes it against the turn that changes least.
    """
    cosine = np.abs(normals @ up)
    level = normals[cosine > np.cos(window_rad)]
    plumb = normals[cosine < np.sin(window_rad)]
    # Sum of squared sines of the errors: |n x g|^2 where level, (n . g)^2 where plumb.
    matrix = plumb.T @ plumb - level.T @ level
    value, vector = np.linalg.eigh(matrix / len(normals))
    best = vector[:, 0] if vector[:, 0] @ up > 0 else -vector[:, 0]
    return np.asarray(best), float(value[1] - value[0])


def upright_world(surface: FusedSurface, up: Array) -> Array:
    """Place a world with z up, its floor at 0, its axes along the walls, the scene in its middle.

    Args:
        surface: In the world of the sequence.
        up: Unit vector (3,) in it.

    Returns:
        ``sequence_from_world`` (4, 4).
    """
    normals = area_weighted_normals(surface, SAMPLES)
    x = np.linalg.svd(up[None])[2][1]
    rotation = np.stack([x, np.cross(up, x), up])  # world_from_sequence
    turned = normals @ rotation.T
    flat = turned[np.abs(turned[:, 2]) < np.sin(np.deg2rad(WINDOWS_DEG[0]))]
    if len(flat):
        # Walls repeat every quarter of a turn.
        quarter = np.angle(np.sum(np.exp(4j * np.arctan2(flat[:, 1], flat[:, 0])))) / 4.0
        cos, sin = np.cos(quarter), np.sin(quarter)
        rotation = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    placed = surface.vertices_m @ rotation.T
    low, high = np.percentile(placed, [1.0, 99.0], axis=0)
    origin = np.array([*(low + high)[:2] / 2.0, low[2]])
    return inverse(pose_matrix(rotation, -origin))
