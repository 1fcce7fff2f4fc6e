"""Rays where triangles meet, on slivers, along surfaces and far away; depth at the clip planes."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from reproduction.hard_cases.exact import MP, Trial, mpf
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh import rays
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import raycast_backend

Array = NDArray[np.float64]
N_AIMED, N_RAYS, N_SLIVERS = 4000, 100, 101
PARALLEL = 1e-6  # the textbook's threshold on the determinant
QUAD = np.array([[0, 1, 2], [0, 2, 3]])
SIGNS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
CAMERA = CameraConfig(width=16, height=16, near_m=0.05, far_m=100.0)
BUFFER_STEPS = np.float32(2**24 - 1)


def leaks(mesh: trimesh.Trimesh, at_corners: bool = False) -> Trial:
    """Rays from within a closed surface at its edges or corners; a share of 0 must get out."""
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    rng = np.random.default_rng(3)
    ends = vertices[mesh.edges_unique[rng.integers(0, len(mesh.edges_unique), N_AIMED)]]
    along = np.zeros((N_AIMED, 1)) if at_corners else rng.uniform(0.0, 1.0, (N_AIMED, 1))
    targets = ends[:, 0] + along * (ends[:, 1] - ends[:, 0])
    origins = mesh.bounds.mean(axis=0) + rng.uniform(-0.1, 0.1, (N_AIMED, 3))
    caster = rays.RayCaster(vertices, faces)
    return Trial(
        naive=lambda: np.isinf(moller_trumbore(vertices, faces, origins, targets - origins)).mean(),
        ours=lambda: np.isinf(caster.first_hit_m(origins, targets - origins)).mean(),
        truth=mpf(0.0),
    )


def ball() -> trimesh.Trimesh:
    """A closed surface of 320 triangles."""
    return trimesh.creation.icosphere(subdivisions=2)


def sliver_wall() -> trimesh.Trimesh:
    """A closed metre cube, one side of it cut into triangles a metre long and a micrometre wide."""
    cube = trimesh.creation.box((1.0, 1.0, 1.0))
    y = np.append(np.linspace(-0.5, -0.4999, N_SLIVERS), 0.5)
    sides = [np.column_stack([np.full_like(y, 0.5), y, np.full_like(y, z)]) for z in (-0.5, 0.5)]
    k, up = 8 + np.arange(len(y) - 1), len(y)
    strips = [np.stack(c, axis=1) for c in ((k, k + 1, k + up), (k + 1, k + 1 + up, k + up))]
    others = cube.faces[cube.face_normals[:, 0] < 0.5]
    vertices, faces = np.vstack([cube.vertices, *sides]), np.vstack([others, *strips])
    return trimesh.Trimesh(vertices, faces, process=False)


def wall(offset_m: float, angle_rad: float) -> Trial:
    """Rays that meet a wall across x at an angle to it: how far the hits are from its plane.

    As a share of the wall's 10 m: the caster promises the answers of a mesh whose points are moved
    by so much. The plane is an axis', so a hit is off it by ``distance * direction_x - gap``, and
    the distance itself is exact in rationals but for the ray's length.
    """
    rng = np.random.default_rng(4)
    centre_m = offset_m * np.array([1.0000123, -0.70003, 0.30007])
    corners = centre_m + np.column_stack([np.zeros(4), 5.0 * SIGNS])
    heading = rng.uniform(0.0, 2.0 * np.pi, N_RAYS)
    along = np.cos(angle_rad) * np.stack([np.cos(heading), np.sin(heading)])
    directions = np.column_stack([np.full(N_RAYS, np.sin(angle_rad)), *along])
    origins = centre_m - 3.0 * directions
    caster = rays.RayCaster(corners, QUAD)
    gaps = [Fraction(corners[0, 0]) - Fraction(origin[0]) for origin in origins]
    lengths = [MP.sqrt(sum(mpf(v) ** 2 for v in direction)) for direction in directions]
    sines = [
        mpf(direction[0]) / length for direction, length in zip(directions, lengths, strict=True)
    ]
    return Trial(
        naive=lambda: moller_trumbore(corners, QUAD, origins, directions),
        ours=lambda: caster.first_hit_m(origins, directions),
        truth=gaps,
        error=lambda hits_m, truth: max(
            float(abs(mpf(hit) * sine - mpf(gap))) / 10.0 if np.isfinite(hit) else np.inf
            for hit, sine, gap in zip(hits_m, sines, truth, strict=True)
        ),
    )


def moller_trumbore(
    vertices: Array, faces: NDArray[np.int64], origins: Array, directions: Array
) -> Array:
    """The textbook test, in float32 as on a graphics card: distances (N,), ``inf`` for none."""
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    corners, start, way = (x.astype(np.float32) for x in (vertices[faces], origins, unit))
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    nearest = np.full(len(origins), np.inf, np.float32)
    for corner, a, b in zip(corners[:, 0], first, second, strict=True):
        across, offset = np.cross(way, b), start - corner
        determinant = across @ a
        beside = np.cross(offset, a)
        u = (offset * across).sum(axis=1) / determinant
        v = (way * beside).sum(axis=1) / determinant
        distance = beside @ b / determinant
        met = (np.abs(determinant) > PARALLEL) & (u >= 0) & (v >= 0) & (u + v <= 1)
        nearest = np.where(met & (distance > 0), np.minimum(nearest, distance), nearest)
    return np.asarray(nearest, dtype=np.float64)


def depth_of_plane(depth_m: float, slope: float) -> Trial:
    """A plane that the optical axis meets at ``depth_m``; it recedes by ``slope`` to the right."""
    x, y = 2.0 * depth_m * SIGNS.T
    corners = np.column_stack([x, y, depth_m + slope * x])
    part = MeshPart("plane", corners, QUAD, vertex_rgb=np.full((4, 3), 255, np.uint8))
    renderer = raycast_backend.RaycastRenderer(
        TexturedMesh((part,)), CAMERA, RenderConfig(supersampling=1)
    )
    truth = _depths_m(corners)
    exact_m = np.array([float(depth) for depth in truth])
    return Trial(
        naive=lambda: buffered(exact_m),
        ours=lambda: renderer.render_rgbd(np.eye(4))[1].ravel(),
        truth=truth,
    )


def buffered(depth_m: Array) -> Array:
    """Depths that went through a buffer of 24 bits, made metres again in float32."""
    near, far = np.float32(CAMERA.near_m), np.float32(CAMERA.far_m)
    device = (far + near) / (far - near) - 2 * far * near / (far - near) / np.float32(depth_m)
    kept = np.round((device + 1) / 2 * BUFFER_STEPS) / BUFFER_STEPS
    return np.asarray(2 * far * near / (far + near - (2 * kept - 1) * (far - near)))


def _depths_m(corners: Array) -> list[Any]:
    """Where the rays of all pixels meet the plane ``z = a + b x`` of the corners."""
    fx, _, cx, _ = map(Fraction, CAMERA.intrinsics)
    (x0, _, z0), (x1, _, z1) = ([Fraction(float(v)) for v in corner] for corner in corners[:2])
    b = (z1 - z0) / (x1 - x0)
    columns = [
        (z0 - b * x0) / (1 - b * (u + Fraction(1, 2) - cx) / fx) for u in range(CAMERA.width)
    ]
    return columns * CAMERA.height
