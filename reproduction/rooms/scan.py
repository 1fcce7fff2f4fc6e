"""Artefacts of a laser scan of a clean surface: uneven triangles, rounded edges, noise, holes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import map_coordinates
from scipy.sparse import coo_array, csr_array
from trimesh.geometry import faces_to_edges
from trimesh.grouping import group_rows
from trimesh.triangles import cross

from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import weld
from synfeal.objects.patches import Patch, Points, Real, bilinear, cell_corners

JITTER = 0.3  # how far an inner vertex leaves its place, in cells; scans have uneven triangles
RIM = 0.3  # how far from the rim of its patch light is measured, in cells
Shares = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """Vertices of one patch, row by row."""

    points_m: Points  # (R, C, 3) metres
    normals: Points  # (R, C, 3) unit, towards the front
    inner_m: Points  # (R, C, 3) the points, those on the rim a little off the neighbouring patch
    rows: Shares  # (R,) where they lie on the picture, from 0 (top) to 1
    columns: Shares  # (C,) where they lie on the picture, from 0 (left) to 1

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.rows), len(self.columns)

    @property
    def n_points(self) -> int:
        """Vertices."""
        return len(self.rows) * len(self.columns)


def refined(patch: Patch, cell_m: float) -> Grid:
    """Divide the patch into cells of about ``cell_m``; its own rows and columns remain.

    Patches that share a rim divide it alike, so they still meet without a gap.
    """
    row_at = _divided(patch.points_m, cell_m)
    column_at = _divided(patch.points_m.swapaxes(0, 1), cell_m)
    points = bilinear(patch.points_m, row_at, column_at)
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return Grid(
        points,
        # The tip of a cone has no normal; light from above is as good a guess as any.
        np.where(length > 1e-12, normals / np.maximum(length, 1e-12), (0.0, 0.0, 1.0)),
        bilinear(
            points, *(np.clip(np.arange(float(n)), RIM, n - 1 - RIM) for n in points.shape[:2])
        ),
        np.interp(row_at, np.arange(len(patch.points_m)), patch.row_shares),
        np.interp(column_at, np.arange(patch.points_m.shape[1]), patch.column_shares),
    )


def _divided(points: Points, cell_m: float) -> Shares:
    """Return fractional row indices that divide every step between rows into cells."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=1)
    parts = np.maximum(1, np.round(steps / cell_m)).astype(np.int64)
    inner = [index + np.arange(count) / count for index, count in enumerate(parts)]
    return np.concatenate([*inner, [float(len(parts))]])


def jittered(
    rng: np.random.Generator, grid: Grid, points_m: Points
) -> tuple[Points, NDArray[np.float64]]:
    """Move the inner points of a grid along the surface; its picture stays in place.

    Rims stay even, so that neighbours still meet.

    Args:
        rng: Source of the moves.
        grid: Grid (R, C) of the patch.
        points_m: Points (R·C, 3) to move, row by row, metres.

    Returns:
        The points (R·C, 3), and their places on the picture (R·C, 2): row and column, 0 to 1.
    """
    offsets = rng.uniform(-JITTER, JITTER, (2, *grid.shape))
    offsets[:, [0, -1]] = offsets[:, :, [0, -1]] = 0
    shares = np.stack(np.meshgrid(grid.rows, grid.columns, indexing="ij"), axis=-1)
    both = np.concatenate([points_m.reshape(*grid.shape, 3), shares], axis=-1)
    along_rows, along_columns = np.gradient(both, axis=0), np.gradient(both, axis=1)
    moved = both + offsets[0][..., None] * along_rows + offsets[1][..., None] * along_columns
    return moved[..., :3].reshape(-1, 3), moved[..., 3:].reshape(-1, 2)


def grid_faces(rng: np.random.Generator, points: Points) -> NDArray[np.int64]:
    """Triangulate a grid (F, 3), counter-clockwise from its front, without faces of no area.

    Every cell is cut along one of its diagonals at random.
    """
    a, b, c, d = cell_corners(points.shape[:2])
    falling = rng.random(len(a)) < 0.5  # the diagonal runs from a to d, else from b to c
    first = np.stack([a, c, np.where(falling, d, b)], axis=1)
    second = np.stack([b, np.where(falling, a, c), d], axis=1)
    faces = np.concatenate([first, second]).astype(np.int64)
    doubled = cross(points.reshape(-1, 3)[faces])
    return np.asarray(faces[np.linalg.norm(doubled, axis=1) > 1e-10])


def albedo_of(patch: Patch, grid: Grid) -> NDArray[np.float32]:
    """Average the linear albedo (R, C, 3) of the picture around every vertex."""
    rows, columns = grid.shape
    small = Image.fromarray(patch.picture).resize((columns, rows), Image.Resampling.BOX)
    return (np.asarray(small, np.float32) / np.float32(255)) ** np.float32(2.2)


@dataclass(frozen=True)
class RoomSurface:
    """The grids of many patches as one surface, vertices in the order of the patches."""

    grids: tuple[Grid, ...]  # the grid of every patch
    points_m: Points  # (V, 3), see :class:`Grid`
    normals: Points  # (V, 3), see :class:`Grid`
    inner_m: Points  # (V, 3), see :class:`Grid`
    faces: NDArray[np.int64]  # (F, 3) indices of vertices
    edges: NDArray[np.int64]  # (E, 2) vertices that are neighbours in a row or in a column
    n_faces: tuple[int, ...]  # how many of them belong to each patch, in order

    def per_patch(self, values: NDArray[Real]) -> list[NDArray[Real]]:
        """Split values (V, K) of all vertices into grids (R, C, K), one for each patch."""
        sizes = [grid.n_points for grid in self.grids]
        pieces = zip(np.split(values, np.cumsum(sizes)[:-1]), self.grids, strict=True)
        return [piece.reshape(*grid.shape, -1) for piece, grid in pieces]


def surface_of(rng: np.random.Generator, patches: Sequence[Patch], cell_m: float) -> RoomSurface:
    """Refine all patches and join them to one surface.

    Args:
        rng: Decides along which diagonal each cell is cut.
        patches: Patches of the room.
        cell_m: Side of the cells to refine to, metres.
    """
    grids = tuple(refined(patch, cell_m) for patch in patches)
    sizes = [grid.n_points for grid in grids]
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    faces = [grid_faces(rng, g.points_m) + i for g, i in zip(grids, first, strict=True)]
    edges = [_grid_edges(grid.shape) + i for grid, i in zip(grids, first, strict=True)]
    points, normals, inner = (
        np.concatenate([getattr(grid, name).reshape(-1, 3) for grid in grids])
        for name in ("points_m", "normals", "inner_m")
    )
    n_faces = tuple(map(len, faces))
    return RoomSurface(
        grids, points, normals, inner, np.concatenate(faces), np.concatenate(edges), n_faces
    )


def _grid_edges(shape: tuple[int, int]) -> NDArray[np.int64]:
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    down = np.stack([index[:-1].ravel(), index[1:].ravel()], axis=1)
    right = np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=1)
    return np.concatenate([down, right])


Faces = NDArray[np.int64]

ROUNDING = 0.35  # share of the way to the mean of its neighbours that every vertex goes
WAVES = ((0.7, 0.006), (0.15, 0.0012))  # wavelength and deviation of the displacement, metres
LIFT_M = 0.01  # rays start this far in front of their surface


@dataclass(frozen=True)
class Scanner:
    """Settings of a scan."""

    cell_m: float  # side of the cells the surface is divided into
    stations_m: Points  # (S, 3) where the scanner stood; what none of them sees becomes a hole
    lower_m: tuple[float, float, float]  # corners of the room: the bounding box of the mesh
    upper_m: tuple[float, float, float]  # corners of the room: the bounding box of the mesh


def stations(
    lower_m: tuple[float, ...], upper_m: tuple[float, ...], shape: tuple[int, ...]
) -> Points:
    """Place the stations of a scanner on a lattice in a room, away from the walls.

    Args:
        lower_m: Lower corner of the room (3,), metres.
        upper_m: Its upper corner (3,), metres.
        shape: Number of stations along x, y and z.

    Returns:
        Stations (S, 3), metres.
    """
    share = (np.array(list(np.ndindex(*shape))) + 0.5) / shape
    return np.asarray(lower_m + share * np.subtract(upper_m, lower_m))


def scanned(rng: np.random.Generator, surface: RoomSurface, scanner: Scanner) -> Points:
    """Displace the vertices of a surface as a scan does, and fit it into the room again.

    Vertices at one place stay at one place, so nothing tears.

    Args:
        rng: Source of the displacement.
        surface: Clean surface of V vertices.
        scanner: Settings of the scan, among them the bounding box to fit.

    Returns:
        Displaced vertices (V, 3), metres.
    """
    welded, index = weld(surface.points_m)
    rough = rounded(welded, index[surface.edges], index[surface.faces])
    rough = rough + displacement(rng, rough)
    lower, upper = np.asarray(scanner.lower_m), np.asarray(scanner.upper_m)
    low, high = rough.min(axis=0), rough.max(axis=0)
    fitted = lower + (rough - low) / (high - low) * (upper - lower)
    return np.asarray(fitted[index], np.float64)


def rounded(points: Points, edges: Faces, faces: Faces) -> Points:
    """Move every vertex a step towards the mean of its neighbours.

    Open rims stay, so that nothing comes off a wall; in the plane an even grid stays, too.

    Args:
        points: Vertices (V, 3), each place once.
        edges: Neighbours (E, 2), rows of ``points``.
        faces: Triangles (F, 3), rows of ``points``, which tell where the rims are.

    Returns:
        Vertices (V, 3).
    """
    ends = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)
    ends = ends[ends[:, 0] != ends[:, 1]]
    shape = (len(points), len(points))
    neighbours = csr_array(coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=shape))
    degree = np.asarray(neighbours.sum(axis=1)).reshape(-1, 1)
    mean = (neighbours @ points) / np.maximum(degree, 1)
    share = np.where(degree > 0, ROUNDING, 0.0)
    sides = faces_to_edges(faces)
    rim = sides[group_rows(np.sort(sides, axis=1), require_count=1)]  # edges with one face only
    share[rim[rim[:, 0] != rim[:, 1]]] = 0
    return np.asarray(points + share * (mean - points), np.float64)


def displacement(rng: np.random.Generator, points_m: Points) -> Points:
    """Draw a smooth vector field (V, 3): nearby surfaces move together, as scans are warped."""
    total = np.zeros_like(points_m)
    low = points_m.min(axis=0)
    for wavelength, deviation in WAVES:
        at = (points_m - low) / wavelength + 2.0
        shape = tuple((np.ceil(at.max(axis=0)) + 3).astype(int))
        for axis in range(3):
            lattice = rng.standard_normal(shape)
            total[:, axis] += deviation * map_coordinates(lattice, at.T, order=3, mode="nearest")
    return total


def seen_faces(points_m: Points, faces: Faces, stations_m: Points) -> NDArray[np.bool_]:
    """Find the faces that a station sees, from either side, and those that touch one that is seen.

    Args:
        points_m: Vertices (V, 3), metres.
        faces: Triangles (F, 3), rows of ``points_m``.
        stations_m: Stations of the scanner (S, 3), metres.

    Returns:
        Whether each face (F,) is one of them.
    """
    caster = RayCaster(points_m, faces)
    corners = points_m[faces]
    normals = cross(corners)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    middles = corners.mean(axis=1)
    seen = np.zeros(len(faces), bool)
    for station in stations_m:
        left = np.flatnonzero(~seen)
        side = np.sign(np.sum((station - middles[left]) * normals[left], axis=1, keepdims=True))
        starts = middles[left] + LIFT_M * side * normals[left]
        seen[left] = caster.sees(starts, np.broadcast_to(station, starts.shape))
    _, index = weld(points_m)
    touched = np.zeros(index.max() + 1, bool)
    touched[index[faces[seen]]] = True
    return np.asarray(touched[index[faces]].any(axis=1), np.bool_)
