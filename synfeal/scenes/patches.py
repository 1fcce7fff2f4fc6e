"""Patches: the one element of a procedural scene, a grid of points with a picture on it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from synfeal.scenes.canvas import Canvas, Painter, Pixels

Points = NDArray[np.float64]
Real = TypeVar("Real", np.float32, np.float64)


@dataclass(frozen=True)
class Patch:
    """A grid of points seen from its front: rows run down, columns run to the right.

    Attributes:
        points_m: (R, C, 3) metres.
        picture: (H, W, 3) albedo that is stretched over the grid, proportional to length.
        glow: 0 for a surface that only reflects light, 1 for one that shines by itself.
    """

    points_m: Points
    picture: Pixels
    glow: float = 0.0

    @property
    def row_shares(self) -> NDArray[np.float64]:
        """Where each row lies on the picture, from 0 (top) to 1."""
        return _shares(self.points_m)

    @property
    def column_shares(self) -> NDArray[np.float64]:
        """Where each column lies on the picture, from 0 (left) to 1."""
        return _shares(self.points_m.swapaxes(0, 1))

    def sample(self, spacing_m: float) -> tuple[Points, Points]:
        """Points and unit normals (A, B, 3) about every ``spacing_m``, the rim included."""
        height_m, width_m = extent_m(self.points_m)
        rows = np.linspace(0, 1, int(np.ceil(height_m / spacing_m)) + 1)
        columns = np.linspace(0, 1, int(np.ceil(width_m / spacing_m)) + 1)
        row_at = np.interp(rows, self.row_shares, np.arange(len(self.points_m)))
        column_at = np.interp(columns, self.column_shares, np.arange(self.points_m.shape[1]))
        normals = bilinear(_normals(self.points_m), row_at, column_at)
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
        return bilinear(self.points_m, row_at, column_at), normals


def _shares(points: Points) -> NDArray[np.float64]:
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1).mean(axis=1)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum(), np.float64)


def _normals(points: Points) -> Points:
    down, right = np.gradient(points, axis=0), np.gradient(points, axis=1)
    return np.cross(down, right)


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
    """A patch whose picture has ``px_per_m`` texels per metre of surface, at least 4 a side."""
    height_m, width_m = extent_m(points_m)
    canvas = Canvas(
        rng, max(4, round(height_m * px_per_m)), max(4, round(width_m * px_per_m)), px_per_m
    )
    picture = np.clip(painter(canvas), 0, 1).astype(np.float32)
    return Patch(np.asarray(points_m, np.float64), picture, glow)


@dataclass(frozen=True)
class Block:
    """A box that casts shadows: centre and half sides in metres, turned about z by ``yaw_rad``."""

    centre_m: NDArray[np.float64]
    half_m: NDArray[np.float64]
    yaw_rad: float = 0.0


@dataclass(frozen=True)
class Item:
    """A thing in a room: its patches and the blocks that stand for it when shadows are cast."""

    patches: tuple[Patch, ...]
    blocks: tuple[Block, ...] = ()

    def placed(self, x_m: float, y_m: float, z_m: float = 0.0, yaw_deg: float = 0.0) -> Item:
        """The item turned about z, then moved."""
        yaw = np.radians(yaw_deg)
        cos, sin = np.cos(yaw), np.sin(yaw)
        world_from_item = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        offset = np.array([x_m, y_m, z_m])
        patches = tuple(
            replace(patch, points_m=patch.points_m @ world_from_item.T + offset)
            for patch in self.patches
        )
        blocks = tuple(
            Block(world_from_item @ block.centre_m + offset, block.half_m, block.yaw_rad + yaw)
            for block in self.blocks
        )
        return Item(patches, blocks)

    def clipped(self, lower_m: tuple[float, ...], upper_m: tuple[float, ...]) -> Item:
        """The item pressed flat where it would stick out of a box, as leaves are by a wall."""
        patches = tuple(
            replace(patch, points_m=np.clip(patch.points_m, lower_m, upper_m))
            for patch in self.patches
        )
        return Item(patches, self.blocks)


def joined(items: Iterable[Item]) -> Item:
    """Several items as one."""
    everything = list(items)
    return Item(
        tuple(patch for item in everything for patch in item.patches),
        tuple(block for item in everything for block in item.blocks),
    )
