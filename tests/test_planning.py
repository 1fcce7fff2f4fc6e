"""Planning: sampling, target selection and straight paths against closed forms and invariants."""

import numpy as np
import pytest
import trimesh

from synfeal.config.models import Angles, CollectionConfig, SceneConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.errors import InputError
from synfeal.geometry.rotations import rotation_angle_rad
from synfeal.mesh.rays import RayCaster
from synfeal.planning.path import path_poses
from synfeal.planning.plan import plan_split
from synfeal.planning.sampling import pose_bounds, sample_poses
from synfeal.planning.target import has_free_view

ROOM = np.array([[-3.0, -2.0, 0.0], [3.0, 2.0, 2.5]])


def caster_of(*meshes):
    joined = trimesh.util.concatenate(list(meshes))
    return RayCaster(joined.vertices, joined.faces)


def room(bounds=ROOM):
    return trimesh.creation.box(bounds=bounds)


def scene_of(**values):
    return SceneConfig.model_validate({"source": "mesh", "path": "scene.glb", **values})


def collection_of(**values):
    return CollectionConfig.model_validate({"max_tries": 300, **values})


def vector(*values):
    return np.array([*values], dtype=np.float64)


def test_samples_are_uniform_within_their_bounds():
    bounds = pose_bounds(ROOM, Angles())
    poses = sample_poses(bounds, 20_000, np.random.default_rng(0))
    np.testing.assert_allclose(bounds[:, 5], [0.0, 2.0 * np.pi])
    share = (poses - bounds[0]) / (bounds[1] - bounds[0])
    assert share.min() >= 0.0
    assert share.max() <= 1.0
    for moment in (1, 2, 3):  # of a uniform variable: 1 / (k + 1)
        np.testing.assert_allclose((share**moment).mean(axis=0), 1 / (moment + 1), atol=0.01)
    np.testing.assert_allclose(np.corrcoef(share.T), np.eye(6), atol=0.03)


def test_free_view_needs_a_hit_beyond_the_least_distance():
    wall = trimesh.creation.box(bounds=[[2.0, -1, -1], [2.1, 1, 1]])
    poses = np.stack([vector(0, 0, 0, 0, 0, 0), vector(1, 0, 0, 0, 0, 0), vector(0, 0, 0, 0, 0, 3)])
    # two metres ahead; one metre ahead; looking away from it into the void
    assert has_free_view(caster_of(wall), poses, 1.5).tolist() == [True, False, False]


def test_slerp_turns_at_constant_speed():
    a, b = vector(0, 0, 0, 0, 0, 0), vector(1, 0, 0, 0.5, -0.4, 2.0)
    table = _table(path_poses(a, b, 0.1, "slerp"))
    turns = rotation_angle_rad(table.quat_wxyz[:-1], table.quat_wxyz[1:])
    np.testing.assert_allclose(turns, turns[0], rtol=1e-9)


def _table(poses):
    index = np.arange(len(poses))
    return PoseTable(index, index, poses[:, :3, 3], np.zeros((len(poses), 4))).with_poses(poses)


@pytest.fixture(scope="module")
def furnished():
    table = trimesh.creation.box(bounds=[[-0.5, -0.5, 0.7], [0.5, 0.5, 0.8]])
    return caster_of(room(), table)


def test_plan_has_the_frames_asked_for_on_free_connected_paths(furnished):
    collection = collection_of(frame_spacing_m=0.1, min_path_m=1.0)
    table = plan_split(furnished, ROOM, scene_of(), collection, 500, np.random.default_rng(1))
    np.testing.assert_array_equal(table.frame, np.arange(500))
    assert set(np.diff(table.path)) == {0, 1}
    # Each path starts where the one before ended, so no step is longer than the spacing allows.
    steps = np.linalg.norm(np.diff(table.position_m, axis=0), axis=1)
    assert steps.max() < 0.1 * 1.05
    assert furnished.sees(table.position_m[:-1], table.position_m[1:]).all()
    assert (table.position_m > ROOM[0]).all()
    assert (table.position_m < ROOM[1]).all()
    for path in range(table.path.max()):  # the last path may be cut short
        inside = np.flatnonzero(table.path == path)
        np.testing.assert_allclose(np.ptp(steps[inside[:-1]]), 0.0, atol=1e-9)
        assert len(inside) >= 10
    upright = table.world_from_cam[:, 2, 1]  # world z of the camera's downward axis
    assert (upright < 0).all()


def test_no_frames_is_an_error():
    with pytest.raises(InputError, match="at least 1"):
        plan_split(
            caster_of(room()), ROOM, scene_of(), collection_of(), 0, np.random.default_rng(0)
        )
