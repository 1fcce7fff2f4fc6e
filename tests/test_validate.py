"""``synfeal validate`` passes a data set in closed form and finds every error put into it."""

import json
import shutil

import numpy as np
import pytest

from synfeal.cli import main
from tests import damaged_sets
from tests.damaged_sets import FOUND_BY, frame_files, without_manifest_hashes


def errors(capsys):
    """The ``error:`` lines; nothing else may be on stderr but progress bars."""
    text = capsys.readouterr().err
    assert "Traceback" not in text
    return [line[7:] for line in text.replace("\r", "\n").splitlines() if line[:7] == "error: "]


def check_fails(folder, capsys, *words):
    """Exit status 1 and an error line with all of the words."""
    assert main(["validate", str(folder)]) == 1
    lines = errors(capsys)
    assert any(all(word in line for word in words) for line in lines), lines


def test_a_sound_data_set_passes(planar, capsys):
    assert main(["validate", str(planar)]) == 0
    captured = capsys.readouterr()
    verdicts = [line.split()[1] for line in captured.out.splitlines()[1:]]
    assert verdicts == ["ok"] * 14, captured.out
    assert "error" not in captured.err


@pytest.mark.parametrize("error", FOUND_BY, ids=lambda error: str(error.__name__))
def test_geometry_alone_finds(error, damaged, capsys):
    without_manifest_hashes(damaged)
    error(damaged)
    check_fails(damaged, capsys, f"{FOUND_BY[error]}: ")


def test_the_manifest_and_the_tables_find_a_changed_pose(damaged, capsys):
    damaged_sets.pose_of_the_neighbour(damaged)
    assert main(["validate", str(damaged)]) == 1
    found = {line.split(": ")[0]: line for line in errors(capsys)}
    assert "seq-01: differs from what was written" in found["manifest"]
    assert "seq-01/frame-000012.pose.txt: differs from train.csv" in found["tables"]


def write_rows(path, change):
    pose = np.loadtxt(path)
    change(pose)
    np.savetxt(path, pose, fmt="%.10e")


def mirror(pose):
    pose[:3, 0] *= -1


def stretch(pose):
    pose[:3, :3] *= 1 + 1e-5


def slant(pose):
    pose[3, 0] = 0.1


@pytest.mark.parametrize("change", [mirror, stretch, slant])
def test_poses_that_are_not_rigid(change, damaged, capsys):
    path = frame_files(damaged, "pose.txt")[5]
    write_rows(path, change)
    check_fails(damaged, capsys, f"poses: {path}: no rigid pose")


def test_a_test_frame_from_the_training_set(damaged, capsys):
    copied = frame_files(damaged, "pose.txt", "seq-02")[3]
    shutil.copy(frame_files(damaged, "pose.txt")[7], copied)
    check_fails(damaged, capsys, f"overlap: {copied}", "frame-000007")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sequence1\nsequence2\n", ("seq-02: is listed 2 times",)),
        ("", ("seq-01: is listed 0 times",)),
        ("sequence1\nsequence7\n", ("TrainSplit.txt: lists seq-07",)),
        ("one\n", ("'one' names no sequence",)),
    ],
)
def test_splits(text, words, damaged, capsys):
    (damaged / "TrainSplit.txt").write_text(text)
    check_fails(damaged, capsys, "splits: ", *words)


def test_the_manifest_must_count_the_frames(damaged, capsys):
    path = damaged / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["frames"]["train"] = 23
    path.write_text(json.dumps(manifest))
    check_fails(damaged, capsys, "manifest: ", "frames: train must be 24")


def test_without_a_manifest_a_calibration_stands_in_or_geometry_is_not_judged(
    damaged, capsys, tmp_path
):
    (damaged / "manifest.json").unlink()
    assert main(["validate", str(damaged)]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()[1:]}
    assert "not checked" in lines["manifest"]
    assert "not checked" in lines["depth"]
    assert "ok" in lines["images"]
    focal = 48 / np.tan(np.radians(30))
    for shift, status in ((0.0, 0), (0.5, 1)):
        camera = tmp_path / "cameras.txt"
        camera.write_text(f"1 PINHOLE 96 72 {focal} {focal} {48 + shift} {36 + shift}\n")
        assert main(["validate", str(damaged), "--camera", str(camera)]) == status
    assert any(line.startswith("camera: ") for line in errors(capsys))
