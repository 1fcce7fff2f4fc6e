"""Triangles all over a room, views of them, and digests of what is seen."""

import hashlib

import numpy as np

from synfeal.config.models import CameraConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh

CAMERA = CameraConfig(width=64, height=48, fx=45.0, fy=55.0, cx=20.5, cy=33.0)


def soup(n_faces, seed=0):
    """Small triangles all over a room of 8 m, coloured and textured, some of them coincident."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-4, 4, (n_faces, 1, 3)) + rng.normal(0, 0.4, (n_faces, 3, 3))
    corners[1::7] = corners[0::7][: len(corners[1::7])]
    vertices = corners.reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    half = n_faces // 2
    image = rng.integers(0, 256, (64, 64, 3), np.uint8)
    rgb = rng.integers(0, 256, (len(vertices), 3), np.uint8)
    return TexturedMesh(
        (
            MeshPart("colours", vertices, faces[:half], vertex_rgb=rgb),
            MeshPart("texture", vertices, faces[half:], rng.random((len(vertices), 2)), image),
        )
    )


def poses(count, seed=1):
    rng = np.random.default_rng(seed)
    return [
        pose_matrix(rotation_from_rpy(rng.uniform(-3, 3, 3)), rng.uniform(-3, 3, 3))
        for _ in range(count)
    ]


def digest(renderer, views):
    images = [renderer.render_rgbd(view) for view in views]
    return [hashlib.sha256(rgb.tobytes() + depth.tobytes()).hexdigest() for rgb, depth in images]
