"""Properties of batches, of chaining them and of their trajectories."""

import json
from itertools import pairwise

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from baselines.config.labels import EstimationConfig
from baselines.labels.batches import (
    BatchTrajectory,
    batches_of,
    failed_trajectory,
    read_trajectory,
    write_trajectory,
)
from baselines.labels.chain import (
    TruthUsed,
    chain_batches,
    chain_split,
    chain_unassisted,
    fill_gaps,
    summary_of,
    write_assistance,
)
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from tests.support.property_support import (
    few,
    fewer,
    poses,
    random_poses,
    relative_to_first,
    seeds,
    table_of,
)

CFG = EstimationConfig(batch_frames=4)


def batch_estimates(walk, batches, rng, noise_m):
    """Every batch's true motion, with some frames not registered and the others moved."""
    estimates = []
    for batch in batches:
        motion = relative_to_first(walk[batch.start : batch.stop])
        motion[1:, :3, 3] += noise_m * rng.normal(size=(len(batch) - 1, 3))
        registered = rng.random(len(batch)) < 0.7
        motion[~registered] = np.eye(4)
        estimates.append(BatchTrajectory(motion, registered))
    return estimates


@few
@given(st.integers(1, 400), st.integers(1, 60))
@example(1, 1)
def test_batches_share_one_frame_and_cover_the_split(n_frames, batch_frames):
    batches = batches_of(n_frames, batch_frames)
    assert [b.index for b in batches] == list(range(len(batches)))
    assert len(batches) == -(-(n_frames - 1) // batch_frames)
    assert sum(len(b) - 1 for b in batches) == n_frames - 1
    assert all(2 <= len(b) <= batch_frames + 1 for b in batches)
    for before, after in pairwise(batches):
        assert after.start == before.stop - 1
        assert len(before) == batch_frames + 1
    if batches:
        assert (batches[0].start, batches[-1].stop) == (0, n_frames)


@few
@given(seeds, st.lists(st.booleans(), min_size=1, max_size=9))
@example(0, [False])
@example(0, [True, False, False])
def test_filling_keeps_what_is_known_and_moves_evenly_between(seed, flags):
    motion, registered = relative_to_first(random_poses(seed, len(flags))), np.array(flags)
    filled = fill_gaps(BatchTrajectory(motion, registered))
    known = np.flatnonzero(registered | (np.arange(len(flags)) == 0))
    np.testing.assert_allclose(filled[known], motion[known], atol=1e-12)
    np.testing.assert_array_equal(filled[0], np.eye(4))
    for a, b in pairwise(known):
        steps = [np.linalg.inv(filled[k]) @ filled[k + 1] for k in range(a, b)]
        turns = Rotation.from_matrix([s[:3, :3] for s in steps]).as_rotvec()
        np.testing.assert_allclose(turns, np.tile(turns[0], (b - a, 1)), atol=1e-7)
        moved = np.diff(filled[a : b + 1, :3, 3], axis=0)
        np.testing.assert_allclose(moved, np.tile(moved[0], (b - a, 1)), atol=1e-12)
    np.testing.assert_array_equal(
        filled[known[-1] :], np.tile(filled[known[-1]], (len(flags) - known[-1], 1, 1))
    )


@few
@given(seeds, st.integers(1, 20), st.integers(1, 6), poses)
def test_perfect_batches_chain_to_the_truth_wherever_it_lies(seed, n_frames, batch_frames, world):
    walk = world @ random_poses(seed, n_frames)
    batches = batches_of(n_frames, batch_frames)
    truth, every = table_of(walk, path=np.arange(n_frames) // 3), np.ones
    estimates = [
        BatchTrajectory(relative_to_first(walk[b.start : b.stop]), every(len(b), dtype=bool))
        for b in batches
    ]
    labels, assistance = chain_batches(batches, estimates, truth, CFG)
    for table in (labels, chain_unassisted(batches, estimates, truth)):
        np.testing.assert_allclose(table.world_from_cam, walk, atol=1e-9)
        np.testing.assert_array_equal(table.frame, truth.frame)
        np.testing.assert_array_equal(table.path, truth.path)
    assert not any(record.assisted or record.filled or record.lost for record in assistance)


@few
@given(seeds, st.integers(2, 20), st.integers(1, 6), st.floats(0.0, 0.5))
def test_no_batch_starts_farther_off_than_the_thresholds_allow(seed, n_frames, size, noise_m):
    walk, batches = random_poses(seed, n_frames), batches_of(n_frames, size)
    truth = table_of(walk)
    estimates = batch_estimates(walk, batches, np.random.default_rng(seed), noise_m)
    labels, assistance = chain_batches(batches, estimates, truth, CFG)
    off_m = np.linalg.norm(labels.position_m - truth.position_m, axis=1)
    turns = Rotation.from_matrix(walk[:, :3, :3]).inv() * Rotation.from_matrix(
        labels.world_from_cam[:, :3, :3]
    )
    off_deg = np.degrees(turns.magnitude())
    assert off_m[0] < 1e-12
    for batch, estimate, record in zip(batches, estimates, assistance, strict=True):
        last = batch.stop - 1
        assert off_m[last] <= CFG.assist_position_m + 1e-9
        assert off_deg[last] <= CFG.assist_orientation_deg + 1e-6
        np.testing.assert_allclose(record.error_after_m, off_m[last], atol=1e-9)
        np.testing.assert_allclose(record.error_after_deg, off_deg[last], atol=1e-5)
        beyond = record.error_before_m > 0.2 or record.error_before_deg > 10.0
        assert record.lost == (not estimate.registered[1:].any())
        # Where the first frame is not registered, the truth placed another one.
        assert record.assisted == (record.lost or beyond or not estimate.registered[0])
        if record.assisted:
            np.testing.assert_allclose(off_m[last], 0.0, atol=1e-12)
        else:
            assert record.error_after_m == record.error_before_m
        assert record.filled == len(batch) - 1 - estimate.registered[1:].sum()
        assert record.registered == estimate.registered.sum()
        assert (record.index, record.start, record.stop) == (batch.index, batch.start, batch.stop)
    summary = summary_of(assistance)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert summary["batches"] == len(batches) == len(summary["records"])
    for total, part in (("assisted", "assisted"), ("lost", "lost"), ("filled_frames", "filled")):
        assert summary[total] == sum(record[part] for record in summary["records"])
    if summary["assisted"] == 0:
        unassisted = chain_unassisted(batches, estimates, truth)
        np.testing.assert_allclose(unassisted.position_m, labels.position_m, atol=1e-9)


@few
@given(seeds, st.lists(st.booleans(), min_size=1, max_size=6))
def test_trajectories_are_read_back_as_they_were_written(tmp_path_factory, seed, flags):
    path = tmp_path_factory.mktemp("trajectory") / "batch.csv"
    motion = relative_to_first(random_poses(seed, len(flags)))
    write_trajectory(path, BatchTrajectory(motion, np.array(flags)))
    found = read_trajectory(path)
    np.testing.assert_array_equal(found.registered, flags)
    np.testing.assert_array_equal(found.first_from_cam[:, :3, 3], motion[:, :3, 3])
    np.testing.assert_allclose(found.first_from_cam, motion, atol=1e-14)
    write_trajectory(path, failed_trajectory(len(flags)))
    nothing = read_trajectory(path)
    assert not nothing.registered.any()
    np.testing.assert_array_equal(nothing.first_from_cam, np.tile(np.eye(4), (len(flags), 1, 1)))


@fewer
@given(seeds, st.integers(2, 12))
def test_a_split_chained_from_files_is_that_chained_in_memory(tmp_path_factory, seed, n_frames):
    folder = tmp_path_factory.mktemp("split")
    walk, batches = random_poses(seed, n_frames), batches_of(n_frames, CFG.batch_frames)
    truth = table_of(walk)
    estimates = batch_estimates(walk, batches, np.random.default_rng(seed), 0.1)
    files = [folder / f"{batch.index}.csv" for batch in batches]
    for file, estimate in zip(files, estimates, strict=True):
        write_trajectory(file, estimate)
    write_pose_table(folder / "truth.csv", truth)
    paths = folder / "truth.csv", folder / "labels.csv", folder / "unassisted.csv"
    assistance = chain_split(files, *paths, CFG)
    labels, expected = chain_batches(batches, estimates, truth, CFG)
    unassisted = chain_unassisted(batches, estimates, truth)
    for path, table in zip(paths[1:], (labels, unassisted), strict=True):
        np.testing.assert_allclose(read_pose_table(path).position_m, table.position_m, atol=1e-12)
    assert [r.assisted for r in assistance] == [r.assisted for r in expected]
    splits = {"train": assistance, "test": assistance}
    write_assistance(folder / "a.json", "sfm", splits, TruthUsed.CAMERA)
    written = json.loads((folder / "a.json").read_text())
    same = summary_of(assistance)
    assert written == {
        "method": "sfm",
        "truth_used": "first pose and 44 distances",
        "splits": {"train": same, "test": same},
    }
