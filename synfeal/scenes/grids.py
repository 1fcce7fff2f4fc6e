"""Fine grids over patches: the triangles a scanner would have made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from trimesh.triangles import cross

from synfeal.scenes.patches import Patch, Points, Real, bilinear

JITTER = 0.3  # how far an inner vertex leaves its place, in cells; scans have uneven triangles
RIM = 0.3  # how far from the rim of its patch light is measured, in cells
Shares = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """Vertices of one patch, row by row."""

    points_m: Points  # (R, C, 3) metres
    normals: Points  # (R, C, 3) unit, towards the front
    inner_m: Points  # (R, C, 3) the points, those on the rim a little off the neighbouring patch
    rows: Shares  # (R,) and (C,) where they lie on the picture, from 0 (top, left) to 1
    columns: Shares  # (R,) and (C,) where they lie on the picture, from 0 (top, left) to 1

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.rows), len(self.columns)

    @property
    def n_points(self) -> int:
        """Vertices."""
        return len(self.rows) * len(self.columns)


def refined(patch: Patch, cell_m: float) -> Grid:
    """The patch in cells of about ``cell_m``; its own rows and columns remain.

    Patches that share a rim divide it alike, so they still meet without a gap.
    """
    row_at = _divided(patch.points_m, cell_m)
    column_at = _divided(patch.points_m.swapaxes(0, 1), cell_m)
    points = bilinear(patch.points_m, row_at, column_at)
    return Grid(
        points,
        _unit_normals(points),
        bilinear(points, _off_rim(len(row_at)), _off_rim(len(column_at))),
        np.interp(row_at, np.arange(len(patch.points_m)), patch.row_shares),
        np.interp(column_at, np.arange(patch.points_m.shape[1]), patch.column_shares),
    )


def _off_rim(count: int) -> Shares:
    return np.clip(np.arange(count), RIM, count - 1 - RIM)


def _divided(points: Points, cell_m: float) -> Shares:
    """Fractional row indices that divide every step between rows into cells."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=1)
    parts = np.maximum(1, np.round(steps / cell_m)).astype(np.int64)
    inner = [index + np.arange(count) / count for index, count in enumerate(parts)]
    return np.concatenate([*inner, [float(len(parts))]])


def _unit_normals(points: Points) -> Points:
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    # The tip of a cone has no normal; light from above is as good a guess as any.
    return np.where(length > 1e-12, normals / np.maximum(length, 1e-12), (0.0, 0.0, 1.0))


def jittered(
    rng: np.random.Generator, grid: Grid, points_m: Points
) -> tuple[Points, NDArray[np.float64]]:
    """Points (R·C, 3) moved along the surface, and where they lie on the picture (R·C, 2).

    The picture stays in place. Rims stay even, so that neighbours still meet.
    """
    offsets = rng.uniform(-JITTER, JITTER, (2, *grid.shape))
    offsets[:, [0, -1]] = 0
    offsets[:, :, [0, -1]] = 0
    shares = np.stack(np.meshgrid(grid.rows, grid.columns, indexing="ij"), axis=-1)
    both = np.concatenate([points_m.reshape(*grid.shape, 3), shares], axis=-1)
    along_rows, along_columns = np.gradient(both, axis=0), np.gradient(both, axis=1)
    moved = both + offsets[0][..., None] * along_rows + offsets[1][..., None] * along_columns
    return moved[..., :3].reshape(-1, 3), moved[..., 3:].reshape(-1, 2)


def grid_faces(rng: np.random.Generator, points: Points) -> NDArray[np.int64]:
    """Triangles (F, 3) of a grid, counter-clockwise from its front, without those of no area.

    Every cell is cut along one of its diagonals at random.
    """
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    corners = (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:])
    a, b, c, d = (part.ravel() for part in corners)
    falling = rng.random(len(a)) < 0.5  # the diagonal runs from a to d, else from b to c
    first = np.stack([a, c, np.where(falling, d, b)], axis=1)
    second = np.stack([b, np.where(falling, a, c), d], axis=1)
    faces = np.concatenate([first, second]).astype(np.int64)
    doubled = cross(points.reshape(-1, 3)[faces])
    solid: NDArray[np.int64] = faces[np.linalg.norm(doubled, axis=1) > 1e-10]
    return solid


def albedo_of(patch: Patch, grid: Grid) -> NDArray[np.float32]:
    """Mean linear albedo (R, C, 3) of the picture around every vertex."""
    rows, columns = grid.shape
    small = Image.fromarray(patch.picture).resize((columns, rows), Image.Resampling.BOX)
    return (np.asarray(small, np.float32) / np.float32(255)) ** np.float32(2.2)


@dataclass(frozen=True)
class Surface:
    """The grids of many patches as one surface, vertices in the order of the patches."""

    grids: tuple[Grid, ...]  # the grid of every patch
    points_m: Points  # (V, 3), see :class:`Grid`
    normals: Points  # (V, 3), see :class:`Grid`
    inner_m: Points  # (V, 3), see :class:`Grid`
    faces: NDArray[np.int64]  # (F, 3) indices of vertices
    edges: NDArray[np.int64]  # (E, 2) vertices that are neighbours in a row or in a column
    n_faces: tuple[int, ...]  # how many of them belong to each patch, in order

    def per_patch(self, values: NDArray[Real]) -> list[NDArray[Real]]:
        """Values (V, K) of all vertices as grids (R, C, K), one for each patch."""
        sizes = [grid.n_points for grid in self.grids]
        pieces = np.split(values, np.cumsum(sizes)[:-1])
        return [
            piece.reshape(*grid.shape, -1) for piece, grid in zip(pieces, self.grids, strict=True)
        ]


def surface_of(rng: np.random.Generator, patches: Sequence[Patch], cell_m: float) -> Surface:
    """All patches, refined to cells of about ``cell_m``."""
    grids = tuple(refined(patch, cell_m) for patch in patches)
    sizes = [grid.n_points for grid in grids]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    faces = [grid_faces(rng, g.points_m) + i for g, i in zip(grids, first, strict=True)]
    edges = [_grid_edges(grid.shape) + i for grid, i in zip(grids, first, strict=True)]
    return Surface(
        grids,
        np.concatenate([grid.points_m.reshape(-1, 3) for grid in grids]),
        np.concatenate([grid.normals.reshape(-1, 3) for grid in grids]),
        np.concatenate([grid.inner_m.reshape(-1, 3) for grid in grids]),
        np.concatenate(faces),
        np.concatenate(edges),
        tuple(map(len, faces)),
    )


def _grid_edges(shape: tuple[int, int]) -> NDArray[np.int64]:
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    down = np.stack([index[:-1].ravel(), index[1:].ravel()], axis=1)
    right = np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=1)
    return np.concatenate([down, right])
