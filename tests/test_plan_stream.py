"""The stream of candidates against a planner that draws and tests one round at a time."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from synfeal.config.models import Angles, CollectionConfig, SceneConfig
from synfeal.errors import InputError
from synfeal.mesh.rays import RayCaster
from synfeal.planning import candidates
from synfeal.planning.path import path_poses
from synfeal.planning.plan import plan_split
from synfeal.planning.sampling import pose_bounds, sample_poses
from synfeal.planning.space import PoseSpace
from synfeal.planning.start import sample_start
from synfeal.planning.target import admissible

Array = NDArray[np.float64]

ROOM = np.array([[-3.0, -2.0, 0.0], [3.0, 2.0, 2.5]])
VIEW_M, MIN_PATH_M, SPACING_M = 1.2, 1.5, 0.25
SCENE = SceneConfig.model_validate({"source": "mesh", "path": "scene.glb"})


@pytest.fixture(scope="module")
def furnished():
    boxes = ([[-0.5, -0.5, 0.0], [0.5, 0.5, 1.8]], [[1.0, -2.0, 0.0], [1.2, 1.0, 2.5]])
    meshes = [trimesh.creation.box(bounds=bounds) for bounds in (ROOM, *boxes)]
    joined = trimesh.util.concatenate(meshes)
    return RayCaster(joined.vertices, joined.faces)


def round_by_round(caster, k, n_frames, rng):
    """Positions (n_frames, 3) planned as the paper describes it, without any look-ahead."""
    bounds = pose_bounds(ROOM, Angles())
    start = sample_start(PoseSpace(caster, bounds, VIEW_M, rng), 100)
    found = []
    while len(found) < n_frames:
        poses = sample_poses(bounds, k, rng)
        fit = [bool(admissible(caster, start, pose[None], VIEW_M)[0]) for pose in poses]
        length_m = [float(np.linalg.norm(pose[:3] - start[:3])) for pose in poses]
        best = max((m for m, ok in zip(length_m, fit, strict=True) if ok), default=-1.0)
        if best >= MIN_PATH_M:
            target = poses[length_m.index(best)]
            found += list(path_poses(start, target, SPACING_M, "rpy")[:, :3, 3])
            start = target
    return np.array(found[:n_frames])


@pytest.mark.parametrize("block", [7, 64, 4096])
@pytest.mark.parametrize("k", [1, 3, 8])
def test_plan_is_that_of_one_round_at_a_time(furnished, k, block, monkeypatch):
    monkeypatch.setattr(candidates, "BLOCK", block)
    collection = CollectionConfig(candidates=k, frame_spacing_m=SPACING_M, min_path_m=MIN_PATH_M)
    for seed in range(3):
        plan = plan_split(furnished, ROOM, SCENE, collection, 400, np.random.default_rng(seed))
        expected = round_by_round(furnished, k, 400, np.random.default_rng(seed))
        np.testing.assert_array_equal(plan.position_m, expected)


@pytest.mark.parametrize("tries", [1, 5, 1000])
def test_no_more_rounds_are_tried_than_allowed(tries):
    room = trimesh.creation.box(bounds=ROOM)
    bounds = pose_bounds(ROOM, Angles())
    caster, rng = RayCaster(room.vertices, room.faces), np.random.default_rng(0)
    stream = candidates.CandidateStream(PoseSpace(caster, bounds, VIEW_M, rng), 2)
    start = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert stream.next_target(start, 50.0, tries) is None
    found = stream.next_target(start, 0.0, 1)
    drawn = sample_poses(bounds, 2 * (tries + 1), np.random.default_rng(0))
    assert found is None or (drawn[-2:] == found).all(axis=1).any()


def test_dead_end_names_the_place_and_what_to_relax(furnished):
    collection = CollectionConfig(max_tries=3, min_path_m=50.0)
    with pytest.raises(InputError, match=r"from \(.*\) in 3 rounds of 8 candidates"):
        plan_split(furnished, ROOM, SCENE, collection, 1, np.random.default_rng(0))
