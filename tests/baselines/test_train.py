"""``synfeal train`` as a person uses it: data sets and photographs in, a model out."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from baselines.localizers.backbones.shipped import shipped_weights_path
from baselines.training.own_frames import FrameRange, pack_own_frames, read_own_frames
from baselines.training.train import NETWORK, TrainJob, _network, train
from synfeal.camera.photograph import PhotographCamera
from synfeal.cli import main
from synfeal.dataset.packed import fit_frame
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import pose_text
from synfeal.dataset.world import write_sequence_from_world
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.records.files import unfinished_prefix
from synfeal.records.lock import only_command
from tests.support.collected import collect, refused

ROOT = Path(__file__).parents[2]
COUNT = 20
WIDTH, HEIGHT = 80, 60
PRODUCTS = ["history.csv", "model.pt", "training.json"]
UNKNOWN = PhotographCamera(exif=False)


def write_photographs(folder, count=COUNT, suffix="jpg", seed=0):
    """A flat sequence whose colours say where the camera is."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, 256, (6, 8, 3), np.uint8)
    scene = np.asarray(Image.fromarray(coarse).resize((WIDTH + count, HEIGHT)))
    for index in range(count):
        stem = folder / f"frame-{index:06d}"
        Image.fromarray(scene[:, index : index + WIDTH]).save(f"{stem}.color.{suffix}")
        turn = rotation_from_rpy([0.0, 0.05 * index, 0.1])
        pose = pose_matrix(turn, np.array([0.02 * index, 0.5, 1.0]))
        Path(f"{stem}.pose.txt").write_text(pose_text(pose))
    return folder


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    return write_photographs(tmp_path_factory.mktemp("photographs") / "flat")


def run(out, *datasets, images=192, **further):
    """Train for a moment."""
    options = {"images": images, "device": "cpu", "photographs": UNKNOWN, **further}
    return train(TrainJob(datasets=datasets, out=out, **options))


@pytest.fixture(scope="module")
def undisturbed(photographs, tmp_path_factory):
    """Train without a stop."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    run(out, photographs)
    return out


KILLED = """
import os, signal, sys
from pathlib import Path
from baselines.training import resume
from baselines.training.fit import Fitting
from tests.baselines.test_train import run
resume.RESUME_EVERY_S = 0.0
step, count = Fitting.step, [0]
def stepping(self):
    step(self)
    count[0] += 1
    if count[0] == 3:
        os.kill(os.getpid(), getattr(signal, sys.argv[3]))
Fitting.step = stepping
run(Path(sys.argv[1]), Path(sys.argv[2]))
"""


@pytest.mark.parametrize("number", ["SIGKILL", "SIGTERM"])
def test_a_run_that_was_killed_ends_with_the_same_bytes(photographs, undisturbed, tmp_path, number):
    out = tmp_path / "out"
    command = [sys.executable, "-c", KILLED, str(out), str(photographs), number]
    process = subprocess.run(command, cwd=ROOT, env=os.environ, check=False, capture_output=True)
    assert process.returncode == -getattr(signal, number), process.stderr.decode()
    assert (out / "resume.pt").is_file()
    assert not (out / "model.pt").exists()
    (out / f"{unfinished_prefix('resume')}left.pt").touch()  # as when it is killed while it writes
    run(out, photographs)
    assert (out / "model.pt").read_bytes() == (undisturbed / "model.pt").read_bytes()
    assert (out / "history.csv").read_bytes() == (undisturbed / "history.csv").read_bytes()
    assert sorted(path.name for path in out.iterdir()) == PRODUCTS


def test_a_run_that_has_ended_is_not_made_again(photographs, undisturbed, tmp_path):
    out = Path(shutil.copytree(undisturbed, tmp_path / "out"))
    before = (out / "model.pt").stat().st_mtime_ns
    again = run(out, photographs)
    assert again.finished_before
    assert (out / "model.pt").stat().st_mtime_ns == before
    record = json.loads((out / "training.json").read_text())
    assert again.errors.position_m == record["held_out"]["position_m"]


def test_a_data_set_is_known_by_its_content(photographs, undisturbed, tmp_path):
    out = Path(shutil.copytree(undisturbed, tmp_path / "out"))
    moved = Path(shutil.copytree(photographs, tmp_path / "moved"))
    assert run(out, moved).finished_before
    # Collected anew under the same name: one image differs, then one pose.
    record = json.loads((out / "training.json").read_text())
    record["settings"]["datasets"] = [str(moved)]
    (out / "training.json").write_text(json.dumps(record))
    image, pose = moved / "frame-000003.color.jpg", moved / "frame-000003.pose.txt"
    before = image.read_bytes()
    image.write_bytes((moved / "frame-000004.color.jpg").read_bytes())
    with pytest.raises(InputError, match=rf"trained on other frames, {moved} has changed since"):
        run(out, moved)
    image.write_bytes(before)
    pose.write_text(pose.read_text().replace("1.0000000000e+00", "1.0000000001e+00", 1))
    with pytest.raises(InputError, match="on other frames"):
        run(out, moved)


def test_a_record_without_hashes_is_of_the_data_set_it_names(photographs, undisturbed, tmp_path):
    out = Path(shutil.copytree(undisturbed, tmp_path / "out"))
    record = json.loads((out / "training.json").read_text())
    del record["sha256"], record["unseen"]  # as earlier versions wrote it
    (out / "training.json").write_text(json.dumps(record))
    assert run(out, photographs).finished_before
    moved = Path(shutil.copytree(photographs, tmp_path / "moved"))
    with pytest.raises(InputError, match="with another datasets"):
        run(out, moved)


def test_one_run_at_a_time_in_a_directory(photographs, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    with (
        only_command(out, out / ".lock"),
        pytest.raises(InputError, match="another run is at work there"),
    ):
        run(out, photographs)
    assert list(out.iterdir()) == []


def test_the_test_split_is_scored_as_localize_answers_it(tmp_path, capsys):
    folder = tmp_path / "set"
    write_photographs(folder / "seq-01")
    write_photographs(folder / "seq-02", count=5, seed=1)
    (folder / "TrainSplit.txt").write_text("sequence1\n")
    (folder / "TestSplit.txt").write_text("sequence2\n")
    camera = PhotographCamera(focal_px=70.0)
    done = run(tmp_path / "out", folder, images=64, photographs=camera)
    poses = tmp_path / "poses.csv"
    given = ["localize", done.model, folder / "seq-02", "--focal", 70, "--out", poses]
    assert main([str(argument) for argument in [*given, "--device", "cpu"]]) == 0
    answered = np.loadtxt(poses, delimiter=",", skiprows=1, usecols=(1, 2, 3))
    true = np.array([[0.02 * index, 0.5, 1.0] for index in range(5)])
    expected = np.median(np.linalg.norm(answered - true, axis=1))
    assert done.unseen.n_frames == 5
    assert done.unseen.position_m == pytest.approx(expected, abs=1e-5)
    capsys.readouterr()
    given = ["train", folder, "--out", tmp_path / "out", "--images", 64, "--device", "cpu"]
    assert main([str(argument) for argument in [*given, "--focal", 70]]) == 0
    said = capsys.readouterr().out
    assert f"; median error {expected:.3f} m / " in said
    assert said.index(" on 5 test frames, ") < said.index(" on held-out places")


def test_a_test_split_that_is_not_there_is_said(tmp_path, caplog):
    folder = tmp_path / "set"
    write_photographs(folder / "seq-01")
    (folder / "TrainSplit.txt").write_text("sequence1\n")
    (folder / "TestSplit.txt").write_text("sequence2\n")
    assert run(tmp_path / "out", folder, images=64).unseen.frames == "held out"
    assert "seq-02: is not there, so the test split is not scored" in caplog.text


def test_what_is_said_leads_to_localize_and_evaluate(photographs, tmp_path, capsys, caplog):
    out, poses = tmp_path / "trained", tmp_path / "poses.csv"
    given = ["train", photographs, "--out", out, "--images", 320, "--device", "cpu", "--focal", 70]
    assert main([str(argument) for argument in given]) == 0
    said, line = capsys.readouterr().out.strip().splitlines()
    assert "320 images shown of 20 frames on 10 paths" in said
    assert re.search(r"; median error [\d.]+ m / [\d.]+ degrees on held-out places$", said)
    progress = r"320 of 320 samples, loss -?[\d.]+, held out [\d.]+ m/[\d.]+°.* 0 s left"
    assert re.search(progress, caplog.text)
    assert line.split()[:3] == ["synfeal", "localize", str(out / "model.pt")]
    words = line.replace("photos/", str(photographs)).replace("poses.csv", str(poses)).split()
    assert main([*words[1:], "--device", "cpu"]) == 0
    assert len(poses.read_text().splitlines()) == COUNT + 1


def described(model):
    return torch.load(model, weights_only=True)["description"]


def test_the_checkpoint_keeps_what_localize_needs(photographs, tmp_path):
    camera = PhotographCamera(focal_px=70.0)
    made = run(tmp_path / "out", photographs, images=64, photographs=camera)
    kept = described(made.model)
    assert (kept["camera"]["width"], kept["camera"]["fx"]) == (WIDTH, 70.0)
    np.testing.assert_allclose(kept["bounds_m"], [[0, 0.5, 1], [0.38, 0.5, 1]], atol=1e-6)
    assert "sequence_from_world" not in kept
    assert kept["scene"] == "flat"


def test_a_data_set_is_learned_from_by_its_training_split(calm, tmp_path):
    own = read_own_frames(calm, ())
    table = read_pose_table(calm / "train.csv")
    np.testing.assert_allclose(own.world_from_cam, table.world_from_cam, atol=1e-9)
    np.testing.assert_array_equal(own.path, table.path)
    packed = pack_own_frames([own], UNKNOWN, NETWORK, tmp_path)
    frames = np.load(packed.frames)
    for index, image in ((0, "seq-01/frame-000000"), (23, "seq-03/frame-000003")):
        with Image.open(calm / f"{image}.color.png") as opened:
            np.testing.assert_array_equal(frames[index], fit_frame(opened, 64, "whole"))
    manifest = json.loads((calm / "manifest.json").read_text())
    assert packed.camera.fx == pytest.approx(manifest["camera"]["fx"])


def test_frames_of_another_size_than_their_panorama_are_refused(mesh, tmp_path):
    wide = ("--projection", "equirectangular", "--width", "64", "--height", "32", "--frames", "4")
    assert collect(mesh, tmp_path / "set", *wide) == 0
    (image, *_) = sorted((tmp_path / "set").rglob("*.color.png"))
    with Image.open(image) as opened:
        opened.crop((0, 0, 32, 32)).save(image)
    with pytest.raises(InputError, match=r"is of 32x32 pixels, .* says 64x32"):
        pack_own_frames([read_own_frames(tmp_path / "set", ())], UNKNOWN, NETWORK, tmp_path)


def test_photographs_join_rendered_frames_in_their_world_and_camera(calm, photographs, tmp_path):
    rendered = Path(shutil.copytree(calm, tmp_path / "set"))
    moved = pose_matrix(rotation_from_rpy([0.3, -0.2, 2.0]), np.array([1.0, -2.0, 0.5]))
    write_sequence_from_world(rendered, moved)
    sets = [read_own_frames(folder, ()) for folder in (rendered, photographs)]
    packed = pack_own_frames(sets, PhotographCamera(focal_px=70.0), NETWORK, tmp_path)
    table = read_pose_table(packed.labels)
    assert len(table) == 24 + COUNT
    assert len(set(table.path[:24]) & set(table.path[24:])) == 0
    np.testing.assert_allclose(table.world_from_cam[:24], sets[0].world_from_cam, atol=1e-9)
    in_sequence = moved @ table.world_from_cam[24:]
    np.testing.assert_allclose(in_sequence, sets[1].world_from_cam, atol=1e-9)
    np.testing.assert_array_equal(packed.sequence_from_world, moved)
    assert packed.camera.width == 40  # the rendered frames'
    with Image.open(photographs / "frame-000000.color.jpg") as opened:
        squeezed = fit_frame(opened, 64, "whole")
    assert np.abs(np.load(packed.frames)[24].astype(int) - squeezed).mean() > 2  # it was resampled
    made = run(tmp_path / "both", rendered, photographs, images=64)
    np.testing.assert_allclose(described(made.model)["sequence_from_world"], moved)


def test_photographs_that_exif_turns_are_learned_upright(photographs, tmp_path):
    folder = Path(shutil.copytree(photographs, tmp_path / "turned"))
    exif = Image.Exif()
    exif[0x0112] = 6
    for index in (0, 1):
        path = folder / f"frame-{index:06d}.color.jpg"
        with Image.open(path) as image:
            image.load()
        image.save(path.with_suffix(".png"), exif=exif)
        path.unlink()
    own = read_own_frames(folder, ())
    packed = pack_own_frames([own], UNKNOWN, NETWORK, tmp_path)
    with Image.open(folder / "frame-000001.color.png") as image:
        clockwise = image.transpose(Image.Transpose.ROTATE_270)
    np.testing.assert_array_equal(np.load(packed.frames)[1], fit_frame(clockwise, 64, "whole"))
    poses = read_pose_table(packed.labels).world_from_cam
    np.testing.assert_allclose(poses[2:], own.world_from_cam[2:], atol=1e-9)
    # The upright picture's x is up the stored one, its y to the right.
    np.testing.assert_allclose(poses[:2, :3, 0], -own.world_from_cam[:2, :3, 1], atol=1e-9)
    np.testing.assert_allclose(poses[:2, :3, 1], own.world_from_cam[:2, :3, 0], atol=1e-9)


def test_parts_of_a_sequence_can_be_taken_and_are_cut_into_blocks(photographs):
    own = read_own_frames(photographs, (FrameRange(0, 5), FrameRange(10, 14)))
    names = [path.name[6:12] for path in own.color]
    assert names == [f"{index:06d}" for index in (0, 1, 2, 3, 4, 10, 11, 12, 13)]
    assert own.path.tolist() == list(range(9))
    assert read_own_frames(photographs, ()).path.tolist() == [i // 2 for i in range(COUNT)]


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_sequences_below_a_folder_are_read_with_either_kind_of_file(tmp_path, suffix):
    for number in (1, 2):
        write_photographs(tmp_path / "all" / f"seq-{number:02d}", 6, suffix, seed=number)
    own = read_own_frames(tmp_path / "all", (FrameRange(4, 8),))
    assert [path.parent.name for path in own.color] == ["seq-01"] * 2 + ["seq-02"] * 2


def test_one_path_leaves_nothing_to_hold_out_and_is_learned_from(calm, tmp_path, capsys):
    given = ["train", calm, "--out", tmp_path / "out", "--images", 64, "--device", "cpu"]
    assert main([str(argument) for argument in given]) == 0
    said = capsys.readouterr().out
    assert "24 frames on 1 paths" in said
    assert said.splitlines()[0].endswith("degrees on 8 test frames")
    (tmp_path / "alone").symlink_to(write_photographs(tmp_path / "flat", 1))
    given = ["train", tmp_path / "alone", "--out", tmp_path / "one", "--images", 64]
    assert main([*map(str, given), "--device", "cpu"]) == 0
    assert "nothing was held out, so its error is not known" in capsys.readouterr().out


def test_minutes_settle_the_images_once(photographs, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    settled = {"minutes": 0.5, "localizer": "posenet2", "images": 128}
    (out / "budget.json").write_text(json.dumps(settled))
    assert run(out, photographs, images=None, minutes=0.5).images == 128
    made = run(tmp_path / "new", photographs, images=None, minutes=0.01)
    assert made.images % 64 == 0
    assert made.images >= 64


def test_randomisation_changes_the_weights_and_can_be_turned_off(
    photographs, undisturbed, tmp_path
):
    off = [run(tmp_path / name, photographs, randomisation=None).model for name in "ab"]
    assert off[0].read_bytes() == off[1].read_bytes()
    assert off[0].read_bytes() != (undisturbed / "model.pt").read_bytes()


def without_a_pose(folder):
    (folder / "frame-000003.pose.txt").unlink()


def damaged_image(folder):
    (folder / "frame-000003.color.jpg").write_bytes(b"no picture")


def turned_pose(folder):
    (folder / "frame-000003.pose.txt").write_text("2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")


def emptied(folder):
    for path in folder.iterdir():
        path.unlink()


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (without_a_pose, "frame-000003.pose.txt: missing"),
        (damaged_image, "frame-000003.color.jpg: cannot be read as an image"),
        (turned_pose, "frame-000003.pose.txt: is not a rigid pose"),
        (emptied, "give the folder of a posed sequence"),
    ],
)
def test_a_sequence_that_cannot_be_used_is_told_in_one_line(
    photographs, tmp_path, capsys, harm, words
):
    folder = Path(shutil.copytree(photographs, tmp_path / "flat"))
    harm(folder)
    out = tmp_path / "out"
    assert words in refused(capsys, "train", folder, "--out", out, "--images", 64)
    assert not (out / "model.pt").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--images", 0], "--images: must be 1 to 1,000,000,000, found 0"),
        (["--minutes", 0], "--minutes: must be above 0 and below 1e6, found 0"),
        (["--minutes", 1, "--images", 9], "--minutes: --images say how long already"),
        (["--held-out", 1], "--held-out: must be a share"),
        (["--range", 5, 5], "--range: 5 5 holds no frame"),
        (["--range", 100, 200], "none of them in the range"),
        (["--focal", -1], "--focal: must be a positive number"),
        (["--camera", "absent.yaml"], "absent.yaml: cannot be read as a calibration"),
        (["--randomisation", "absent.yaml"], "absent.yaml: cannot be read as YAML"),
        (["--seed", -1], "--seed: must be 0 to 2^63 - 1"),
    ],
)
def test_options_that_cannot_be_meant_are_told_in_one_line(
    photographs, tmp_path, capsys, options, words
):
    assert words in refused(capsys, "train", photographs, "--out", tmp_path / "out", *options)
    assert not (tmp_path / "out/model.pt").exists()


def test_ranges_of_randomisation_come_from_a_file(photographs, tmp_path, capsys):
    path = tmp_path / "light.yaml"
    path.write_text("exposure_ev: [1, -1]\n")
    given = ["train", photographs, "--out", tmp_path / "out", "--randomisation", path]
    assert "light.yaml: exposure_ev: the first number" in refused(capsys, *given)
    path.write_text("exposure_ev: [0, 0]\nblur: null\n")
    assert main([str(a) for a in [*given, "--images", 64, "--device", "cpu"]]) == 0
    kept = json.loads((tmp_path / "out/training.json").read_text())["settings"]["randomisation"]
    assert kept["exposure_ev"] == [0, 0]
    assert kept["blur"] is None


def test_nothing_of_another_kind_is_written_over(photographs, undisturbed, tmp_path, capsys):
    out = tmp_path / "mine"
    out.mkdir()
    (out / "thesis.tex").write_text("all of it")
    assert "holds 'thesis.tex'" in refused(capsys, "train", photographs, "--out", out)
    (out / "thesis.tex").unlink()
    shutil.copytree(undisturbed, out, dirs_exist_ok=True)
    line = refused(capsys, "train", photographs, "--out", out, "--images", 64)
    assert "holds a localizer trained with another images" in line


def test_data_sets_of_two_cameras_do_not_fit(calm, tmp_path, capsys):
    other = Path(shutil.copytree(calm, tmp_path / "other"))
    manifest = json.loads((other / "manifest.json").read_text())
    manifest["camera"]["fx"] += 1.0
    (other / "manifest.json").write_text(json.dumps(manifest))
    line = refused(capsys, "train", calm, other, "--out", tmp_path / "out", "--images", 64)
    assert "other/manifest.json: camera: is another than that of" in line


def test_the_network_has_the_shape_asked_for_and_localize_knows_it(photographs, tmp_path, capsys):
    out, poses = tmp_path / "trained", tmp_path / "poses.csv"
    shape = ["--input", 48, "--width", 0.125, "--batch", 16]
    given = ["train", photographs, "--out", out, "--images", 64, "--device", "cpu", *shape]
    assert main([str(argument) for argument in given]) == 0
    settings = json.loads((out / "training.json").read_text())["settings"]
    assert (settings["input_px"], settings["width"], settings["batch"]) == (48, 0.125, 16)
    network = described(out / "model.pt")["network"]
    assert (network["input_px"], network["width"], network["view"]) == (48, 0.125, "whole")
    capsys.readouterr()
    localizing = ["localize", out / "model.pt", photographs, "--out", poses, "--device", "cpu"]
    assert main([str(argument) for argument in localizing]) == 0
    assert "48 x 48 pixels" in capsys.readouterr().out


def test_the_shape_follows_the_device_unless_it_is_given():
    gpu, cpu = torch.device("cuda"), torch.device("cpu")
    job = TrainJob(datasets=(), out=Path("out"))
    assert _network(job, cpu) == NETWORK
    assert (_network(job, gpu).input_px, _network(job, gpu).width) == (224, 1.0)
    half = TrainJob(datasets=(), out=Path("out"), width=0.5)
    assert (_network(half, gpu).input_px, _network(half, gpu).width) == (224, 0.5)


def test_a_backbone_may_start_from_a_file(photographs, tmp_path):
    start = shipped_weights_path("googlenet")
    named = run(tmp_path / "named", photographs, images=64, start=start)
    shipped = run(tmp_path / "shipped", photographs, images=64)
    scratch = run(tmp_path / "scratch", photographs, images=64, start=None, width=0.125)
    assert named.model.read_bytes() == shipped.model.read_bytes()
    assert described(scratch.model)["network"]["width"] == 0.125


def test_an_earlier_record_is_of_the_network_that_there_was(photographs, undisturbed, tmp_path):
    out = Path(shutil.copytree(undisturbed, tmp_path / "out"))
    record = json.loads((out / "training.json").read_text())
    for key in ("input_px", "width", "batch", "start"):
        del record["settings"][key]
    (out / "training.json").write_text(json.dumps(record))
    assert run(out, photographs).finished_before


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--input", 8], "--input: "),
        (["--width", 2], "--width: "),
        (["--batch", 0], "--batch: must be at least 1"),
        (["--batch", 100_000_000], "lower --batch, --input or --width"),
        (["--start", "nowhere.pt"], "--start: nowhere.pt is no file"),
    ],
)
def test_a_network_that_cannot_be_is_told_before_anything_is_written(
    photographs, tmp_path, capsys, options, said
):
    given = ["train", photographs, "--out", tmp_path / "out", "--device", "cpu", *options]
    assert main([str(argument) for argument in given]) == 1
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
