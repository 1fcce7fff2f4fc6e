"""A room whose free space and distances are known in closed form, for tests of planning.

A box without furniture is convex: all of its points see each other, and a ray from inside it meets
the wall at a distance that takes one division. A wall across it makes two such boxes.
"""

import numpy as np
import trimesh
from hypothesis import strategies as st

from synfeal.config.collection import Angles, SceneConfig
from synfeal.config.dataset import CameraConfig
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles
from synfeal.planning.space import pose_bounds
from tests.support.property_support import angles_rad, positions

ROOM = np.array([[-3.0, -2.0, 0.0], [3.0, 2.0, 2.5]])
SCENE = SceneConfig.model_validate({"source": "mesh", "path": "scene.glb"})
SQUARE = CameraConfig(width=64, height=64, horizontal_fov_deg=90.0)
BOUNDS = pose_bounds(ROOM, Angles())
walls = st.floats(1.0, 2.0)  # x of a wall across the room: its larger part is two thirds or more
pitches = st.floats(-1.5, 1.5)
pose_vectors = st.tuples(positions, angles_rad, pitches, angles_rad).map(
    lambda parts: np.hstack([parts[0], parts[1:]])
)


def mesh_of(*boxes):
    meshes = [trimesh.creation.box(bounds=bounds) for bounds in boxes]
    whole = trimesh.util.concatenate(meshes)
    return Triangles(np.asarray(whole.vertices), np.asarray(whole.faces))


def caster_of(*boxes):
    return RayCaster(*mesh_of(*boxes))


EMPTY = caster_of(ROOM)


def divided(wall):
    return caster_of(ROOM, [[wall, -2.0, 0.0], [wall + 0.1, 2.0, 2.5]])


def wall_distance_m(points, ways):
    """Distance to the room's walls from points (N, 3) inside along unit vectors (N, 3)."""
    ways = np.where(ways == 0.0, 1e-300, ways)
    return np.max((ROOM - points[:, None]) / ways[:, None], axis=1).min(axis=1)


def inside_poses(seed, count):
    """Pose vectors in the room, a little away from its walls."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(ROOM[0] + 0.05, ROOM[1] - 0.05, (count, 3))
    return np.hstack([position, rng.uniform([-1, -1.2, -np.pi], [1, 1.2, np.pi], (count, 3))])
