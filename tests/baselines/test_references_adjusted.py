"""Bundle adjustment of a map against images that are exact."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from baselines.labels.injected import add_noise
from baselines.references.adjustment import adjust, adjusted, errors_px, placed_on
from baselines.references.correspondences import Correspondences
from baselines.references.evidence import Evidence
from baselines.references.run import answer_externally, read_answers, run_external
from baselines.references.structure import pinhole, triangulate, triangulated
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, pose_matrix, umeyama_sim3
from tests.baselines.test_references import BESIDE, frames, seen
from tests.support.property_support import random_table, table_of
from tests.support.room_scene import CAMERA, pose_at

POSES = np.stack(BESIDE)
TEST = np.stack([pose_at([0.1, -0.4, 1.2], 4.0), pose_at([0.2, 0.3, 1.4], -3.0), POSES[0]])


def points(count=60):
    rng = np.random.default_rng(0)
    return np.array([3.0, 0, 1.3]) + rng.uniform(-1, 1, (count, 3))


def noisy(noise_m, noise_deg):
    return add_noise(table_of(POSES), noise_m, noise_deg, np.random.default_rng(1))


def slopes(poses, point_m):
    """Slopes (N, T, 2) under which poses see points."""
    return seen(poses, point_m).slope.reshape(len(poses), -1, 2)


def off_px(tracks, poses):
    """Root mean square over all observations of how far the points they meet in are off."""
    point_m = triangulate(tracks, poses)
    found = slopes(poses, point_m).reshape(-1, 2)
    off = pinhole(CAMERA).params[0] * np.linalg.norm(found - tracks.slope, axis=1)
    np.testing.assert_allclose(errors_px(tracks, poses, point_m, pinhole(CAMERA)), off, atol=1e-9)
    return np.sqrt(np.square(off).mean())


@pytest.mark.parametrize(("noise_m", "noise_deg"), [(0.02, 0.5), (0.1, 5.0)])
def test_adjustment_takes_noise_back(noise_m, noise_deg):
    """Noisy poses of exact images fit them again, up to where, how turned and how large."""
    tracks, labels = seen(POSES, points()), noisy(noise_m, noise_deg).world_from_cam
    found = adjust(tracks, labels, triangulate(tracks, labels), pinhole(CAMERA))
    assert off_px(tracks, found) < 0.05 < 1 < off_px(tracks, labels)
    position_m, angle_rad = pose_error(placed_on(found, POSES), POSES)
    assert position_m.max() < 0.05 * noise_m
    assert np.degrees(angle_rad).max() < 0.2 * noise_deg  # the centres are nearly on a line


def test_the_map_stays_where_the_labels_are():
    """Labels of another world give the adjusted poses of that world; exact ones stay exact."""
    tracks = seen(POSES, points())
    moved = pose_at([4.0, -7.0, 0.5], 70.0, 20.0)
    for world in (np.eye(4), moved):
        labels = world @ POSES
        found = adjust(tracks, labels, triangulate(tracks, labels), pinhole(CAMERA))
        np.testing.assert_allclose(placed_on(found, labels), labels, atol=1e-4)
        lost = labels.copy()
        lost[5, :3, 3] += 3.0  # one label that is wrong by metres has no say
        np.testing.assert_allclose(placed_on(found, lost), labels, atol=1e-3)


def test_a_frame_that_sees_nothing_keeps_its_label():
    labels = noisy(0.02, 0.5).world_from_cam
    tracks = seen(POSES, points())
    blind = tracks.frame == 3
    tracks = replace(tracks, **{n: getattr(tracks, n)[~blind] for n in ("frame", "slope", "track")})
    found = adjust(tracks, labels, triangulate(tracks, labels), pinhole(CAMERA))
    np.testing.assert_array_equal(found[3], labels[3])
    assert np.abs(found[4] - labels[4]).max() > 1e-3
    nothing = np.full((60, 3), np.nan)
    np.testing.assert_array_equal(adjust(tracks, labels, nothing, pinhole(CAMERA)), labels)


def test_answers_are_closer_than_on_the_labels_as_they_are_and_no_match_is_no_answer():
    point_m = points()
    count, matched = len(point_m), len(TEST) - 1
    evidence = Evidence({}, CAMERA, 0)
    evidence.__dict__["train"] = noisy(0.05, 2.0)
    tracks = seen(POSES, point_m)
    evidence.__dict__["tracks"] = replace(tracks, of_feature=np.arange(count))
    evidence.__dict__["correspondences"] = Correspondences(
        np.array([0, count, 2 * count, 2 * count]),
        slopes(TEST[:matched], point_m).reshape(-1, 2),
        np.tile(np.arange(count), matched),
        np.zeros(matched * count, np.int64),
        np.full((matched * count, 3), np.nan),
    )
    before, after = triangulated(evidence), adjusted(evidence)
    assert np.isnan(after[2]).all()
    # What is left is how the labels as a whole lie in the world.
    placed = placed_on(POSES, evidence.train.world_from_cam)
    scale, rotation, offset = umeyama_sim3(POSES[:, :3, 3], placed[:, :3, 3])
    position_m = scale * TEST[:matched, :3, 3] @ rotation.T + offset
    expected = pose_matrix(rotation @ TEST[:matched, :3, :3], position_m)
    assert pose_error(after[:matched], expected)[0].max() < 0.005
    assert pose_error(before[:matched], expected)[0].min() > 0.02


ROOT = Path(__file__).parents[2]


def external_files(tmp_path):
    """Frames and labels of a data set whose test images are training images."""
    train, truth = random_table(12, 5, 3), tmp_path / "truth"
    np.save(tmp_path / "train.npy", frames(12))
    np.save(tmp_path / "test.npy", frames(12)[[7, 2, 5]])
    rows = [7, 2, 5]
    test = PoseTable(np.arange(3), np.arange(3), train.position_m[rows], train.quat_wxyz[rows])
    for folder in (tmp_path / "labels", truth):
        write_pose_table(folder / "train.csv", train)
        write_pose_table(folder / "test.csv", test)
    return {
        "train_frames": tmp_path / "train.npy",
        "test_frames": tmp_path / "test.npy",
        "train": tmp_path / "labels" / "train.csv",
        "test": tmp_path / "labels" / "test.csv",
        "test_truth": truth / "test.csv",
    }


def test_the_example_of_the_documentation_answers_and_is_scored(tmp_path):
    files = external_files(tmp_path)
    config = yaml.safe_load((ROOT / "examples/external.yaml").read_text())["references"]["external"]
    command = config["nearest_grey"]["command"].replace("python ", f"{sys.executable} ", 1)
    command = command.replace("examples/", f"{ROOT}/examples/")
    folder = tmp_path / "out"
    method = {"command": command, "poses": None}
    answer_externally(files, method, {}, {}, [folder / "metrics.json"])
    found, labels = read_pose_table(folder / "predictions.csv"), read_pose_table(files["train"])
    nearest = np.argsort(-grey_likeness(files), axis=1)[:, :3]
    assert nearest[:, 0].tolist() == [7, 2, 5]
    np.testing.assert_allclose(found.position_m, labels.position_m[nearest].mean(axis=1))
    assert json.loads((folder / "metrics.json").read_text())["failed"] == 0


def grey_likeness(files):
    """Correlation of test and training images."""
    train, test = (np.load(files[f"{split}_frames"]).mean(3) for split in ("train", "test"))
    train, test = (part.reshape(len(part), -1) for part in (train, test))
    return np.corrcoef(np.concatenate([test, train]))[: len(test), len(test) :]


def test_answers_may_be_incomplete_and_in_any_order(tmp_path):
    frames = random_table(4, 0, 3)
    path = tmp_path / "mine.csv"
    rows = ["3,x,1,2,3,1,0,0,0", "1,y,4,5,6,0,1,0,0", "0,none,nan,nan,nan,,,,"]
    path.write_text("\n".join(["frame,note,tx,ty,tz,qw,qx,qy,qz", *rows]))
    found = read_answers(path, frames)
    assert np.isnan(found.position_m[[0, 2]]).all()
    assert np.isnan(found.quat_wxyz[[0, 2]]).all()
    np.testing.assert_array_equal(found.position_m[[1, 3]], [[4, 5, 6], [1, 2, 3]])
    np.testing.assert_array_equal(found.quat_wxyz[[1, 3]], [[0, 1, 0, 0], [1, 0, 0, 0]])


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("touch {nowhere}", "placeholders are"),
        ("false", "failed"),
        ("no-such-program {out}", "failed"),
        ("true", "wrote no"),
    ],
)
def test_commands_that_fail_are_refused_in_one_line(tmp_path, command, words):
    with pytest.raises(InputError, match=words):
        run_external(command, external_files(tmp_path), {}, tmp_path / "out")
