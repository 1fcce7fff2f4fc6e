"""Grids of points for the shapes a room is made of, and boxes and turned shapes as items."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from synfeal.scenes.canvas import Painter
from synfeal.scenes.patches import Item, Patch, Points, paint


def sheet(corners_m: ArrayLike) -> Points:
    """A grid over four corners (4, 3): top left, top right, bottom right, bottom left.

    Left and right are as seen from its front.
    """
    top_left, top_right, bottom_right, bottom_left = np.asarray(corners_m, np.float64)
    return np.array([[top_left, top_right], [bottom_left, bottom_right]])


def upright(
    start_xy: tuple[float, float], end_xy: tuple[float, float], low_m: float, high_m: float,
    end_high_m: float | None = None,
) -> Points:  # fmt: skip
    """A vertical sheet; from its front, ``start_xy`` is on the left and ``end_xy`` on the right."""
    top_right = high_m if end_high_m is None else end_high_m
    corners = [(*start_xy, high_m), (*end_xy, top_right), (*end_xy, low_m), (*start_xy, low_m)]
    return sheet(corners)


def level(
    x_m: tuple[float, float], y_m: tuple[float, float], z_m: float, face_down: bool = False
) -> Points:
    """A horizontal sheet that faces up (a floor) or down (a ceiling)."""
    x0, x1 = x_m[::-1] if face_down else x_m
    y0, y1 = y_m
    return sheet([(x0, y1, z_m), (x1, y1, z_m), (x1, y0, z_m), (x0, y0, z_m)])


def box(
    rng: np.random.Generator, size_m: tuple[float, float, float], painter: Painter, px_per_m: float,
    faces: str = "fblrtu", front: Painter | None = None,
) -> Item:  # fmt: skip
    """A box on z = 0, centred in x and y.

    ``faces`` names those built: front (−y), back, left (−x), right, top, under. ``front`` paints
    the front differently.
    """
    half_x, half_y, high = size_m[0] / 2, size_m[1] / 2, size_m[2]
    sides = {
        "f": upright((-half_x, -half_y), (half_x, -half_y), 0, high),
        "b": upright((half_x, half_y), (-half_x, half_y), 0, high),
        "l": upright((-half_x, half_y), (-half_x, -half_y), 0, high),
        "r": upright((half_x, -half_y), (half_x, half_y), 0, high),
        "t": level((-half_x, half_x), (-half_y, half_y), high),
        "u": level((-half_x, half_x), (-half_y, half_y), 0, face_down=True),
    }
    patches = tuple(
        paint(rng, sides[face], front if face == "f" and front is not None else painter, px_per_m)
        for face in faces
    )
    return Item(patches)


def turned(
    rng: np.random.Generator, profile_m: ArrayLike, painter: Painter, px_per_m: float,
    segments: int = 16,
) -> Item:  # fmt: skip
    """A surface of revolution about z: ``profile_m`` (K, 2) is (radius, z) from top to bottom."""
    profile = np.asarray(profile_m, np.float64)
    angle = np.linspace(-np.pi, np.pi, segments + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = np.concatenate(
        [
            profile[:, None, :1] * ring,
            np.broadcast_to(profile[:, None, 1:], (len(profile), segments + 1, 1)),
        ],
        axis=-1,
    )
    points[:, -1] = points[:, 0]
    return Item((paint(rng, points, painter, px_per_m),))


def tube(
    rng: np.random.Generator, path_m: ArrayLike, radius_m: float, painter: Painter, px_per_m: float,
    segments: int = 8,
) -> Patch:  # fmt: skip
    """A pipe of constant radius along a polyline (K, 3)."""
    path = np.asarray(path_m, np.float64)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    helper = np.eye(3)[np.argmin(np.abs(tangent).max(axis=0))]
    side = np.cross(tangent, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(tangent, side)
    angle = np.linspace(0, 2 * np.pi, segments + 1)[None, :, None]
    points = path[:, None] + radius_m * (
        np.cos(angle) * side[:, None] - np.sin(angle) * other[:, None]
    )
    points[:, -1] = points[:, 0]
    return paint(rng, points, painter, px_per_m)


def on_wall(
    rng: np.random.Generator, centre_m: tuple[float, float, float], yaw_deg: float,
    size_m: tuple[float, float], painter: Painter, px_per_m: float, depth_m: float = 0.02,
    glow: float = 0.0,
) -> Item:  # fmt: skip
    """A flat picture with a thin rim, its back at ``centre_m``; at yaw 0 it faces −y."""
    width, height = size_m
    face = upright((-width / 2, -depth_m), (width / 2, -depth_m), -height / 2, height / 2)
    front = paint(rng, face, painter, px_per_m, glow)
    rim = box(rng, (width, depth_m, height), lambda c: c.plain((0.3, 0.3, 0.3)), 40, "lrtu")
    rim = rim.placed(0, -depth_m / 2, -height / 2)
    return Item((front, *rim.patches)).placed(*centre_m, yaw_deg)
