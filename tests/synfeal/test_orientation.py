"""Photographs that EXIF turns, and their calibration and pose with them."""

import sys

import cv2
import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.camera.calibration import Calibration
from synfeal.camera.orientation import (
    Orientation,
    orientation_of,
    stored_from_upright,
    turned,
    upright,
)
from synfeal.camera.photograph import PhotographCamera
from synfeal.captures.formats import read_capture
from synfeal.dataset.images import read_image
from synfeal.errors import InputError
from synfeal.evaluation.run import Settings, evaluate
from tests.support import capture_writers
from tests.synfeal.test_evaluate_photographs import pose_of
from tests.synfeal.test_images import UPRIGHT

SENSOR = Calibration(40, 30, 34.0, 32.0, 22.5, 13.0, (-0.2, 0.05, 0.01, -0.02, 0.004))


def matrix(camera):
    """OpenCV's, which puts the centre of the first pixel at (0, 0)."""
    return np.array([[camera.fx, 0, camera.cx - 0.5], [0, camera.fy, camera.cy - 0.5], [0, 0, 1]])


@pytest.mark.portable
@pytest.mark.parametrize("turn", Orientation)
def test_opencv_sees_every_pixel_where_the_turned_picture_has_it(turn):
    columns, rows = np.meshgrid(np.arange(40.0), np.arange(30.0))
    stored = np.stack([columns, rows], axis=-1)
    shown = UPRIGHT[turn](stored)  # by pixel of the upright picture: where it is stored
    pixels = shown.reshape(-1, 1, 2)
    rays = cv2.undistortPoints(
        pixels, matrix(SENSOR), np.array(SENSOR.distortion), criteria=(3, 200, 1e-13)
    )
    points = np.concatenate([rays[:, 0], np.ones((len(rays), 1))], axis=1)
    if turn.is_mirrored:
        points *= [-1.0, 1.0, 1.0]
    points = points @ stored_from_upright(turn)[:3, :3]  # the inverse, on rows
    camera = turned(SENSOR, turn)
    assert (camera.height, camera.width) == shown.shape[:2]
    seen = cv2.projectPoints(
        points, np.zeros(3), np.zeros(3), matrix(camera), np.array(camera.distortion)
    )[0]
    expected = np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), axis=-1)
    np.testing.assert_allclose(seen.reshape(expected.shape), expected, atol=1e-5)
    back = turned(camera, turn.back)
    assert (back.width, back.cx, back.fy) == pytest.approx((40, 22.5, 32.0))
    assert back.distortion == pytest.approx(SENSOR.distortion)


def photograph(width, height, turn=Orientation.UPRIGHT):
    exif = Image.Exif()
    exif[0x0112] = int(turn)
    image = Image.new("RGB", (width, height))
    image.info["exif"] = exif.tobytes()
    return upright(image)


@pytest.mark.portable
def test_the_file_of_the_sensor_is_scaled_and_turned_with_the_photograph():
    camera = PhotographCamera(SENSOR)
    image, turn = photograph(80, 60, Orientation.TURNED_90)
    assert image.size == (60, 80)
    found = camera.of(image, "p.jpg", turn)
    assert (found.width, found.height, found.fx, found.fy) == (60, 80, 64.0, 68.0)
    assert (found.cx, found.cy) == (60 - 26.0, 45.0)
    assert camera.turns_with(image, turn)
    image, turn = photograph(40, 30, Orientation.TURNED_180)
    found = camera.of(image, "p.jpg", turn)
    assert (found.cx, found.cy) == (40 - 22.5, 30 - 13.0)


@pytest.mark.portable
def test_a_file_of_upright_photographs_is_taken_as_it_is():
    upright_file = turned(SENSOR, Orientation.TURNED_90)
    image, turn = photograph(40, 30, Orientation.TURNED_90)
    camera = PhotographCamera(upright_file)
    assert camera.of(image, "p.jpg", turn) == upright_file
    assert not camera.turns_with(image, turn)


@pytest.mark.portable
def test_a_picture_that_was_turned_without_a_word_is_refused():
    image, turn = photograph(30, 40)
    with pytest.raises(InputError, match=r"p\.jpg: its camera None is of 40x30.*which way"):
        PhotographCamera(SENSOR).of(image, "p.jpg", turn)


def test_heic_is_turned_once_and_says_how(tmp_path):
    pytest.importorskip("pillow_heif").register_heif_opener()
    pixels = np.zeros((96, 128, 3), np.uint8)
    pixels[:48, :64] = 255  # the stored picture's first quarter
    exif = Image.Exif()
    exif[0x0112] = 6
    path = tmp_path / "IMG_0001.HEIC"
    Image.fromarray(pixels).save(path, format="HEIF", exif=exif.tobytes())
    image, turn = upright(read_image(path, "RGB"))
    assert turn is Orientation.TURNED_90
    assert orientation_of(image) is Orientation.UPRIGHT  # it is not turned again
    shown = np.asarray(image)
    assert shown.shape == (128, 96, 3)
    assert shown[20, 80].min() > 200  # top right
    assert shown[20, 20].max() < 50


@pytest.mark.parametrize("damage", ["cut", "overwritten"])
def test_damaged_heic_is_told_in_a_line(damage, tmp_path):
    pytest.importorskip("pillow_heif").register_heif_opener()
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 255, (96, 128, 3), np.uint8)
    path = tmp_path / "a.heic"
    Image.fromarray(noise).save(path, format="HEIF")
    content = bytearray(path.read_bytes())
    if damage == "cut":
        content = content[: len(content) // 2]
    else:
        content[200:600] = rng.bytes(400)
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"a\.heic: cannot be read as an image"):
        read_image(path, "RGB")


def test_without_its_reader_heic_names_the_extra(tmp_path, monkeypatch):
    path = tmp_path / "a.heic"
    path.write_bytes(b"\0\0\0\x1cftypheic" + bytes(100))
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    with pytest.raises(InputError, match=r"a\.heic: is HEIC.*synfeal\[heic\]"):
        read_image(path, "RGB")


def colmap_model(folder, calibrated, turn, number=0):
    """One photograph of a model, stored so that EXIF turns it; what is calibrated is a choice."""
    seen = capture_writers.shots().rgb[number]
    exif = Image.Exif()
    exif[0x0112] = int(turn)
    (folder / "images").mkdir(parents=True)
    Image.fromarray(seen).save(folder / "images/a.png", exif=exif)
    model = folder / "sparse/0"
    model.mkdir(parents=True)
    (model / "cameras.txt").write_text(
        f"1 PINHOLE {calibrated.width} {calibrated.height} {calibrated.fx} {calibrated.fy}"
        f" {calibrated.cx} {calibrated.cy}\n"
    )
    (model / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    (model / "points3D.txt").write_text("")
    return folder, seen


@pytest.mark.parametrize("is_upright", [False, True], ids=["stored", "upright"])
def test_a_model_of_colmap_is_of_the_pixels_that_have_its_size(is_upright, tmp_path):
    camera = capture_writers.camera(capture_writers.WIDTH, capture_writers.HEIGHT)
    stored = Calibration(camera.width, camera.height, *camera.intrinsics, (0.0,) * 5)
    turn = Orientation.TURNED_90
    calibrated = turned(stored, turn) if is_upright else stored
    path, seen = colmap_model(tmp_path / "model", calibrated, turn)
    frame = read_capture(path).frames[0]
    expected = UPRIGHT[turn](seen) if is_upright else seen
    np.testing.assert_array_equal(frame.read_color(), expected)
    assert frame.camera == calibrated


def test_a_photograph_of_other_proportions_is_not_squeezed(tmp_path):
    other = Calibration(240, 240, 180.0, 180.0, 120.0, 120.0, (0.0,) * 5)
    path, _ = colmap_model(tmp_path / "model", other, Orientation.UPRIGHT)
    with pytest.raises(InputError, match=r"a\.png: is of 240 x 180 pixels.*240 x 240"):
        read_capture(path)


@pytest.mark.parametrize("of_upright", [True, False])
def test_estimates_of_turned_photographs_are_scored_by_what_they_are_of(
    of_upright, tmp_path, caplog
):
    folder = tmp_path / "photos"
    folder.mkdir()
    turns = [Orientation.TURNED_90, Orientation.UPRIGHT, Orientation.TURNED_180]
    lines = ["image,tx,ty,tz,qw,qx,qy,qz"]
    for number, turn in enumerate(turns):
        exif = Image.Exif()
        exif[0x0112] = int(turn)
        name = f"frame-{number:06d}"
        Image.new("RGB", (8, 6)).save(folder / f"{name}.color.jpg", exif=exif)
        stored = pose_of(number)
        np.savetxt(folder / f"{name}.pose.txt", stored)
        # Turned clockwise, what was at the left is at the top: the camera itself turned back.
        clockwise_deg = {1: 0, 3: 180, 6: 90}[int(turn)]
        back = Rotation.from_euler("z", -clockwise_deg * of_upright, degrees=True)
        x, y, z, w = (Rotation.from_matrix(stored[:3, :3]) * back).as_quat()
        lines.append(",".join(map(str, (f"{name}.color.jpg", *stored[:3, 3], w, x, y, z))))
    estimates = tmp_path / "poses.csv"
    estimates.write_text("\n".join(lines) + "\n")
    found = evaluate(folder, estimates, Settings())
    np.testing.assert_allclose(found.errors["orientation_deg"], 0.0, atol=1e-5)
    said = "turned with them" if of_upright else "as they are stored"
    assert "EXIF turns 2 of 3 photographs; the estimates fit the poses of " in caplog.text
    assert said in caplog.text
