"""What a laser scanner makes of a clean surface: rounded edges, waves, noise, and holes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.sparse import coo_array, csr_array
from trimesh.triangles import cross

from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import weld
from synfeal.scenes.grids import Surface
from synfeal.scenes.patches import Points

Faces = NDArray[np.int64]

ROUNDING = 0.35  # share of the way to the mean of its neighbours that every vertex goes
WAVES = ((0.7, 0.006), (0.15, 0.0012))  # wavelength and deviation of the displacement, metres
LIFT_M = 0.01  # rays start this far in front of their surface


@dataclass(frozen=True)
class Scanner:
    """How a scene is scanned."""

    cell_m: float  # side of the cells the surface is divided into
    stations_m: Points  # (S, 3) where the scanner stood; what none of them sees becomes a hole
    lower_m: tuple[float, float, float]  # corners of the room: the bounding box of the mesh
    upper_m: tuple[float, float, float]  # corners of the room: the bounding box of the mesh


def stations(
    lower_m: tuple[float, ...], upper_m: tuple[float, ...], shape: tuple[int, ...]
) -> Points:
    """A lattice (S, 3) of stations with ``shape`` of them along x, y and z, away from the walls."""
    axes = [
        low + (np.arange(count) + 0.5) / count * (high - low)
        for low, high, count in zip(lower_m, upper_m, shape, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def scanned(rng: np.random.Generator, surface: Surface, scanner: Scanner) -> Points:
    """Vertices (V, 3) as scanned; those at one place stay at one place, so nothing tears."""
    welded, index = weld(surface.points_m)
    rough = rounded(welded, index[surface.edges], index[surface.faces])
    rough = rough + displacement(rng, rough)
    lower, upper = np.asarray(scanner.lower_m), np.asarray(scanner.upper_m)
    low, high = rough.min(axis=0), rough.max(axis=0)
    fitted = lower + (rough - low) / (high - low) * (upper - lower)
    return np.asarray(fitted[index], np.float64)


def rounded(points: Points, edges: Faces, faces: Faces) -> Points:
    """Every vertex a step towards the mean of its neighbours along ``edges`` (E, 2).

    Open rims stay, so that nothing comes off a wall; in the plane an even grid stays too.
    """
    ends = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)
    ends = ends[ends[:, 0] != ends[:, 1]]
    shape = (len(points), len(points))
    neighbours = csr_array(coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=shape))
    degree = np.asarray(neighbours.sum(axis=1)).reshape(-1, 1)
    mean = (neighbours @ points) / np.maximum(degree, 1)
    share = np.where(degree > 0, ROUNDING, 0.0)
    share[_rim(faces)] = 0
    return np.asarray(points + share * (mean - points), np.float64)


def _rim(faces: Faces) -> Faces:
    """Vertices on an edge that only one face has."""
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    unique, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    return np.unique(unique[(count == 1) & (unique[:, 0] != unique[:, 1])])


def displacement(rng: np.random.Generator, points_m: Points) -> Points:
    """A smooth random vector field (V, 3): nearby surfaces move together, as scans are warped."""
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
    """Which faces (F,) a station sees, from either side, or touch one that is seen."""
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
