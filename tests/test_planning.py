"""Planning: sampling, target selection and straight paths against closed forms and a naive twin."""

import numpy as np
import pytest

from synfeal.config.models import Angles, CollectionConfig
from synfeal.errors import InputError
from synfeal.planning.path import CandidateStream, path_poses
from synfeal.planning.plan import plan_split
from synfeal.planning.space import PoseSpace, admissible, has_free_view, pose_bounds, sample_poses
from synfeal.planning.start import sample_start
from tests.empty_room import EMPTY, ROOM, SCENE, caster_of

VIEW_M, MIN_PATH_M, SPACING_M = 1.2, 1.5, 0.25


@pytest.fixture(scope="module")
def furnished():
    return caster_of(
        ROOM, [[-0.5, -0.5, 0.0], [0.5, 0.5, 1.8]], [[1.0, -2.0, 0.0], [1.2, 1.0, 2.5]]
    )


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
    """Two metres ahead; one metre ahead; looking away from it into the void."""
    wall = caster_of([[2.0, -1, -1], [2.1, 1, 1]])
    poses = np.array([[0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 3]], dtype=float)
    assert has_free_view(wall, poses, 1.5).tolist() == [True, False, False]


def test_plan_has_the_frames_asked_for_on_free_connected_paths(furnished):
    collection = CollectionConfig(max_tries=300, frame_spacing_m=0.1, min_path_m=1.0)
    table = plan_split(furnished, ROOM, SCENE, collection, 500, np.random.default_rng(1))
    # Each path starts where the one before ended, so no step is longer than the spacing allows.
    steps = np.linalg.norm(np.diff(table.position_m, axis=0), axis=1)
    assert steps.max() < 0.1 * 1.05
    assert furnished.sees(table.position_m[:-1], table.position_m[1:]).all()
    for path in range(table.path.max()):  # the last path may be cut short
        inside = np.flatnonzero(table.path == path)
        np.testing.assert_allclose(np.ptp(steps[inside[:-1]]), 0.0, atol=1e-9)
        assert len(inside) >= 10
    assert (table.world_from_cam[:, 2, 1] < 0).all()  # world z of the camera's downward axis
    with pytest.raises(InputError, match="at least 1"):
        plan_split(furnished, ROOM, SCENE, collection, 0, np.random.default_rng(0))


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
    monkeypatch.setattr("synfeal.planning.path.BLOCK", block)
    collection = CollectionConfig(candidates=k, frame_spacing_m=SPACING_M, min_path_m=MIN_PATH_M)
    for seed in range(3):
        plan = plan_split(furnished, ROOM, SCENE, collection, 400, np.random.default_rng(seed))
        expected = round_by_round(furnished, k, 400, np.random.default_rng(seed))
        np.testing.assert_array_equal(plan.position_m, expected)


@pytest.mark.parametrize("tries", [1, 5, 1000])
def test_no_more_rounds_are_tried_than_allowed(tries):
    bounds, rng = pose_bounds(ROOM, Angles()), np.random.default_rng(0)
    stream = CandidateStream(PoseSpace(EMPTY, bounds, VIEW_M, rng), 2)
    start = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert stream.next_target(start, 50.0, tries) is None
    found = stream.next_target(start, 0.0, 1)
    drawn = sample_poses(bounds, 2 * (tries + 1), np.random.default_rng(0))
    assert found is None or (drawn[-2:] == found).all(axis=1).any()


def test_dead_end_names_the_place_and_what_to_relax(furnished):
    collection = CollectionConfig(max_tries=3, min_path_m=50.0)
    with pytest.raises(InputError, match=r"from \(.*\) in 3 rounds of 8 candidates"):
        plan_split(furnished, ROOM, SCENE, collection, 1, np.random.default_rng(0))
