"""``synfeal localize``: pictures in, poses out, as a person uses it."""

import math
import os
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from PIL import Image

from baselines.training.checkpoint import FrameCamera, frame_camera
from baselines.training.localize import (
    PictureReader,
    localize,
    read_picture,
)
from baselines.training.pictures import find_pictures, refuse_mixed_sizes
from baselines.training.predict import predict, predict_poses
from synfeal.camera.photograph import PhotographCamera
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import pose_from_quat, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.records.files import write_json
from synfeal.records.tables import read_records
from tests.support.collected import refused
from tests.support.colored_frames import NETWORK, answering, save, untrained

COUNT = 120  # more than a batch
WIDTH, HEIGHT = 52, 39
PX = NETWORK.input_px


def picture(rng, width=WIDTH, height=HEIGHT):
    """A smooth picture (height, width, 3) with some noise."""
    coarse = rng.integers(0, 256, (4, 5, 3), np.uint8)
    smooth = np.asarray(Image.fromarray(coarse).resize((width, height), Image.Resampling.BICUBIC))
    noise = rng.integers(-9, 10, smooth.shape)
    return (smooth.astype(int) + noise).clip(0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A directory with a sequence of frames, a localizer and what it predicts for them."""
    folder = tmp_path_factory.mktemp("run")
    sequence = folder / "seq-01"
    sequence.mkdir()
    rng = np.random.default_rng(0)
    for index in range(COUNT):
        stem = f"frame-{index:06d}"
        (sequence / f"{stem}.color.png").write_bytes(encode_png(picture(rng)))
        depth = np.full((HEIGHT, WIDTH), 1000, np.uint16)
        (sequence / f"{stem}.depth.png").write_bytes(encode_png(depth))
        (sequence / f"{stem}.pose.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    frames, labels = folder / "frames.npy", folder / "labels.csv"
    pack_frames([sequence], PX, frames)
    camera = CameraConfig(width=WIDTH, height=HEIGHT, horizontal_fov_deg=70.0)
    write_json(folder / "frames.json", {"camera": camera.record})
    save(folder / "model.pt", untrained(camera=frame_camera(frames)))
    at_origin = np.zeros((COUNT, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (COUNT, 1))
    write_pose_table(labels, PoseTable(np.arange(COUNT), np.arange(COUNT) // 10, *at_origin))
    predict_poses(folder / "model.pt", frames, labels, folder / "predictions.csv", "cpu")
    return folder


def localized(model, out, *images):
    """Rows that the command wrote, the header first."""
    named = [str(path) for path in images]
    Path(out).unlink(missing_ok=True)
    assert main(["localize", str(model), *named, "--out", str(out), "--device", "cpu"]) == 0
    rows = [row for _, row in read_records(out)]
    return [[*rows[0]], *([*row.values()] for row in rows)]


def test_frames_of_a_run_get_its_predictions_to_the_last_digit(run, tmp_path):
    header, *rows = localized(run / "model.pt", tmp_path / "poses.csv", run / "seq-01")
    pose = ["image", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
    assert header == [*pose, "status", "typicality", "outside_m"]
    names = [f"frame-{index:06d}.color.png" for index in range(COUNT)]
    assert [Path(row[0]).name for row in rows] == names
    predictions = (run / "predictions.csv").read_text().splitlines()[1:]
    assert [row[1:8] for row in rows] == [line.split(",")[2:] for line in predictions]
    assert len({tuple(row) for row in rows}) == COUNT


def test_pictures_come_in_the_order_named(run, tmp_path):
    folder = tmp_path / "more"
    folder.mkdir()
    rng = np.random.default_rng(1)
    for name in ("b.JPG", "a, b.png", ".hidden.png", "c.txt", "d.depth.png"):
        Image.fromarray(picture(rng)).save(folder / name, format="PNG")
    one = run / "seq-01/frame-000003.color.png"
    _, *rows = localized(run / "model.pt", tmp_path / "poses.csv", one, folder, one)
    expected = [str(one), f"{folder}/a, b.png", f"{folder}/b.JPG", str(one)]
    assert [row[0] for row in rows] == expected
    assert rows[0] == rows[3] != rows[1]


GOOD = encode_png(picture(np.random.default_rng(2)))
BROKEN = {
    "absent": lambda path: None,
    "text": lambda path: path.write_text("no picture"),
    "empty": lambda path: path.touch(),
    "cut": lambda path: path.write_bytes(GOOD[: len(GOOD) // 2]),
    "gif": lambda path: Image.new("RGB", (20, 20)).save(path, format="GIF"),
    "grey16": lambda path: path.write_bytes(encode_png(np.full((9, 12), 700, np.uint16))),
    "long": lambda path: Image.new("RGB", (2100, 100)).save(path),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_one_bad_picture_stops_all_and_leaves_what_there_was(run, tmp_path, capsys, kind):
    out, bad = tmp_path / "poses.csv", tmp_path / f"{kind}.png"
    BROKEN[kind](bad)
    before, good = sorted(tmp_path.iterdir()), run / "seq-01/frame-000000.color.png"
    assert f"{bad}: " in refused(capsys, "localize", run / "model.pt", good, bad, "--out", out)
    assert sorted(tmp_path.iterdir()) == before


def test_too_little_memory_is_one_line_that_blames_nobody(run, tmp_path, capsys, monkeypatch):
    def fail(*args, **kwargs):
        raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB.")

    monkeypatch.setattr(torch, "load", fail)
    line = refused(
        capsys, "localize", run / "model.pt", run / "seq-01", "--out", tmp_path / "poses.csv"
    )
    assert line.startswith("error: out of memory (CUDA out of memory. Tried to allocate 2.00 GiB.)")
    assert "train it again" not in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("out", ["seq-01", "model.pt", "seq-01/frame-000000.color.png"])
def test_nothing_of_the_input_is_overwritten(run, capsys, out):
    size = (run / out).stat().st_size
    line = refused(capsys, "localize", run / "model.pt", run / "seq-01", "--out", run / out)
    assert f"{run / out}: is " in line
    assert (run / out).stat().st_size == size


def test_poses_of_an_earlier_command_are_not_overwritten(run, tmp_path, capsys):
    picture, out = run / "seq-01/frame-000000.color.png", tmp_path / "poses.csv"
    localized(run / "model.pt", out, picture)
    before = out.read_bytes()
    line = refused(capsys, "localize", run / "model.pt", picture, "--out", out)
    assert line == f"error: {out}: exists; delete it or choose another file with --out"
    assert out.read_bytes() == before


@pytest.mark.parametrize("out", ["pipe", "notes.txt/poses.csv", "null"])
def test_a_place_that_takes_no_file_is_refused_before_the_work(run, tmp_path, capsys, out):
    os.mkfifo(tmp_path / "pipe")  # reading it would wait for ever
    (tmp_path / "null").symlink_to("/dev/null")
    (tmp_path / "notes.txt").touch()
    picture = run / "seq-01/frame-000000.color.png"
    line = refused(capsys, "localize", run / "model.pt", picture, "--out", tmp_path / out)
    assert line.startswith(f"error: {tmp_path / out}: ")
    assert (tmp_path / "null").is_symlink()


def test_pictures_that_are_left_out_are_mentioned(tmp_path, caplog):
    (tmp_path / "inner").mkdir()
    (tmp_path / "empty").mkdir()
    names = ("frame-000000.color.png", "b.jpg", "frame-000000.right.color.png", "inner/c.png")
    layers = ("depth", "normal", "mask", "right.depth")
    for name in (*names, *(f"frame-000000.{layer}.png" for layer in layers)):
        Image.new("RGB", (8, 6)).save(tmp_path / name)
    for name in ("d.webp", "e.WEBP", "f.tiff", "g.bmp", "notes.txt"):
        (tmp_path / name).touch()
    assert [path.name for path in find_pictures([tmp_path])] == ["b.jpg", "frame-000000.color.png"]
    others, right, inner = (record.getMessage() for record in caplog.records)
    assert "1 .bmp, 1 .tiff, 2 .webp left out" in others
    assert "1 images of right cameras left out" in right
    assert "('inner')" in inner
    (tmp_path / "empty/h.webp").touch()
    with pytest.raises(InputError, match=r"holds no \.png.*; 1 \.webp left out"):
        find_pictures([tmp_path / "empty"])


def test_one_focal_length_is_of_one_size(tmp_path):
    for name, size in (("a", (40, 30)), ("b", (30, 40)), ("c", (80, 60))):
        Image.new("RGB", size).save(tmp_path / f"{name}.png")
    refuse_mixed_sizes(PhotographCamera(focal_px=30.0), [tmp_path / "a.png", tmp_path / "b.png"])
    refuse_mixed_sizes(PhotographCamera(), [tmp_path / "a.png", tmp_path / "c.png"])
    with pytest.raises(InputError, match=r"40 x 30 pixels, .*c\.png 80 x 60") as raised:
        refuse_mixed_sizes(PhotographCamera(focal_px=30.0), sorted(tmp_path.glob("*.png")))
    assert raised.value.where == Argument("focal_px")


NAN, ZERO = math.nan, [0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("position_m", "quat_wxyz"),
    [
        ([1.0, 2.0, 3.0], ZERO),
        ([1.0, 2.0, 3.0], [1.0, NAN, 0.0, 0.0]),
        ([1.0, 2.0, 3.0], [math.inf, 0.0, 0.0, 0.0]),
        ([NAN, 2.0, 3.0], [1.0, 0.0, 0.0, 0.0]),
    ],
)
def test_a_pose_that_is_none_is_nan_and_counted(run, tmp_path, caplog, position_m, quat_wxyz):
    model = save(tmp_path / "model.pt", answering(position_m, quat_wxyz))
    _, *rows = localized(model, tmp_path / "poses.csv", run / "seq-01/frame-000000.color.png")
    pose = np.float64(rows[0][1:8])
    assert rows[0][8] == "no pose"
    np.testing.assert_array_equal(pose[:3], position_m)
    assert np.isnan(pose[3:]).all() == (quat_wxyz != [1.0, 0.0, 0.0, 0.0])
    assert "1 of 1 poses are not finite" in caplog.text


@pytest.mark.parametrize("length", [1e-30, 1e-3, 1.0, 1e30])
def test_a_quaternion_of_any_length_but_0_is_a_rotation(length):
    trained = answering([0.0, 0.0, 0.0], [-0.6 * length, 0.0, 0.8 * length, 0.0])
    images = torch.zeros((2, 3, PX, PX), dtype=torch.uint8)
    _, quat_wxyz = predict(trained, images)
    np.testing.assert_allclose(quat_wxyz, [[0.6, 0.0, -0.8, 0.0]] * 2, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(quat_wxyz, axis=1), 1.0, atol=1e-15)


def shrunk(tmp_path, image, name="p.png", **options):
    image.save(tmp_path / name, **options)
    return read_picture(tmp_path / name, PX)


@pytest.fixture
def upright():
    return Image.fromarray(picture(np.random.default_rng(3)))


def with_alpha(image, alpha):
    image = image.copy()
    image.putalpha(alpha)
    return image


def grey(image):
    return Image.merge("RGB", [image.convert("L")] * 3)


def palette(image):
    return image.quantize(64)


def same(image):
    return image


# What is stored, with what options, and what it means.
STORED = {
    "grey": (lambda image: image.convert("L"), {}, grey),
    "palette": (palette, {}, palette),
    "palette, one clear": (palette, {"transparency": 0}, palette),
    "palette, alpha": (palette, {"transparency": b"\x00\x80\xff"}, palette),
    **{f"alpha {a}": (lambda image, a=a: with_alpha(image, a), {}, same) for a in (0, 128, 255)},
}


@pytest.mark.parametrize("kind", STORED)
def test_a_picture_means_its_colours(kind, tmp_path, upright):
    stored, options, meaning = STORED[kind]
    found = shrunk(tmp_path, stored(upright), **options)
    expected = shrunk(tmp_path, meaning(upright).convert("RGB"), "expected.png")
    np.testing.assert_array_equal(found, expected)


def test_sixteen_bits_become_their_upper_eight_and_a_picture_is_turned_upright(tmp_path, upright):
    deep = np.asarray(upright)[:, :, ::-1].astype(np.uint16) * 256 + 77
    assert cv2.imwrite(str(tmp_path / "deep.png"), deep)
    found = read_picture(tmp_path / "deep.png", PX)
    np.testing.assert_array_equal(found, shrunk(tmp_path, upright))
    exif = Image.Exif()
    exif[0x0112] = 6  # what the camera stored is to be turned to the right
    stored = upright.transpose(Image.Transpose.ROTATE_90)
    found = shrunk(tmp_path, stored, exif=exif)
    np.testing.assert_array_equal(found, shrunk(tmp_path, upright, "upright.png"))
    jpeg = shrunk(tmp_path, stored, "p.jpg", exif=exif, quality=95).astype(int)
    assert np.abs(jpeg - found).mean() < 12  # another orientation is off by 40 and more


TRAINING = FrameCamera(width=52, height=39, fx=37.0, fy=37.0, cx=26.0, cy=19.5)


def described(trained, **changed):
    """The same localizer with another description."""
    description = trained.description.model_copy(update=changed)
    return replace(trained, description=description)


@pytest.fixture
def folder(tmp_path):
    """Pictures of twice the training frames' focal length over their width."""
    (tmp_path / "photos").mkdir()
    rng = np.random.default_rng(7)
    for name in "ab":
        Image.fromarray(picture(rng, 208, 156)).save(tmp_path / f"photos/{name}.png")
    return tmp_path / "photos"


def poses_of(model, folder, *options, status=0):
    out = folder.parent / "poses.csv"
    out.unlink(missing_ok=True)
    given = ["localize", model, folder, "--out", out, "--device", "cpu", *options]
    assert main([str(value) for value in given]) == status
    return np.array([[*row.values()][1:8] for _, row in read_records(out)], float)


def pixels_of(folder, trained, **camera):
    """Return the input of the network for each picture."""
    reader = PictureReader(trained.description, PhotographCamera(**camera), Path("model.pt"))
    return np.stack([reader(path) for path in sorted(folder.iterdir())]).astype(float)


def test_a_calibration_brings_pictures_to_the_training_camera(folder, tmp_path, capsys):
    trained = untrained(camera=TRAINING)
    as_they_are = pixels_of(folder, trained)
    np.testing.assert_array_equal(pixels_of(folder, trained, focal_px=4 * 37.0), as_they_are)
    wide = pixels_of(folder, trained, focal_px=2 * 37.0)
    # The middle half of a picture, twice as large, is what a camera of twice the length sees.
    for path in folder.iterdir():
        with Image.open(path) as opened:
            opened.crop((52, 39, 156, 117)).resize((208, 156), Image.Resampling.BILINEAR).save(path)
    cropped = pixels_of(folder, trained)
    assert np.abs(cropped - wide).mean() < 0.2 * np.abs(cropped - as_they_are).mean()


def test_a_calibration_file_does_what_its_focal_length_does(folder, tmp_path, capsys):
    model = save(tmp_path / "model.pt", untrained(camera=TRAINING))
    poses_of(model, folder)
    assert "brought" not in capsys.readouterr().out
    narrow = poses_of(model, folder, "--focal", 8 * 37)
    said = capsys.readouterr().out
    # A quarter of the training view is seen through twice the focal length.
    assert "all pictures were brought to that view by their focal length; 75" in said
    cameras = tmp_path / "cameras.txt"
    cameras.write_text(f"1 PINHOLE 208 156 {8 * 37} {8 * 37} 104 78\n")
    np.testing.assert_array_equal(poses_of(model, folder, "--camera", cameras), narrow)
    assert "by their calibration; 75" in capsys.readouterr().out


def test_exif_is_asked_unless_it_is_not_to_be(tmp_path, capsys):
    trained = untrained(camera=TRAINING)
    model = save(tmp_path / "model.pt", trained)
    folder = tmp_path / "photos"
    folder.mkdir()
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 50
    taken = Image.fromarray(picture(np.random.default_rng(8), 208, 156))
    taken.save(folder / "a.jpg", exif=exif, quality=95)
    poses_of(model, folder)
    assert "by the focal length in their EXIF" in capsys.readouterr().out
    poses_of(model, folder, "--no-exif")
    assert "EXIF" not in capsys.readouterr().out
    focal_px = 50 * math.hypot(208, 156) / math.hypot(36, 24)
    by_exif = pixels_of(folder, trained)
    np.testing.assert_array_equal(pixels_of(folder, trained, focal_px=focal_px), by_exif)
    assert np.abs(pixels_of(folder, trained, exif=False) - by_exif).mean() > 5


def test_poses_are_in_the_world_of_the_sequence_unless_the_meshs_is_asked_for(
    folder, tmp_path, capsys
):
    moved = pose_matrix(rotation_from_rpy([0.4, -0.3, 2.5]), np.array([3.0, -1.0, 0.5]))
    rows = tuple(tuple(row) for row in moved.tolist())
    model = save(tmp_path / "model.pt", described(untrained(), sequence_from_world=rows))
    in_mesh = poses_of(model, folder, "--world", "mesh")
    assert "2 poses in the world of the mesh" in capsys.readouterr().out
    in_sequence = poses_of(model, folder)
    assert "2 poses in the world of the sequence" in capsys.readouterr().out
    expected = moved @ pose_from_quat(in_mesh[:, :3], in_mesh[:, 3:])
    found = pose_from_quat(in_sequence[:, :3], in_sequence[:, 3:])
    np.testing.assert_allclose(found, expected, atol=5e-6)
    plain = save(tmp_path / "plain.pt", untrained())
    np.testing.assert_array_equal(poses_of(plain, folder), in_mesh)


def test_a_pose_that_is_none_stays_none_in_another_world(folder, tmp_path):
    rows = tuple(tuple(row) for row in np.eye(4).tolist())
    trained = described(answering([1.0, 2.0, 3.0], ZERO), sequence_from_world=rows)
    poses = poses_of(save(tmp_path / "model.pt", trained), folder)
    np.testing.assert_array_equal(poses[:, :3], [[1, 2, 3]] * 2)
    assert np.isnan(poses[:, 3:]).all()


@pytest.mark.parametrize(("x", "beyond"), [(1.9, 0), (2.2, 2), (-1.1, 2)])
def test_poses_far_from_the_training_frames_are_counted(folder, tmp_path, caplog, x, beyond):
    trained = answering([x, 0.5, 0.5], [1.0, 0.0, 0.0, 0.0])
    trained = described(trained, bounds_m=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)))
    model = save(tmp_path / "model.pt", trained)
    done = localize(model, [folder], tmp_path / "poses.csv", "cpu")
    assert done.n_beyond == beyond
    poses_of(model, folder)
    assert ("2 of 2 poses lie far outside" in caplog.text) == bool(beyond)


@pytest.mark.parametrize(
    ("options", "camera", "words"),
    [
        (["--focal", 100], None, "does not say which camera its training frames are of"),
        (["--focal", 100, "--camera", "c.txt"], TRAINING, "--focal: the calibration of --camera"),
        (["--camera", "c.txt"], TRAINING, "c.txt: cannot be read as a calibration"),
    ],
)
def test_calibrations_that_cannot_be_used_are_told(
    folder, tmp_path, capsys, options, camera, words
):
    model = save(tmp_path / "model.pt", untrained(camera=camera))
    out = tmp_path / "none.csv"
    assert words in refused(capsys, "localize", model, folder, "--out", out, *options)
    assert not out.exists()


def test_a_calibration_of_other_proportions_names_the_picture(folder, tmp_path, capsys):
    model = save(tmp_path / "model.pt", untrained(camera=TRAINING))
    cameras = tmp_path / "cameras.txt"
    cameras.write_text("1 PINHOLE 640 360 500 500 320 180\n")
    given = ["localize", model, folder, "--out", tmp_path / "none.csv", "--camera", cameras]
    line = refused(capsys, *given)
    assert f"{folder / 'a.png'}: its camera {cameras} is of 640x360" in line


def test_without_a_calibration_nothing_is_resampled(folder, tmp_path):
    model = save(tmp_path / "model.pt", untrained(camera=TRAINING))
    done = localize(model, [folder], tmp_path / "p.csv", "cpu", camera=PhotographCamera())
    assert (done.n_resampled, done.calibration, done.outside) == (0, None, 0.0)


def test_heic_in_a_folder_is_counted_where_it_cannot_be_read(folder, monkeypatch, caplog):
    (folder / "IMG_0001.HEIC").write_bytes(b"\0\0\0\x1cftypheic" + bytes(100))
    assert [path.name for path in find_pictures([folder])] == ["IMG_0001.HEIC", "a.png", "b.png"]
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    assert [path.name for path in find_pictures([folder])] == ["a.png", "b.png"]
    assert "1 of 3 photographs are HEIC (IMG_0001.HEIC, ...) and left out" in caplog.text
    for name in "ab":
        (folder / f"{name}.png").unlink()
    with pytest.raises(InputError, match=r"1 of 1 photographs are HEIC.*synfeal\[heic\]"):
        find_pictures([folder])
