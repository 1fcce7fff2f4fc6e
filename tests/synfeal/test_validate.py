"""``synfeal validate`` passes a data set in closed form and finds every error put into it."""

import shutil
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from synfeal.cli import main
from synfeal.dataset.sequence_listing import Frame
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.validation.consistency import MEASURES, Pair, measure_check
from synfeal.validation.reprojection import Residual
from tests.support import damaged_sets
from tests.support.damaged_sets import (
    FOUND_BY,
    depth_in_centimetres,
    depth_in_metres,
    frame_files,
    swapped_colors,
    swapped_frames,
    without_manifest_hashes,
)
from tests.support.small_room import furnished_room


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
    assert verdicts == ["ok"] * 15, captured.out
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


@pytest.mark.parametrize(
    ("place", "factor", "added"),
    [(np.s_[:3, 0], -1, 0), (np.s_[:3, :3], 1 + 2e-3, 0), ((3, 0), 1, 0.1)],
)
def test_poses_that_are_mirrored_stretched_or_slanted(place, factor, added, damaged, capsys):
    path = frame_files(damaged, "pose.txt")[5]
    pose = np.loadtxt(path)
    pose[place] = factor * pose[place] + added
    np.savetxt(path, pose, fmt="%.10e")
    check_fails(damaged, capsys, f"poses: {path}: no rigid pose")


def test_a_stretch_within_the_rounding_of_text_is_found_by_the_table(damaged, capsys):
    path = frame_files(damaged, "pose.txt")[5]
    pose = np.loadtxt(path)
    pose[:3, :3] *= 1 + 1e-5
    np.savetxt(path, pose, fmt="%.10e")
    check_fails(damaged, capsys, f"tables: {path}: differs from train.csv")


def test_a_test_frame_from_the_training_set(damaged, capsys):
    copied = frame_files(damaged, "pose.txt", "seq-02")[3]
    shutil.copy(frame_files(damaged, "pose.txt")[7], copied)
    check_fails(damaged, capsys, f"overlap: {copied}", "frame-000007")


def of_other_sign(text):
    header, first, *rows = text.splitlines()
    cells = first.split(",")
    cells[5:] = [repr(-float(cell)) for cell in cells[5:]]
    return "\n".join([header, ",".join(cells), *rows]) + "\n"


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("TrainSplit.txt", "sequence1\nsequence2\n", ("splits: ", "seq-02: is listed 2 times")),
        ("TrainSplit.txt", "", ("splits: ", "seq-01: is listed 0 times")),
        ("TrainSplit.txt", "sequence1\nsequence7\n", ("splits: ", "TrainSplit.txt: lists seq-07")),
        ("TrainSplit.txt", "one\n", ("splits: ", "'one' names no sequence")),
        (
            "manifest.json",
            lambda old: old.replace('"train": 24', '"train": 0'),
            ("manifest: ", "frames: train must be 24"),
        ),
        ("train.csv", of_other_sign, ("tables: ", "train.csv: row 2", "qw < 0", "qw >= 0")),
    ],
)
def test_what_a_file_says_wrongly_is_told(name, change, words, damaged, capsys):
    path = damaged / name
    path.write_text(change if isinstance(change, str) else change(path.read_text()))
    check_fails(damaged, capsys, *words)


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


PAINT_TEXELS = (2.0, 8.0, 24.0)
BOX_M = np.array([0.4, 4.6, 0.4, 3.6, 0.8, 2.0])
FAR_M = np.array([432_100.0, -87_654.0, 321.0])  # as map coordinates


def collected(folder, offset_m, *options):
    """A data set of 60 frames in a furnished room, which may lie far away."""
    room = furnished_room(PAINT_TEXELS)
    parts = [replace(part, vertices_m=part.vertices_m + offset_m) for part in room.parts]
    save_glb(folder / "room.glb", TexturedMesh(tuple(parts)))
    box = [f"{value:.2f}" for value in BOX_M + np.broadcast_to(offset_m, 3).repeat(2)]
    command = ["collect", str(folder / "room.glb"), "--out", str(folder / "set")]
    assert main([*command, "--depth", "--frames", "60", "--box", *box, *options]) == 0
    return folder / "set"


def verdicts(folder, capsys):
    """Names of the checks and the lines of the report; exit status is that of the verdicts."""
    capsys.readouterr()
    status = main(["validate", str(folder)])
    lines = capsys.readouterr().out.splitlines()[1:]
    assert bool(status) == any(" FAILED " in line for line in lines)
    return {line.split()[0]: line for line in lines}


@pytest.mark.parametrize(
    ("options", "offset_m"),
    [
        (["--mode", "random"], 0.0),
        (["--spacing", "0.1"], FAR_M),
    ],
    ids=["random", "far from the origin"],
)
def test_a_faultless_set_passes(options, offset_m, tmp_path, capsys):
    size = ["--test-frames", "4", "--width", "96", "--height", "72"]
    found = verdicts(collected(tmp_path, offset_m, *size, *options), capsys)
    assert not [line for line in found.values() if " FAILED " in line]
    assert " ok " in found["depth"]


@pytest.fixture(scope="module")
def small_random(tmp_path_factory):
    """Independent poses, 64 x 48: few pairs of frames see the same, and few pixels of it."""
    size = ["--width", "64", "--height", "48"]
    out = collected(tmp_path_factory.mktemp("random"), 0.0, *size, "--mode", "random")
    without_manifest_hashes(out)
    return out


@pytest.mark.parametrize(
    ("change", "failing"),
    [
        (None, set()),
        (depth_in_metres, {"images", "pairs"}),
        (depth_in_centimetres, {"convention", "pairs"}),
        (swapped_frames, {"depth", "surfaces"}),
        (swapped_colors, {"colours"}),
    ],
)
def test_independent_poses_are_told_right_from_wrong_in_small_images(
    change, failing, small_random, tmp_path, capsys
):
    copied = Path(shutil.copytree(small_random, tmp_path / "set"))
    if change is not None:
        change(copied)
    found = verdicts(copied, capsys)
    del found["manifest"]  # without its hashes, so that only geometry can tell
    assert {name for name, line in found.items() if " FAILED " in line} == failing


def of_one_color(grey):
    def change(folder, count):
        for path in frame_files(folder, "color.png")[:count]:
            Image.new("RGB", (96, 72), (grey,) * 3).save(path)

    return change


def two_thirds_without_depth(folder, count):
    for path in frame_files(folder, "depth.png")[:count]:
        depth = np.asarray(Image.open(path)).copy()
        depth[: 2 * len(depth) // 3] = 65535
        Image.fromarray(depth).save(path)


@pytest.mark.parametrize(
    ("change", "count", "words"),
    [
        (of_one_color(0), 24, ["of one colour", "24 of 32", "frame-000000.color.png"]),
        (of_one_color(102), 24, ["of one colour", "24 of 32"]),
        (of_one_color(102), 1, []),
        (two_thirds_without_depth, 24, ["more than half empty", "24 of 32"]),
        (two_thirds_without_depth, 8, []),
    ],
)
def test_blank_frames_are_found_where_they_are_many(change, count, words, damaged, capsys):
    without_manifest_hashes(damaged)
    change(damaged, count)
    assert main(["validate", str(damaged)]) in (0, 1)
    captured = capsys.readouterr()
    (line,) = [line for line in captured.out.splitlines() if line.startswith("content")]
    assert ("FAILED" in line) == bool(words)
    found = [text for text in captured.err.splitlines() if text.startswith("error: content: ")]
    assert len(found) == bool(words)
    assert all(word in found[0] for word in words)


@pytest.mark.parametrize(("wrong", "failed"), [({(3, 4)}, False), ({(2, 3), (3, 4)}, True)])
def test_a_frame_is_wrong_where_it_disagrees_with_most_not_with_one(wrong, failed):
    """Frame 3 has two neighbours; of right frames one can be hidden behind an edge."""
    frames = [Frame(Path("seq-01"), number) for number in range(6)]
    pairs = [
        Pair(a, b, Residual(overlap=0.9, hidden=False, depth=82.0 if (i, i + 1) in wrong else 0.2))
        for i, (a, b) in enumerate(pairwise(frames))
    ]
    check = measure_check(MEASURES[0], pairs)
    assert bool(check.failures) == failed
    assert not failed or "frame-000003.depth.png" in check.failures[0]
