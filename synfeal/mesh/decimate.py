"""The mesh that rays are cast against: fewer triangles, the same answers (section 3.2)."""

from __future__ import annotations

import logging
from pathlib import Path

import fast_simplification
import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.files import atomic_path
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]

MERGE_M = 1e-5  # copies of a vertex on a texture seam differ by rounding only
N_CHECK = 10_000
MIN_AGREEMENT = 0.995

log = logging.getLogger("synfeal")


def collision_mesh(mesh: TexturedMesh, n_faces: int) -> tuple[Vertices, Faces]:
    """Vertices (V, 3) and faces (F, 3) of about ``n_faces`` triangles that block the same lines.

    Simplification can close a doorway or lose a thin wall. So the result is compared with the full
    mesh on random lines of sight through its bounds; where they disagree on more than 0.5 %, twice
    as many triangles are tried, up to the full mesh. Alpha-tested surfaces block as a whole.
    """
    vertices, faces = merge_vertices(*mesh.merged())
    reference = RayCaster(vertices, faces)
    while n_faces < len(faces):
        candidate = simplify(vertices, faces, n_faces)
        agreement = sight_agreement(reference, candidate, mesh.bounds_m)
        if agreement >= MIN_AGREEMENT:
            return candidate
        log.info("collision mesh: %d faces agree on %.2f %% of lines", n_faces, 100 * agreement)
        n_faces *= 2
    return vertices, faces


def merge_vertices(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """Join vertices at the same place, or a simplifier tears the mesh along its seams."""
    keys = np.round(vertices / MERGE_M).astype(np.int64)
    _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    joined = index.reshape(-1)[faces]
    corners = np.sort(joined, axis=1)
    has_area = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    return vertices[first], joined[has_area].astype(np.int64)


def simplify(vertices: Vertices, faces: Faces, n_faces: int) -> tuple[Vertices, Faces]:
    """Quadric simplification to about ``n_faces`` triangles."""
    centre = vertices.mean(axis=0)  # the library works in float32
    points, triangles = fast_simplification.simplify(
        (vertices - centre).astype(np.float32), faces.astype(np.int32), target_count=n_faces
    )
    return points.astype(np.float64) + centre, triangles.astype(np.int64)


def sight_agreement(
    reference: RayCaster, candidate: tuple[Vertices, Faces], bounds_m: NDArray[np.float64]
) -> float:
    """Share of random point pairs in ``bounds_m`` (2, 3) on whose visibility both agree."""
    if not len(candidate[1]):
        return 0.0
    rng = np.random.default_rng(0)
    starts, ends = rng.uniform(bounds_m[0], bounds_m[1], (2, N_CHECK, 3))
    other = RayCaster(*candidate)
    return float(np.mean(reference.sees(starts, ends) == other.sees(starts, ends)))


def save_collision_mesh(path: Path, vertices: Vertices, faces: Faces) -> None:
    """Write a binary PLY."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    with atomic_path(path) as temporary:
        temporary.write_bytes(mesh.export(file_type="ply", encoding="binary"))


def load_collision_mesh(path: Path) -> tuple[Vertices, Faces]:
    """Read what :func:`save_collision_mesh` wrote.

    Raises:
        InputError: the file is missing or is no PLY with faces.
    """
    try:
        mesh = trimesh.load_mesh(str(path), process=False)
        return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except Exception as error:  # parsers of foreign files fail in every way there is
        raise InputError(f"{path}: cannot be read as a collision mesh ({error})") from None
