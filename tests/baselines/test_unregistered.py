"""Frames that no method registered: their labels are filled in, and nothing is trained on them."""

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from pydantic import validate_call

from baselines.labels.batches import BatchTrajectory, batches_of, write_trajectory
from baselines.labels.chain import TruthUsed, chain_batches, chain_unassisted, write_label_set
from baselines.labels.methods import truth_used
from baselines.references.adjustment import placed_on
from baselines.references.correspondences import Tracks
from baselines.references.interpolated import by_interpolation
from baselines.references.retrieval import nearest_label, nearest_pose
from baselines.references.structure import lifted, triangulate
from baselines.training.data import read_labelled_frames
from reproduction.config.load import load_config
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from tests.baselines.test_references import BESIDE, seen
from tests.reproduction.test_label_error import BATCH, CFG, drifting, straight
from tests.support.colored_frames import CPU, PX, write_split
from tests.support.property_support import random_table, table_of

REPOSITORY = Path(__file__).parents[2]
LOST = np.array([2, 3, 7])


def labelled(count):
    """Labels of which three are not registered."""
    table = random_table(count, np.random.default_rng(0))
    return replace(table, registered=np.isin(np.arange(count), LOST, invert=True))


def test_labels_say_which_frames_their_method_found():
    truth = table_of(straight(2 * BATCH + 1))
    batches = batches_of(len(truth), BATCH)
    first, second = drifting(batches, 0.0)
    first.registered[[4, 5]] = second.registered[[0, 10]] = False
    expected = np.ones(len(truth), dtype=bool)
    # The first frame of the second batch is the last of the first, which found it.
    expected[[4, 5, 20]] = False
    labels, _ = chain_batches(batches, [first, second], truth, CFG)
    for table in (labels, chain_unassisted(batches, [first, second], truth)):
        np.testing.assert_array_equal(table.registered, expected)


def test_flags_are_read_back_with_and_without_names_of_images(tmp_path):
    table = labelled(12)
    for images in ((), [f"{frame}.png" for frame in range(12)]):
        write_pose_table(tmp_path / "t.csv", table, images)
        found = read_pose_table(tmp_path / "t.csv")
        np.testing.assert_array_equal(found.registered, table.registered)
        np.testing.assert_array_equal(found.position_m, table.position_m)
        np.testing.assert_array_equal(found.usable_rows, [0, 1, 4, 5, 6, 8, 9, 10, 11])
        np.testing.assert_array_equal(found.first(5).usable_rows, [0, 1, 4])
    write_pose_table(tmp_path / "t.csv", random_table(12, np.random.default_rng(0)))
    assert read_pose_table(tmp_path / "t.csv").registered is None
    assert len(read_pose_table(tmp_path / "t.csv").usable_rows) == 12


def test_a_flag_that_is_none_is_refused(tmp_path):
    path = tmp_path / "t.csv"
    write_pose_table(path, labelled(3))
    path.write_text(path.read_text().replace(",0\n", ",2\n"))
    with pytest.raises(InputError, match=r"t\.csv: row 4: registered must be 0 or 1"):
        read_pose_table(path)


def test_training_sees_the_registered_frames_and_their_own_images(tmp_path):
    frames, labels = write_split(tmp_path, "train", 12, 0)
    every = read_labelled_frames(frames, labels, PX, CPU)
    table = read_pose_table(labels)
    rows = np.setdiff1d(np.arange(12), LOST)
    flags = np.isin(np.arange(12), rows)
    position_m = table.position_m.copy()
    position_m[LOST] = 1e6  # what was filled in may be anything
    write_pose_table(labels, replace(table, registered=flags, position_m=position_m))
    known = read_labelled_frames(frames, labels, PX, CPU)
    assert len(known) == 9
    every_index, known_index = np.arange(12)[rows], np.arange(9)
    for name, wanted in every.batch(every.rows[every_index])._asdict().items():
        found = getattr(known.batch(known.rows.new_tensor(known_index)), name)
        np.testing.assert_array_equal(found, wanted)
    np.testing.assert_array_equal(known.path, every.path[rows])
    write_pose_table(labels, replace(table, registered=np.zeros(12, dtype=bool)))
    with pytest.raises(InputError, match=r"train\.csv: no frame is registered"):
        read_labelled_frames(frames, labels, PX, CPU)


def test_the_nearest_image_is_one_that_was_registered():
    """Each test image is a training image; where that one is lost, the next most alike answers."""
    table = labelled(12)
    angle = np.linspace(0, 1, 12)
    vectors = np.column_stack([np.cos(angle), np.sin(angle)]).astype(np.float32)
    evidence = SimpleNamespace(
        train=table, descriptors={"d": (vectors, vectors)}, preparing=nullcontext
    )
    found = nearest_label(evidence, "d")[:, :3, 3]
    known = np.setdiff1d(np.arange(12), LOST)
    np.testing.assert_array_equal(found[known], table.position_m[known])
    np.testing.assert_array_equal(found[2], table.position_m[1])
    np.testing.assert_array_equal(found[3], table.position_m[4])


def test_the_nearest_pose_is_one_that_was_registered(tmp_path):
    """Each test pose is a training pose; where that one is lost, its neighbour answers."""
    table = labelled(12)
    along = np.column_stack([np.arange(12.0), np.zeros((12, 2))])
    level = np.tile([1.0, 0, 0, 0], (12, 1))
    truth = replace(table, position_m=along, quat_wxyz=level, registered=None)
    write_pose_table(tmp_path / "truth.csv", truth)
    files = dict.fromkeys(("train_truth", "test_truth"), tmp_path / "truth.csv")
    found = nearest_pose(SimpleNamespace(train=table, files=files))[:, :3, 3]
    known = np.setdiff1d(np.arange(12), LOST)
    np.testing.assert_array_equal(found[known], table.position_m[known])
    np.testing.assert_array_equal(found[[2, 3]], table.position_m[[1, 4]])


def test_labels_that_were_filled_in_have_no_part_in_interpolated_poses():
    """Each test image is a training image; what was filled in is far away from all of them."""
    table = labelled(12)
    far = table.position_m.copy()
    far[LOST] = 1e6
    vectors = np.linalg.qr(np.random.default_rng(1).normal(size=(12, 12)))[0].astype(np.float32)
    evidence = SimpleNamespace(
        train=replace(table, position_m=far),
        descriptors={"vlad": (vectors, vectors)},
        preparing=nullcontext,
    )
    found = by_interpolation(evidence)[:, :3, 3]
    known = np.setdiff1d(np.arange(12), LOST)
    np.testing.assert_allclose(found[known], table.position_m[known], atol=0.01)
    assert np.abs(found[LOST]).max() < np.abs(table.position_m).max() + 1


def test_depth_of_a_frame_that_was_not_registered_lifts_nothing():
    train = np.arange(12)
    matches = SimpleNamespace(train=train, point_m=np.ones((12, 3)))
    known = np.isfinite(lifted(matches, labelled(12))).all(axis=1)
    np.testing.assert_array_equal(np.flatnonzero(~known), LOST)


def test_points_are_where_the_registered_frames_see_them():
    """Wrong poses of frames that were not registered move no point."""
    poses = np.stack(BESIDE)
    point_m = np.array([3.0, 0, 1.3]) + np.random.default_rng(0).uniform(-1, 1, (20, 3))
    tracks = seen(poses, point_m)
    wrong = poses.copy()
    wrong[1, :3, 3] += 2.0
    rows = np.setdiff1d(np.arange(len(poses)), [1])
    np.testing.assert_allclose(triangulate(tracks.seen_by(rows), wrong), point_m, atol=1e-6)
    assert np.nanmax(np.abs(triangulate(tracks, wrong) - point_m)) > 0.01
    alone = tracks.seen_by(np.array([0]))
    assert np.isnan(triangulate(alone, poses)).all()
    assert (alone.of_feature == -1).all()


def test_a_track_without_enough_views_shows_no_feature():
    frame, track = np.array([0, 1, 2, 1, 2]), np.array([0, 0, 0, 1, 1])
    tracks = Tracks(frame, np.zeros((5, 2)), track, np.array([0, 1, -1, 0]))
    kept = tracks.seen_by(np.array([0, 2]))
    np.testing.assert_array_equal(kept.frame, [0, 2, 2])
    np.testing.assert_array_equal(kept.of_feature, [0, -1, -1, 0])


def test_an_adjusted_map_is_placed_by_registered_labels_alone():
    found = table_of(straight(30)).world_from_cam
    found[:, 1, 3] = np.sin(np.arange(30))
    labels = found.copy()
    labels[:20, :3, 3] += 5.0  # the majority, but not registered
    np.testing.assert_allclose(placed_on(found, labels, np.arange(20, 30)), found, atol=1e-9)
    assert np.abs(placed_on(found, labels) - found).max() > 1


def test_anchored_batches_do_not_pass_their_drift_on():
    """Each batch ends 5 cm off; chained by their ends they would end 5, 10, 15 and 20 cm off."""
    truth = table_of(straight(4 * BATCH + 1))
    batches = batches_of(len(truth), BATCH)
    trajectories = drifting(batches, 0.05)
    labels, records = chain_batches(batches, trajectories, truth, CFG, anchored=True)
    alone = chain_unassisted(batches, trajectories, truth, anchored=True)
    drift_m = np.tile(np.linspace(0, 0.05, BATCH + 1)[1:], 4)
    for table in (labels, alone):
        off_m = table.position_m - truth.position_m
        np.testing.assert_allclose(off_m[1:, 1], drift_m, atol=1e-12)
        np.testing.assert_allclose(off_m[:, [0, 2]], 0, atol=1e-12)
    np.testing.assert_allclose([record.error_before_m for record in records], 0.05)


def test_an_anchored_batch_stands_where_its_gauge_puts_it_but_for_its_shared_frame():
    truth = table_of(straight(BATCH + 1))
    poses = straight(BATCH + 1)
    poses[:, 2, 3] += 0.03  # its gauge does not hang on the first camera
    batches = batches_of(len(truth), BATCH)
    estimate = BatchTrajectory(poses, np.ones(BATCH + 1, dtype=bool))
    labels, records = chain_batches(batches, [estimate], truth, CFG, anchored=True)
    np.testing.assert_allclose(labels.position_m[1:, 2], 0.03)
    np.testing.assert_array_equal(labels.position_m[0], truth.position_m[0])
    assert records[0].error_after_m == pytest.approx(0.03)


@pytest.mark.parametrize("used", list(TruthUsed))
def test_a_label_set_says_which_truth_placed_its_batches(tmp_path, used):
    """As a rule calls it: with the text of the configuration."""
    truth = table_of(straight(2 * BATCH + 1))
    write_pose_table(tmp_path / "truth.csv", truth)
    files = [tmp_path / "0.csv", tmp_path / "1.csv"]
    for file, estimate in zip(files, drifting(batches_of(len(truth), BATCH), 0.05), strict=True):
        write_trajectory(file, estimate)
    names = ("train", "test", "train_unassisted", "test_unassisted", "assistance", "record")
    validate_call(write_label_set)(
        reconstructed="sfm",
        train_batches=files,
        test_batches=files,
        train_truth=tmp_path / "truth.csv",
        test_truth=tmp_path / "truth.csv",
        estimation=CFG,
        truth_used=str(used),
        parameters={},
        **{f"out_{name}": tmp_path / f"{name}.out" for name in names},
    )
    assert json.loads((tmp_path / "assistance.out").read_text())["truth_used"] == str(used)
    off_m = read_pose_table(tmp_path / "train.out").position_m - truth.position_m
    assert off_m[-1, 1] == pytest.approx(0.05 if used == "first 44 poses" else 0.1)


def test_the_gauge_decides_which_truth_sfm_uses():
    given = load_config(REPOSITORY / "config/config.yaml").estimation
    assert truth_used(given, "sfm") == "first 44 poses"
    assert truth_used(given, "rgbd-toro") == truth_used(given, "kinect-fusion") == "none"
    sfm = given.sfm.model_copy(update={"gauge": "first_camera"})
    by_camera = given.model_copy(update={"sfm": sfm})
    assert truth_used(by_camera, "sfm") == "first pose and 44 distances"
