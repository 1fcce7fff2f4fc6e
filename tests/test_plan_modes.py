"""Modes of collection: independent poses, and the poses of an earlier data set."""

import logging

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from synfeal.config.models import CollectionConfig
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error
from synfeal.planning.plan import plan_split
from synfeal.planning.repeat import read_poses, repeated_poses
from tests.empty_room import EMPTY, ROOM, caster_of
from tests.empty_room import SCENE as EMPTY_SCENE

# A wall with a door leaves the last 2 m of the room, and a cupboard shuts off a corner.
WALL = [[1.0, -1.5, 0.0], [1.1, 2.0, 2.5]]
CUPBOARD = np.array([[-3.0, -2.0, 0.0], [-1.5, -0.5, 2.5]])
SCENE = EMPTY_SCENE.model_copy(update={"min_view_distance_m": 0.8})


@pytest.fixture(scope="module")
def flat():
    return caster_of(ROOM, WALL, CUPBOARD)


def random_plan(caster, n_frames, seed=0, **values):
    collection = CollectionConfig.model_validate({"mode": "random", **values})
    return plan_split(caster, ROOM, SCENE, collection, n_frames, np.random.default_rng(seed))


def test_random_poses_have_a_free_view_in_the_connected_space(flat):
    plan = random_plan(flat, 3000)
    np.testing.assert_array_equal(plan.frame, np.arange(3000))
    np.testing.assert_array_equal(plan.path, np.arange(3000))  # no two are of one path
    view_m = flat.first_hit_m(plan.position_m, plan.world_from_cam[:, :3, 2])
    assert ((view_m > 0.8) & np.isfinite(view_m)).all()
    at = plan.position_m
    assert not ((at > CUPBOARD[0]) & (at < CUPBOARD[1])).all(axis=1).any()
    assert np.mean(at[:, 0] > 1.1) > 0.1  # beyond the door too: one space, not one convex part


def test_random_poses_are_uniform_where_all_views_are_free():
    box = np.array([[-1.0, -0.5, 1.0], [1.0, 0.5, 1.5]])  # at least 1 m from every wall
    scene = SCENE.model_copy(update={"min_view_distance_m": 0.5})
    random = CollectionConfig(mode="random")
    plan = plan_split(EMPTY, box, scene, random, 5000, np.random.default_rng(3))
    share = (plan.position_m - box[0]) / (box[1] - box[0])
    assert min(kstest(share[:, axis], "uniform").pvalue for axis in range(3)) > 0.01
    step = np.linalg.norm(np.diff(plan.position_m, axis=0), axis=1)
    assert np.median(step) > 0.5  # neighbours in the list are no neighbours in space


def test_random_plans_are_prefixes_and_repeatable_whatever_the_round(flat):
    longer = random_plan(flat, 500).position_m
    np.testing.assert_array_equal(random_plan(flat, 100).position_m, longer[:100])
    np.testing.assert_array_equal(random_plan(flat, 500, candidates=1).position_m, longer)
    assert not np.array_equal(random_plan(flat, 100, seed=1).position_m, longer[:100])


def test_nothing_admissible_ends_in_one_line(flat):
    scene = SCENE.model_copy(update={"min_view_distance_m": 50.0})
    collection = CollectionConfig(mode="random", max_tries=50)
    with pytest.raises(InputError, match="min_view_distance_m"):
        plan_split(flat, ROOM, scene, collection, 10, np.random.default_rng(0))


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
def test_poses_are_repeated_whatever_they_are_stored_as(store, paths, tmp_path, flat):
    table = some_poses()
    collection = CollectionConfig(mode="repeat", repeat=store(tmp_path, table))
    narrow = np.array([[0.0, 0.0, 0.0], [0.1, 0.1, 0.1]])  # sampling plays no part
    found = plan_split(flat, narrow, SCENE, collection, 5, np.random.default_rng(0))
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
