"""Planning against closed forms and a naive twin; poses that are repeated from files."""

import logging

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import ks_2samp

from synfeal.config.collection import Angles, Box, CollectionConfig
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error
from synfeal.planning.path import path_poses, poses_of
from synfeal.planning.plan import box_array, plan_split
from synfeal.planning.repeat import read_poses, repeated_poses
from synfeal.planning.space import (
    PoseSpace,
    admissible,
    pose_bounds,
    sample_poses,
    sample_start,
    view_directions,
)
from tests.support.empty_room import EMPTY, ROOM, SCENE, caster_of, pose_vectors
from tests.support.property_support import few, vectors

pytestmark = pytest.mark.portable

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
    fewer = sample_poses(bounds, 40, np.random.default_rng(0))
    np.testing.assert_array_equal(fewer, poses[:40])


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


@pytest.mark.parametrize("n_frames", [5, 8, 60, 400])
def test_test_frames_are_every_kth_of_the_paths_that_all_frames_would_be(furnished, n_frames):
    """The paths are those of the plan without a bound: so none is planned differently."""
    whole = CollectionConfig(max_tries=300, frame_spacing_m=0.05, min_path_m=1.0)
    spread = whole.model_copy(update={"test_paths": 8})

    def planned(collection, count, split="test"):
        rng = np.random.default_rng(3)
        return plan_split(furnished, ROOM, SCENE, collection, count, rng, split)

    table, full = planned(spread, n_frames), planned(whole, 4000)
    assert len(table) == n_frames
    assert len(np.unique(table.path)) >= min(8, n_frames)
    distance_m = np.linalg.norm(table.position_m[:, None] - full.position_m, axis=2)
    place = distance_m.argmin(axis=1)
    np.testing.assert_array_equal(full.world_from_cam[place], table.world_from_cam)
    np.testing.assert_array_equal(full.path[place], table.path)
    assert len(np.unique(np.diff(place))) == 1  # one stride throughout
    train = planned(spread, n_frames, "train")
    np.testing.assert_array_equal(train.position_m, full.position_m[:n_frames])


def _distance_and_yaw(table):
    """Distance from the middle of the room's box, as its share, and yaw of the camera (N,)."""
    middle, half = ROOM.mean(axis=0), np.ptp(ROOM, axis=0) / 2
    distance = (np.abs(table.position_m - middle) / half).max(axis=1)
    forward = table.world_from_cam[:, :3, 2]
    return distance, np.arctan2(forward[:, 1], forward[:, 0])


def test_test_frames_have_the_positions_and_headings_of_training_frames():
    """Two-sample tests over the frames of many paths.

    The first frames of paths fail it: where a path begins is a waypoint, drawn anywhere in the box,
    and a way between two waypoints is nearer to its middle.
    """
    spread = CollectionConfig(frame_spacing_m=0.05, min_path_m=1.5, test_paths=400)
    train, test = (
        plan_split(EMPTY, ROOM, SCENE, spread, n_frames, np.random.default_rng(seed), split)
        for seed, split, n_frames in ((0, "train", 40_000), (1, "test", 4000))
    )
    assert len(np.unique(test.path)) >= 400
    first = np.concatenate([np.flatnonzero(train.path == path)[:10] for path in range(400)])
    drawn = np.random.default_rng(2)

    def chances(a, b):
        # A frame of every fourth path: those of one path, or of two in a row, share waypoints.
        few = [t.at(np.sort(drawn.choice(len(t), 100, replace=False))) for t in (a, b)]
        shares = zip(*map(_distance_and_yaw, few), strict=True)
        return [ks_2samp(*pair).pvalue for pair in shares]

    assert min(chances(test, train)) > 0.05
    assert chances(train.at(first), train)[0] < 1e-4


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


def test_dead_end_names_the_place_and_what_to_relax(furnished):
    collection = CollectionConfig(max_tries=3, min_path_m=50.0)
    with pytest.raises(InputError, match=r"from \(.*\) in 3 rounds of 8 candidates"):
        plan_split(furnished, ROOM, SCENE, collection, 1, np.random.default_rng(0))


@pytest.mark.parametrize("seed", range(1, 9))
def test_no_path_ends_where_none_leads_on(furnished, seed):
    """So few tries that many places are dead ends: each is passed over."""
    collection = CollectionConfig(candidates=1, max_tries=20, frame_spacing_m=0.25, min_path_m=2.0)

    def planned(n_frames):
        rng = np.random.default_rng(seed)
        return plan_split(furnished, ROOM, SCENE, collection, n_frames, rng)

    table = planned(600)
    ends = table.position_m[np.flatnonzero(np.diff(table.path))]
    assert len(ends) > 20
    assert (np.linalg.norm(np.diff(ends, axis=0), axis=1) >= 2.0).all()
    assert furnished.sees(ends[:-1], ends[1:]).all()
    for n_frames in (1, 37, 300):  # a plan that stops at a dead end is no other than a longer one
        np.testing.assert_array_equal(planned(n_frames).position_m, table.position_m[:n_frames])


def test_planning_ends_where_every_target_is_a_dead_end(furnished, monkeypatch):
    monkeypatch.setattr("synfeal.planning.plan.MOST_DEAD_ENDS", 1)
    collection = CollectionConfig(candidates=1, max_tries=20, frame_spacing_m=0.25, min_path_m=2.0)
    with pytest.raises(InputError, match=r"from \(.*\) in 20 rounds of 1 candidates"):
        plan_split(furnished, ROOM, SCENE, collection, 600, np.random.default_rng(1))


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
@given(pose_vectors, pose_vectors, st.floats(0.5, 20.0), st.sampled_from(["rpy", "slerp"]))
@example(np.zeros(6), np.zeros(6), 1.0, "slerp")
@example(np.zeros(6), np.array([0.0, 0, 0, 0, 0, np.pi]), 1.0, "rpy")
@example(np.array([0.0, 0, 0, 0, 0, 3.0]), np.array([9.0, 0, 0, 0, 0, -3.0]), 1.0, "rpy")
def test_frames_of_a_path_are_even_on_the_line_to_the_target(start, target, spacing_m, how):
    found = path_poses(start, target, spacing_m, how)
    steps = np.linalg.norm((target - start)[:3]) / spacing_m
    assert len(found) == 1 or abs(len(found) - steps) <= 0.5 + 1e-9
    assert steps < 1.5 + 1e-9 or len(found) > 1
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
        return
    # Roll, pitch and yaw each go in equal steps, the short way round.
    around = np.mod((target - start)[3:] + np.pi, 2 * np.pi) - np.pi
    vectors_ = np.column_stack([expected_m, start[3:] + fraction * around])
    off = np.abs(np.abs(around) - np.pi) < 1e-9  # half a turn, either way
    if not off.any():
        np.testing.assert_allclose(found, poses_of(vectors_), atol=1e-9)


def some_poses(count=6):
    rng = np.random.default_rng(4)
    quat = Rotation.random(count, random_state=rng).as_quat(canonical=True, scalar_first=True)
    position = rng.uniform(ROOM[0], ROOM[1], (count, 3))
    return PoseTable(np.arange(count), np.arange(count) // 2, position, quat)


def as_csv(folder, table):
    write_pose_table(folder / "poses.csv", table)
    return folder / "poses.csv"


def as_collected(folder, table):
    write_pose_table(folder / "train.csv", table)
    return folder


def as_frames(folder, table):
    for index, pose in enumerate(table.world_from_cam):
        np.savetxt(folder / f"frame-{index:06d}.pose.txt", pose)
    return folder


def as_sequences(folder, table):
    for number, half in enumerate((slice(0, 4), slice(4, 6)), 1):
        (folder / f"seq-{number:02d}").mkdir()
        for index, pose in enumerate(table.world_from_cam[half]):
            np.savetxt(folder / f"seq-{number:02d}" / f"frame-{index:06d}.pose.txt", pose)
    (folder / "TrainSplit.txt").write_text("sequence1\nsequence2\n")
    (folder / "TestSplit.txt").write_text("sequence2\n")
    return folder


def as_tum(folder, table):
    lines = ["# timestamp tx ty tz qx qy qz qw"]
    for time, (at, (w, *xyz)) in enumerate(zip(table.position_m, table.quat_wxyz, strict=True)):
        numbers = [time / 30, *at, *(-np.array(xyz)), -w]  # the same rotation
        lines += [" ".join(map(repr, map(float, numbers))), ""]
    (folder / "trajectory.txt").write_text("\n".join(lines))
    return folder / "trajectory.txt"


@pytest.mark.parametrize(
    ("store", "paths"),
    [
        (as_csv, [0, 0, 1, 1, 2]),
        (as_collected, [0, 0, 1, 1, 2]),
        (as_frames, [0] * 5),
        (as_sequences, [0, 0, 0, 0, 1]),
        (as_tum, [0] * 5),
    ],
)
def test_poses_are_repeated_whatever_they_are_stored_as(store, paths, tmp_path):
    table = some_poses()
    collection = CollectionConfig(mode="repeat", repeat=store(tmp_path, table))
    narrow = np.array([[0.0, 0.0, 0.0], [0.1, 0.1, 0.1]])  # sampling plays no part
    found = plan_split(EMPTY, narrow, SCENE, collection, 5, np.random.default_rng(0))
    np.testing.assert_array_equal(found.frame, np.arange(5))
    np.testing.assert_array_equal(found.path, paths)
    position_m, angle_rad = pose_error(found.world_from_cam, table.world_from_cam[:5])
    assert position_m.max() < 1e-9
    assert angle_rad.max() < 1e-7
    assert (found.quat_wxyz[:, 0] >= 0.0).all()


def test_splits_are_those_of_the_data_set(tmp_path):
    found = read_poses(as_sequences(tmp_path, some_poses()), "test")
    np.testing.assert_allclose(found.position_m, some_poses().position_m[4:], atol=1e-9)


@pytest.mark.parametrize("store", [as_csv, as_frames, as_tum])
def test_one_list_of_poses_is_no_test_split(store, tmp_path):
    with pytest.raises(InputError, match=r"train\.csv and test\.csv"):
        read_poses(store(tmp_path, some_poses()), "test")


def test_poses_outside_the_mesh_are_a_warning(tmp_path, caplog):
    source = as_csv(tmp_path, some_poses())
    with caplog.at_level(logging.WARNING, "synfeal"):
        repeated_poses(source, "train", 6, ROOM)
        assert not caplog.records
        repeated_poses(source, "train", 6, ROOM * 0.0)
    assert "6 of 6 poses lie outside" in caplog.text
    with pytest.raises(InputError, match="are asked for"):
        repeated_poses(source, "train", 7, ROOM)
