"""Planning: sampling, target selection and straight paths against closed forms and a naive twin."""

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from synfeal.config.models import Angles, Box, CollectionConfig
from synfeal.dataset.pose_table import write_pose_table
from synfeal.errors import InputError
from synfeal.planning.path import (
    CandidateStream,
    n_frames_of,
    path_poses,
    path_vectors,
    poses_of,
    step_of,
)
from synfeal.planning.plan import box_array, plan_split
from synfeal.planning.repeat import read_poses, repeated_poses
from synfeal.planning.space import (
    PoseSpace,
    admissible,
    has_free_view,
    pose_bounds,
    sample_poses,
    view_directions,
)
from synfeal.planning.start import sample_start
from tests.empty_room import BOUNDS, EMPTY, ROOM, SCENE, caster_of, pose_vectors
from tests.property_support import few, poses, seeds, table_of, vectors

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


@few
@given(vectors(50.0), vectors(50.0), st.tuples(*[st.floats(-90, 0)] * 3), st.floats(0, 90))
def test_bounds_are_the_box_and_the_angles_in_radians(a, b, low, width):
    box = np.sort([a, b], axis=0)
    assume((box[0] < box[1]).all())
    configured = Box(**dict(zip("xyz", box.T.tolist(), strict=True)))
    np.testing.assert_array_equal(box_array(configured), box)
    intervals = [(value, value + width) for value in low]
    names = ("roll_deg", "pitch_deg", "yaw_deg")
    angles = Angles.model_construct(**dict(zip(names, intervals, strict=True)))
    bounds = pose_bounds(box, angles)
    np.testing.assert_array_equal(bounds[:, :3], box)
    np.testing.assert_allclose(bounds[:, 3:] * 180 / np.pi, np.transpose(intervals), atol=1e-12)


@few
@given(seeds, st.integers(0, 40), st.integers(0, 40))
def test_samples_lie_within_bounds_and_fewer_are_a_prefix_of_more(seed, count, more):
    found = sample_poses(BOUNDS, count, np.random.default_rng(seed))
    assert found.shape == (count, 6)
    assert ((found >= BOUNDS[0]) & (found <= BOUNDS[1])).all()
    longer = sample_poses(BOUNDS, count + more, np.random.default_rng(seed))
    np.testing.assert_array_equal(longer[:count], found)


@few
@given(st.lists(pose_vectors, min_size=1, max_size=4))
def test_poses_look_where_their_pitch_and_yaw_say(listed):
    given_vectors = np.array(listed)
    found = poses_of(given_vectors)
    np.testing.assert_array_equal(found[:, :3, 3], given_vectors[:, :3])
    body = Rotation.from_euler("ZYX", given_vectors[:, :2:-1])
    for camera_axis, body_axis in ((2, [1, 0, 0]), (0, [0, -1, 0]), (1, [0, 0, -1])):
        np.testing.assert_allclose(found[:, :3, camera_axis], body.apply(body_axis), atol=1e-14)
    np.testing.assert_allclose(view_directions(given_vectors), body.apply([1, 0, 0]), atol=1e-14)


@few
@given(pose_vectors, pose_vectors, st.floats(1e-3, 10.0))
@example(np.zeros(6), np.zeros(6), 0.1)
def test_number_of_frames_is_the_distance_over_the_spacing(start, target, spacing_m):
    count = n_frames_of(start, target, spacing_m)
    steps = np.sqrt(((target - start)[:3] ** 2).sum()) / spacing_m
    assert isinstance(count, int)
    assert count == 1 or abs(count - steps) <= 0.5 + 1e-9
    assert steps < 1.5 + 1e-9 or count > 1


@few
@given(pose_vectors, pose_vectors, st.integers(1, 50))
@example(np.zeros(6), np.array([0.0, 0, 0, 0, 0, np.pi]), 1)
@example(np.array([0.0, 0, 0, 0, 0, 3.0]), np.array([0.0, 0, 0, 0, 0, -3.0]), 2)
def test_steps_are_equal_and_lead_to_the_target_the_short_way_round(start, target, count):
    before = start.copy(), target.copy()
    step = step_of(start, target, count)
    found = path_vectors(start, target, count)
    np.testing.assert_allclose(
        found - np.vstack([start, found[:-1]]), np.tile(step, (count, 1)), atol=1e-12
    )
    np.testing.assert_allclose(found[-1, :3], target[:3], atol=1e-11)
    full_turns = (found[-1, 3:] - target[3:]) / (2 * np.pi)
    np.testing.assert_allclose(full_turns, np.round(full_turns), atol=1e-12)
    assert (np.abs(count * step[3:]) <= np.pi + 1e-12).all()
    np.testing.assert_array_equal(start, before[0])
    np.testing.assert_array_equal(target, before[1])


@few
@given(pose_vectors, pose_vectors, st.floats(0.5, 20.0), st.sampled_from(["rpy", "slerp"]))
@example(np.zeros(6), np.zeros(6), 1.0, "slerp")
def test_frames_of_a_path_are_even_on_the_line_to_the_target(start, target, spacing_m, how):
    found = path_poses(start, target, spacing_m, how)
    fraction = np.arange(1, len(found) + 1)[:, None] / len(found)
    expected_m = start[:3] + fraction * (target - start)[:3]
    np.testing.assert_allclose(found[:, :3, 3], expected_m, atol=1e-11)
    np.testing.assert_allclose(found[-1], poses_of(target[None])[0], atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(found[:, :3, :3]), 1.0, atol=1e-12)
    if how == "slerp":  # at constant speed
        turns = Rotation.from_matrix(found[:-1, :3, :3]).inv() * Rotation.from_matrix(
            found[1:, :3, :3]
        )
        assert len(found) == 1 or np.ptp(turns.magnitude()) < 1e-6


@few
@given(st.lists(poses, min_size=1, max_size=5))
def test_poses_are_read_back_as_they_were_written(tmp_path_factory, listed):
    folder = tmp_path_factory.mktemp("poses")
    table = table_of(listed, path=np.arange(len(listed)) // 2)
    write_pose_table(folder / "poses.csv", table)
    found = read_poses(folder / "poses.csv", "train")
    np.testing.assert_array_equal(found.position_m, table.position_m)
    np.testing.assert_array_equal(found.quat_wxyz, table.quat_wxyz)
    np.testing.assert_array_equal(found.path, table.path)
    world = np.array([[-100.0] * 3, [100.0] * 3])
    first = repeated_poses(folder / "poses.csv", "train", 1, world)
    np.testing.assert_array_equal(first.position_m, table.position_m[:1])
    with pytest.raises(InputError, match="are asked for"):
        repeated_poses(folder / "poses.csv", "train", len(listed) + 1, world)
