"""Localizers of somebody else's: a command or a file of poses, scored as ours are."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from baselines.references.run import answer_externally, read_answers, run_external
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError
from tests.property_support import random_table
from tests.test_references import frames

ROOT = Path(__file__).parent.parent


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
    path.write_text("frame,note,tx,ty,tz,qw,qx,qy,qz\n3,x,1,2,3,1,0,0,0\n1,y,4,5,6,0,1,0,0\n")
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
