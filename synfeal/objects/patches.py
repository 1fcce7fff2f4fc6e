"""Patches, the one element of procedural scenes: grids of points with a picture on each.

Then grids for the shapes a room is made of, and boxes, turned shapes and pipes as items.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synfeal.objects.canvas import Canvas, Painter

Points = NDArray[np.float64]
Real = TypeVar("Real", np.float32, np.float64)

DETAIL = 2.6  # texels per metre over what a painter is asked for; 0.5 m at 640 px shows 1,100 px/m
GRAIN = 0.012  # relative brightness of what is too small to be painted
GRAIN_M = 0.006


@dataclass(frozen=True)
class Patch:
    """A grid of points seen from its front: rows run down, columns run to the right."""

    points_m: Points  # (R, C, 3) metres
    # (H, W, 3) uint8 albedo that is stretched over the grid, proportional to length
    picture: NDArray[np.uint8]
    glow: float = 0.0  # 0 for a surface that only reflects light, 1 for one that shines by itself

    @property
    def row_shares(self) -> NDArray[np.float64]:
        """Return the position of each row on the picture, from 0 (top) to 1."""
        return _shares(self.points_m)

    @property
    def column_shares(self) -> NDArray[np.float64]:
        """Return the position of each column on the picture, from 0 (left) to 1."""
        return _shares(self.points_m.swapaxes(0, 1))


def _shares(points: Points) -> NDArray[np.float64]:
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1).mean(axis=1)
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum(), np.float64)


def bilinear(
    grid: NDArray[Real], row_at: NDArray[np.float64], column_at: NDArray[np.float64]
) -> NDArray[Real]:
    """Interpolate a grid bilinearly at every combination of some rows and columns.

    Args:
        grid: Values (R, C, K), at least 2 x 2.
        row_at: Fractional indices (A,) of rows.
        column_at: Fractional indices (B,) of columns.

    Returns:
        Values (A, B, K).
    """
    top = np.clip(np.floor(row_at).astype(np.int64), 0, grid.shape[0] - 2)
    left = np.clip(np.floor(column_at).astype(np.int64), 0, grid.shape[1] - 2)
    below = (row_at - top)[:, None, None].astype(grid.dtype)
    beside = (column_at - left)[None, :, None].astype(grid.dtype)
    rows = grid[top] * (1 - below) + grid[top + 1] * below
    mixed = rows[:, left] * (1 - beside) + rows[:, left + 1] * beside
    return mixed.astype(grid.dtype, copy=False)


@dataclass(frozen=True)
class Item:
    """A thing in a room: its patches."""

    patches: tuple[Patch, ...]

    def placed(self, x_m: float, y_m: float, z_m: float = 0.0, yaw_deg: float = 0.0) -> Item:
        """Return the item turned about z, then moved.

        Args:
            x_m: Shift along x, metres.
            y_m: Shift along y, metres.
            z_m: Shift along z, metres.
            yaw_deg: Turn in degrees, counter-clockwise as seen from above.
        """
        yaw = np.radians(yaw_deg)
        cos, sin = np.cos(yaw), np.sin(yaw)
        world_from_item = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        offset = np.array([x_m, y_m, z_m])
        return self._with(lambda points_m: points_m @ world_from_item.T + offset)

    def clipped(self, lower_m: tuple[float, ...], upper_m: tuple[float, ...]) -> Item:
        """Press the item flat where it would stick out of a box, as a wall does with leaves."""
        return self._with(lambda points_m: np.clip(points_m, lower_m, upper_m))

    def _with(self, moved: Callable[[Points], Points]) -> Item:
        return Item(tuple(replace(p, points_m=moved(p.points_m)) for p in self.patches))


def joined(*things: Item | Iterable[Item]) -> Item:
    """Join several items into one, in their order."""
    items = (each for thing in things for each in ([thing] if isinstance(thing, Item) else thing))
    return Item(tuple(patch for item in items for patch in item.patches))


def upright(
    start_xy: tuple[float, float], end_xy: tuple[float, float], low_m: float, high_m: float
) -> Points:
    """Return the corners of a vertical sheet, as a grid of points.

    Args:
        start_xy: End of the sheet that is on the left as seen from its front, metres.
        end_xy: End that is on the right, metres.
        low_m: Height of the lower edge, metres.
        high_m: Height of the upper edge, metres.

    Returns:
        Points (2, 2, 3), the upper edge first.
    """
    rows = [[(*start_xy, z), (*end_xy, z)] for z in (high_m, low_m)]
    return np.array(rows, np.float64)


def level(
    x_m: tuple[float, float], y_m: tuple[float, float], z_m: float, face_down: bool = False
) -> Points:
    """Return the corners of a horizontal sheet, as a grid of points.

    Args:
        x_m: Least and greatest x, metres.
        y_m: Least and greatest y, metres.
        z_m: Height, metres.
        face_down: Face down, as a ceiling; otherwise up, as a floor.

    Returns:
        Points (2, 2, 3).
    """
    x0, x1 = x_m[::-1] if face_down else x_m
    return np.array([[(x0, y, z_m), (x1, y, z_m)] for y in y_m[::-1]], np.float64)


@dataclass(frozen=True)
class Maker:
    """The shapes that rooms are made of, each painted with the next numbers of a generator."""

    rng: np.random.Generator

    def sheet(self, points_m: Points, painter: Painter, px_per_m: float, glow: float = 0.0) -> Item:
        """Make a sheet: a grid of points with a picture on it.

        Whatever the painter draws gets a fine grain, so that no surface is flat from nearby.

        Args:
            points_m: Grid (R, C, 3), first row at the top of the picture.
            painter: Paints the picture.
            px_per_m: Texels per metre, before ``DETAIL``; the picture has at least 4 a side.
            glow: 0 if it only reflects light, 1 if it shines by itself.
        """
        scale = DETAIL * px_per_m
        down_m = np.linalg.norm(np.diff(points_m, axis=0), axis=-1).sum(axis=0).mean()
        across_m = np.linalg.norm(np.diff(points_m, axis=1), axis=-1).sum(axis=1).mean()
        height_px, width_px = (max(4, round(float(m) * scale)) for m in (down_m, across_m))
        canvas = Canvas(self.rng, height_px, width_px, scale)
        picture = painter(canvas)
        if not glow:
            picture = picture * (1 + np.float32(GRAIN) * canvas.noise(GRAIN_M, 2))[..., None]
        quantised = np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
        return Item((Patch(np.asarray(points_m, np.float64), quantised, glow),))

    def box(
        self,
        size_m: tuple[float, float, float],
        painter: Painter,
        px_per_m: float,
        faces: str = "fblrtu",
        front: Painter | None = None,
    ) -> Item:
        """Make a box on z = 0, centred in x and y.

        ``faces`` names those built: front (−y), back, left (−x), right, top, under. ``front``
        paints the front differently.

        Args:
            size_m: Extents along x, y and z.
            painter: Paints the faces.
            px_per_m: Texels per metre, before ``DETAIL``.
            faces: Letters of the faces to build.
            front: Paints the front; None for ``painter``.
        """
        x, y, high = size_m[0] / 2, size_m[1] / 2, size_m[2]
        sides = {
            "f": upright((-x, -y), (x, -y), 0, high),
            "b": upright((x, y), (-x, y), 0, high),
            "l": upright((-x, y), (-x, -y), 0, high),
            "r": upright((x, -y), (x, y), 0, high),
            "t": level((-x, x), (-y, y), high),
            "u": level((-x, x), (-y, y), 0, face_down=True),
        }
        painters = {"f": front or painter}
        return joined(self.sheet(sides[f], painters.get(f, painter), px_per_m) for f in faces)

    def turned(
        self, profile_m: ArrayLike, painter: Painter, px_per_m: float, segments: int = 16
    ) -> Item:
        """Make a surface of revolution about z.

        Args:
            profile_m: Radius and z (K, 2), from top to bottom.
            painter: Paints the surface.
            px_per_m: Texels per metre, before ``DETAIL``.
            segments: Number of flat sides around the axis.
        """
        profile = np.asarray(profile_m, np.float64)
        angle = np.linspace(-np.pi, np.pi, segments + 1)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        height = np.broadcast_to(profile[:, None, 1:], (len(profile), segments + 1, 1))
        points = np.concatenate([profile[:, None, :1] * ring, height], axis=-1)
        points[:, -1] = points[:, 0]
        return self.sheet(points, painter, px_per_m)

    def tube(
        self,
        path_m: ArrayLike,
        radius_m: float,
        painter: Painter,
        px_per_m: float,
        segments: int = 8,
    ) -> Item:
        """Make a pipe along a polyline.

        Args:
            path_m: Points (K, 3) of its axis.
            radius_m: Radius of the pipe.
            painter: Paints the surface.
            px_per_m: Texels per metre, before ``DETAIL``.
            segments: Number of flat sides around the axis.
        """
        path = np.asarray(path_m, np.float64)
        tangent = np.gradient(path, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        helper = np.eye(3)[np.argmin(np.abs(tangent).max(axis=0))]
        side = np.cross(tangent, helper)
        side /= np.linalg.norm(side, axis=1, keepdims=True)
        other = np.cross(tangent, side)
        angle = np.linspace(0, 2 * np.pi, segments + 1)[None, :, None]
        ring = np.cos(angle) * side[:, None] - np.sin(angle) * other[:, None]
        points = path[:, None] + radius_m * ring
        points[:, -1] = points[:, 0]
        return self.sheet(points, painter, px_per_m)

    def on_wall(
        self,
        centre_m: tuple[float, float, float],
        yaw_deg: float,
        size_m: tuple[float, float],
        painter: Painter,
        px_per_m: float,
        depth_m: float = 0.02,
        glow: float = 0.0,
    ) -> Item:
        """Make a flat picture with a thin rim.

        Args:
            centre_m: Centre of its back, world.
            yaw_deg: Turn about z; at 0 it faces −y.
            size_m: Width and height.
            painter: Paints the picture.
            px_per_m: Texels per metre, before ``DETAIL``.
            depth_m: Distance of the picture from its back.
            glow: Light it gives off, see :meth:`sheet`.
        """
        width, height = size_m
        face = upright((-width / 2, -depth_m), (width / 2, -depth_m), -height / 2, height / 2)
        front = self.sheet(face, painter, px_per_m, glow)
        rim = self.box((width, depth_m, height), lambda c: c.plain((0.3, 0.3, 0.3)), 40, "lrtu")
        return joined(front, rim.placed(0, -depth_m / 2, -height / 2)).placed(*centre_m, yaw_deg)


def cell_corners(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Return the vertices (4, N) of a grid's cells: top left, top right, bottom left and right."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    corners = (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    return np.stack([corner.ravel() for corner in corners])
