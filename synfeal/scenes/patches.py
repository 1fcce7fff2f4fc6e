"""Patches: the one element of a procedural scene, a grid of points with a picture on it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from synfeal.scenes.canvas import Canvas, Painter

Points = NDArray[np.float64]
Real = TypeVar("Real", np.float32, np.float64)

DETAIL = 2.6  # texels per metre over what a painter is asked for; 0.5 m at 640 px shows 1,100 px/m
GRAIN = 0.012  # relative brightness of what is too small to be painted
GRAIN_M = 0.006


@dataclass(frozen=True)
class Patch:
    """A grid of points seen from its front: rows run down, columns run to the right.

    Attributes:
        points_m: (R, C, 3) metres.
        picture: (H, W, 3) uint8 albedo that is stretched over the grid, proportional to length.
        glow: 0 for a surface that only reflects light, 1 for one that shines by itself.
    """

    points_m: Points
    picture: NDArray[np.uint8]
    glow: float = 0.0

    @property
    def row_shares(self) -> NDArray[np.float64]:
        """Where each row lies on the picture, from 0 (top) to 1."""
        return _shares(self.points_m)

    @property
    def column_shares(self) -> NDArray[np.float64]:
        """Where each column lies on the picture, from 0 (left) to 1."""
        return _shares(self.points_m.swapaxes(0, 1))


def _shares(points: Points) -> NDArray[np.float64]:
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1).mean(axis=1)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum(), np.float64)


def bilinear(
    grid: NDArray[Real], row_at: NDArray[np.float64], column_at: NDArray[np.float64]
) -> NDArray[Real]:
    """Values of a (R, C, K) grid at fractional row and column indices, as (A, B, K)."""
    top = np.clip(np.floor(row_at).astype(np.int64), 0, grid.shape[0] - 2)
    left = np.clip(np.floor(column_at).astype(np.int64), 0, grid.shape[1] - 2)
    below = (row_at - top)[:, None, None].astype(grid.dtype)
    beside = (column_at - left)[None, :, None].astype(grid.dtype)
    rows = grid[top] * (1 - below) + grid[top + 1] * below
    mixed = rows[:, left] * (1 - beside) + rows[:, left + 1] * beside
    return mixed.astype(grid.dtype, copy=False)


def extent_m(points: Points) -> tuple[float, float]:
    """Height and width of a grid along its surface: mean length of its columns and of its rows."""
    height = np.linalg.norm(np.diff(points, axis=0), axis=-1).sum(axis=0).mean()
    width = np.linalg.norm(np.diff(points, axis=1), axis=-1).sum(axis=1).mean()
    return float(height), float(width)


def paint(
    rng: np.random.Generator, points_m: Points, painter: Painter, px_per_m: float, glow: float = 0.0
) -> Patch:
    """A patch whose picture has ``DETAIL * px_per_m`` texels per metre, at least 4 a side.

    Whatever the painter draws gets a fine grain, so that no surface is flat from nearby.
    """
    scale = DETAIL * px_per_m
    height_m, width_m = extent_m(points_m)
    canvas = Canvas(rng, max(4, round(height_m * scale)), max(4, round(width_m * scale)), scale)
    picture = painter(canvas)
    if not glow:
        picture = picture * (1 + np.float32(GRAIN) * canvas.noise(GRAIN_M, 2))[..., None]
    quantised = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    return Patch(np.asarray(points_m, np.float64), quantised, glow)


@dataclass(frozen=True)
class Item:
    """A thing in a room: its patches."""

    patches: tuple[Patch, ...]

    def placed(self, x_m: float, y_m: float, z_m: float = 0.0, yaw_deg: float = 0.0) -> Item:
        """The item turned about z, then moved."""
        yaw = np.radians(yaw_deg)
        cos, sin = np.cos(yaw), np.sin(yaw)
        world_from_item = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        offset = np.array([x_m, y_m, z_m])
        return Item(
            tuple(
                replace(patch, points_m=patch.points_m @ world_from_item.T + offset)
                for patch in self.patches
            )
        )

    def clipped(self, lower_m: tuple[float, ...], upper_m: tuple[float, ...]) -> Item:
        """The item pressed flat where it would stick out of a box, as leaves are by a wall."""
        return Item(
            tuple(
                replace(patch, points_m=np.clip(patch.points_m, lower_m, upper_m))
                for patch in self.patches
            )
        )


def joined(items: Iterable[Item]) -> Item:
    """Several items as one."""
    return Item(tuple(patch for item in items for patch in item.patches))
