"""Three scenes, with a pose in each, that are small enough to cast rays at every triangle."""

import numpy as np
import trimesh

from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from tests.support.collected import painted


def _room():
    """Walls, a ball, and boxes just above the floor: surfaces that coincide decide at random."""
    walls = trimesh.creation.box((5.0, 4.0, 2.6))
    walls.apply_translation([2.5, 2.0, 1.3])
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.4)
    ball.apply_translation([2.2, 3.0, 1.0])
    parts = [*painted(walls).parts, *painted(ball).parts]
    for centre, size in (((1.6, 1.0, 0.01), (0.9, 0.6, 0.8)), ((3.4, 2.6, 0.01), (0.5, 1.1, 1.7))):
        box = trimesh.creation.box(size)
        box.apply_transform(trimesh.transformations.rotation_matrix(0.4, [0, 0, 1]))
        box.apply_translation([*centre[:2], centre[2] + size[2] / 2])
        parts += painted(box).parts
    return TexturedMesh(tuple(parts)), (0.5, 2.0, 1.5), (0.0, 0.25, 0.2)


def _heap():
    """Boxes at random in a hollow ball, some faces outside in."""
    rng = np.random.default_rng(4)
    parts = list(painted(trimesh.creation.icosphere(subdivisions=2, radius=3.0)).parts)
    for number in range(25):
        turn = trimesh.transformations.random_rotation_matrix(rng.random(3))
        box = trimesh.creation.box(rng.uniform(0.2, 0.9, 3), turn)
        box.apply_translation(rng.uniform([-0.5, -1.5, -1.5], [2.5, 1.5, 1.5]))
        parts += painted(box, inwards=bool(number % 2)).parts
    named = [
        MeshPart(f"box {i}", p.vertices_m, p.faces, vertex_rgb=p.vertex_rgb)
        for i, p in enumerate(parts)
    ]
    return TexturedMesh(tuple(named)), (-2.4, 0.1, 0.2), (0.1, 0.0, 0.0)


def _hills():
    """Ground of waves, seen flat, with sky above it and a long way off."""
    x, y = np.meshgrid(np.linspace(-20, 20, 21), np.linspace(-20, 20, 21), indexing="ij")
    z = 0.8 * np.sin(0.5 * x) * np.cos(0.4 * y)
    corner = np.arange(20)[:, None] * 21 + np.arange(20)
    quads = [corner, corner + 21, corner + 22, corner + 1]
    a, b, c, d = (each.ravel() for each in quads)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    vertices = np.stack([x + 400_000.0, y + 5_000_000.0, z + 300.0], axis=-1).reshape(-1, 3)
    rgb = np.random.default_rng(2).integers(0, 256, (len(vertices), 3), np.uint8)
    ground = MeshPart("ground", vertices, faces, vertex_rgb=rgb)
    place = (400_000.0 - 11.0, 5_000_000.0 + 3.0, 302.6)
    return TexturedMesh((ground,)), place, (0.05, 0.15, 0.4)


def scene(name):
    """A mesh and a pose (4, 4) that looks at it."""
    mesh, position_m, rpy = {"room": _room, "heap": _heap, "hills": _hills}[name]()
    return mesh, pose_matrix(rotation_from_rpy(rpy), position_m)


SCENES = ("room", "heap", "hills")
