"""Meshes and rays of hard cases: where triangles meet, slivers, along surfaces, far away."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh import rays
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import raycast_backend

Array = NDArray[np.float64]
# Distances (N,) to the first hit of rays (origins, directions) on triangles (vertices, faces).
Caster = Callable[[Array, NDArray[np.int64], Array, Array], Array]
N_AIMED, N_RAYS, N_SLIVERS = 4000, 100, 101
WALL_M = 10.0  # side of the wall
QUAD = np.array([[0, 1, 2], [0, 2, 3]])
SIGNS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
CAMERA = CameraConfig(width=16, height=16, near_m=0.05, far_m=100.0)


def first_hit_m(
    vertices: Array, faces: NDArray[np.int64], origins: Array, directions: Array
) -> Array:
    """Cast rays with the project's ray caster.

    Args:
        vertices: Corners (V, 3) of the triangles, metres.
        faces: Rows of ``vertices`` (F, 3).
        origins: Starts of the rays (N, 3), metres.
        directions: Directions (N, 3) of any length but zero.

    Returns:
        Distances (N,) to the first triangle, metres; ``inf`` where a ray meets none.
    """
    return rays.RayCaster(vertices, faces).first_hit_m(origins, directions)


def leaking_share(
    mesh: trimesh.Trimesh, *, at_corners: bool = False, caster: Caster = first_hit_m
) -> float:
    """Return the share of rays that leave a closed surface, aimed at its edges or corners.

    Args:
        mesh: A closed surface.
        at_corners: Aim at corners in place of points on edges.
        caster: Function that casts the rays.
    """
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    rng = np.random.default_rng(3)
    ends = vertices[mesh.edges_unique[rng.integers(0, len(mesh.edges_unique), N_AIMED)]]
    along = np.zeros((N_AIMED, 1)) if at_corners else rng.uniform(0.0, 1.0, (N_AIMED, 1))
    targets = ends[:, 0] + along * (ends[:, 1] - ends[:, 0])
    origins = mesh.bounds.mean(axis=0) + rng.uniform(-0.1, 0.1, (N_AIMED, 3))
    return float(np.isinf(caster(vertices, faces, origins, targets - origins)).mean())


def ball() -> trimesh.Trimesh:
    """Make a closed surface of 320 triangles."""
    return trimesh.creation.icosphere(subdivisions=2)


def sliver_wall() -> trimesh.Trimesh:
    """Make a closed metre cube, one side of it cut into triangles of a metre by a micrometre."""
    cube = trimesh.creation.box((1.0, 1.0, 1.0))
    y = np.append(np.linspace(-0.5, -0.4999, N_SLIVERS), 0.5)
    sides = [np.column_stack([np.full_like(y, 0.5), y, np.full_like(y, z)]) for z in (-0.5, 0.5)]
    k, up = 8 + np.arange(len(y) - 1), len(y)
    strips = [np.stack(c, axis=1) for c in ((k, k + 1, k + up), (k + 1, k + 1 + up, k + up))]
    others = cube.faces[cube.face_normals[:, 0] < 0.5]
    vertices, faces = np.vstack([cube.vertices, *sides]), np.vstack([others, *strips])
    return trimesh.Trimesh(vertices, faces, process=False)


def off_the_wall(offset_m: float, angle_rad: float, *, caster: Caster = first_hit_m) -> float:
    """Cast rays at a wall across x; return how far hits are from its plane at most.

    As a share of the wall's side: the caster promises the answers of a mesh whose points are moved
    by so much. Gaps between origins and wall are differences of near doubles, thus exact.

    Args:
        offset_m: Distance of the wall from the origin of the world.
        angle_rad: Angle between rays and wall.
        caster: Function that casts the rays.
    """
    rng = np.random.default_rng(4)
    centre_m = offset_m * np.array([1.0000123, -0.70003, 0.30007])
    corners = centre_m + np.column_stack([np.zeros(4), WALL_M / 2 * SIGNS])
    heading = rng.uniform(0.0, 2.0 * np.pi, N_RAYS)
    along = np.cos(angle_rad) * np.stack([np.cos(heading), np.sin(heading)])
    directions = np.column_stack([np.full(N_RAYS, np.sin(angle_rad)), *along])
    origins = centre_m - 3.0 * directions
    gaps_m = corners[0, 0] - origins[:, 0]
    sines = directions[:, 0] / np.linalg.norm(directions, axis=1)
    hits_m = caster(corners, QUAD, origins, directions)
    return float(np.abs(hits_m * sines - gaps_m).max()) / WALL_M


class Plane(NamedTuple):
    """A plane that the optical axis meets at ``depth_m``; it recedes by ``slope`` to the right."""

    depth_m: float
    slope: float

    def corners(self) -> Array:
        """Return the corners (4, 3) of a square of it that fills the image."""
        x, y = 2.0 * self.depth_m * SIGNS.T
        return np.column_stack([x, y, self.depth_m + self.slope * x])


def depths_m(plane: Plane) -> Array:
    """Render the depth (16, 16) of a plane by ray casting."""
    part = MeshPart("plane", plane.corners(), QUAD, vertex_rgb=np.full((4, 3), 255, np.uint8))
    settings = RenderConfig(supersampling=1)
    renderer = raycast_backend.RaycastRenderer(TexturedMesh((part,)), CAMERA, settings)
    return renderer.render_rgbd(np.eye(4))[1].astype(np.float64)
