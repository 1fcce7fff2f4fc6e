"""Calibration files as their tools write them, and as they should not be."""

import dataclasses
import json
import re

import cv2
import numpy as np
import pycolmap
import pytest
import yaml

from reproduction.config.load import load_config, parse_config
from reproduction.design.experiments import read_experiments
from synfeal.camera.calibration import Calibration, read_calibration
from synfeal.camera.projection import pixels_of_normalised
from synfeal.config.dataset import CameraConfig
from synfeal.config.load import merge, read_yaml
from synfeal.errors import InputError
from tests import CONFIG

MATRIX = np.array([[3100.25, 0, 2015.5], [0, 3098.75, 1511.5], [0, 0, 1]])
LENS = (-0.28, 0.09, 0.001, -0.0007, -0.01)

ROS = """\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [5e2, 0, 319.5, 0, 501, 239.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.2, 0.05, 1e-3, -2.0e-3, 0.0]
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
"""
OLD_OPENCV = """\
%YAML:1.0
---
image_width: 640
image_height: 480
Camera_Matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.0000000000000000e+02, 0., 3.1950000000000000e+02, 0.,
       5.0100000000000000e+02, 2.3950000000000000e+02, 0., 0., 1. ]
Distortion_Coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.0000000000000001e-01, 5.0000000000000003e-02, 1.0e-03, -2.0e-03, 0. ]
"""
COLMAP = """\
# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 1
1 FULL_OPENCV 640 480 500 501 320 240 -0.2 0.05 0.001 -0.002 0 0 0 0
"""
FILES = {"ros.yaml": ROS, "old.yml": OLD_OPENCV, "cameras.txt": COLMAP}


def stored(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("ending", ["yaml", "yml", "json"])
def test_what_opencv_writes_is_read(tmp_path, ending):
    path = tmp_path / f"phone.{ending}"
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("image_width", 4032)
    file.write("image_height", 3024)
    file.write("camera_matrix", MATRIX)
    file.write("distortion_coefficients", np.array([LENS]))
    file.release()
    found = read_calibration(path)
    assert (found.width, found.height) == (4032, 3024)
    assert (found.fx, found.fy, found.cx, found.cy) == (3100.25, 3098.75, 2016.0, 1512.0)
    assert found.distortion == LENS


@pytest.mark.parametrize(("name", "text"), FILES.items(), ids=FILES)
def test_one_camera_in_three_formats_is_one_camera(tmp_path, name, text):
    found = read_calibration(stored(tmp_path, name, text))
    assert (found.width, found.height) == (640, 480)
    assert (found.fx, found.fy, found.cx, found.cy) == (500.0, 501.0, 320.0, 240.0)
    assert found.distortion == (-0.2, 0.05, 0.001, -0.002, 0.0)


@pytest.mark.parametrize(
    "model", ["SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV"]
)
def test_a_colmap_camera_projects_as_in_colmap(tmp_path, model):
    camera = pycolmap.Camera.create_from_model_name(1, model, 500.0, 640, 480)
    n_lens = len(camera.params) - {"S": 3, "R": 3}.get(model[0], 4)
    n_lens = 0 if model == "SIMPLE_PINHOLE" else n_lens
    lens = np.array([-0.2, 0.05, 0.001, -0.002, 0.01, 0.0, 0.0, 0.0])[:n_lens]
    camera.params = [*camera.params[: len(camera.params) - n_lens], *lens]
    model_dir = pycolmap.Reconstruction()
    model_dir.add_camera(camera)
    model_dir.write_text(str(tmp_path))
    found = CameraConfig(calibration=tmp_path / "cameras.txt")

    normalised = np.random.default_rng(0).uniform(-0.6, 0.6, (30, 2))
    expected = camera.img_from_cam(np.column_stack([normalised, np.ones(30)]))
    np.testing.assert_allclose(pixels_of_normalised(found, normalised), expected, atol=1e-9)


def test_scaling_keeps_every_ray():
    """A point in the middle of the image, or on its edge, stays there."""
    path_values = {"fx": 3100.0, "fy": 3000.0, "cx": 2000.0, "cy": 1500.0}
    full = Calibration(4032, 3024, **path_values, distortion=LENS)
    small = full.scaled(640, None)
    assert (small.width, small.height) == (640, 480)
    assert small.distortion == LENS
    for edge in (0, 0.5, 1):
        assert (edge * 640 - small.cx) / small.fx == pytest.approx((edge * 4032 - 2000) / 3100)
        assert (edge * 480 - small.cy) / small.fy == pytest.approx((edge * 3024 - 1500) / 3000)
    assert full.scaled(None, 480) == full.scaled(640, 480) == small
    assert full.scaled(None, None) == full
    with pytest.raises(ValueError, match=r"4032x3024.*640x360; 640x480 keeps"):
        full.scaled(640, 360)


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("ros.yaml", "plumb_bob", "omnidirectional", ["distortion_model", "'omnidirectional'"]),
        ("ros.yaml", "plumb_bob", "equidistant", ["distortion_coefficients", "4 numbers, found 5"]),
        ("ros.yaml", "image_width: 640", "", ["image_width", "missing"]),
        ("ros.yaml", "[5e2, 0,", "[-500, 0,", ["fx", "positive", "-500"]),
        ("ros.yaml", "[5e2, 0,", "[500, 2,", ["camera_matrix", "without skew"]),
        ("ros.yaml", "[5e2, 0,", "[500,", ["camera_matrix", "9 numbers, found 8"]),
        ("ros.yaml", "319.5", "959.5", ["cx", "960", "outside the image of 640x480"]),
        ("ros.yaml", "[-0.2, 0.05, 1e-3", "[1e-3", ["distortion_coeff", "4 or 5", "found 3"]),
        ("ros.yaml", "width: 640", "width: 640.5", ["image_width", "whole number", "640.5"]),
        ("ros.yaml", "width: 640", "width: true", ["image_width", "must hold numbers"]),
        ("old.yml", "!!opencv-matrix", "!!python/object:os.system", ["cannot be read"]),
        ("cameras.txt", "FULL_OPENCV", "FOV", ["MODEL", "'FOV'", "PINHOLE"]),
        ("cameras.txt", "FULL_OPENCV", "OPENCV_FISHEYE", ["PARAMS", "8 numbers, found 12"]),
        ("cameras.txt", "FULL_OPENCV", "EQUIRECTANGULAR", ["EQUIRECTANGULAR", "projection"]),
        ("cameras.txt", "FULL_OPENCV", "PINHOLE", ["PARAMS", "4 numbers, found 12"]),
        ("cameras.txt", "0 0 0\n", "0 0 0.1\n", ["PARAMS", "0.1"]),
        ("cameras.txt", COLMAP, "", ["one line with CAMERA_ID"]),
        ("cameras.txt", "0 0 0\n", "0 0 0\n2 PINHOLE 9 9 5 5 5 5\n", ["2 cameras", "of its own"]),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(tmp_path, name, old, new, words):
    assert old in FILES[name]
    path = stored(tmp_path, name, FILES[name].replace(old, new))
    with pytest.raises(InputError) as refusal:
        read_calibration(path)
    message = str(refusal.value)
    assert message.startswith(f"{path}: ")
    assert len(message) < 500 + len(str(path))
    assert all(word in message for word in words), message


def test_a_missing_or_binary_file_says_what_to_do(tmp_path):
    with pytest.raises(InputError, match=r"no\.yaml: cannot be read"):
        read_calibration(tmp_path / "no.yaml")
    with pytest.raises(InputError, match="colmap model_converter --input_path"):
        read_calibration(tmp_path / "cameras.bin")


def test_a_profile_names_a_calibration_and_holds_its_numbers(tmp_path, monkeypatch):
    monkeypatch.chdir(CONFIG.parent)
    path = stored(tmp_path, "phone.yaml", ROS)
    profile = stored(tmp_path, "my.yaml", f"network_camera: {{calibration: {path}, width: 320}}\n")
    raw = merge(read_yaml(CONFIG / "config.yaml"), {"network_camera": {"height": 240}})
    override = yaml.safe_load(profile.read_text())
    camera = parse_config(merge(raw, override)).network_camera
    assert (camera.width, camera.height, camera.fx, camera.cx) == (320, 240, 250.0, 160.0)
    dumped = camera.model_dump(mode="json")
    assert "calibration" not in dumped
    path.unlink()
    assert CameraConfig.model_validate(dumped) == camera
    with pytest.raises(InputError, match=r"^my\.yaml: network_camera\.calibration: .*phone\.yaml"):
        parse_config(merge(raw, override), "my.yaml")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"fx": 500.0}, "calibration: fx comes from the file"),
        ({"distortion": LENS}, "calibration: distortion comes from the file"),
        ({"width": 640, "height": 360}, "does not scale to 640x360; 640x480 keeps"),
        ({"calibration": 5}, "calibration: must be a path"),
    ],
)
def test_values_beside_a_calibration_must_agree(tmp_path, values, words):
    path = stored(tmp_path, "phone.yaml", ROS)
    with pytest.raises(ValueError, match=words):
        CameraConfig.model_validate({"calibration": path, **values})


def test_depth_methods_refuse_a_distorted_camera(monkeypatch, tmp_path):
    monkeypatch.chdir(CONFIG.parent)
    config = load_config(CONFIG / "config.yaml")
    camera = config.estimation_camera.model_copy(update={"distortion": LENS})
    distorted = config.model_copy(update={"estimation_camera": camera})
    with pytest.raises(InputError, match=r"experiments\.csv: row \d+: labels 'rgbd.*distortion"):
        read_experiments(distorted)
    rows = config.experiments.read_text().splitlines(keepends=True)
    kept = [row for row in rows if not any(word in row for word in ("rgbd", "kinect"))]
    only_sfm = stored(tmp_path, "experiments.csv", "".join(kept))
    assert read_experiments(distorted.model_copy(update={"experiments": only_sfm}))


def test_files_of_scripts_and_of_the_documentation_are_read(tmp_path):
    values = {"image_size": [640, 480], "mtx": [[500, 0, 319.5], [0, 501, 239.5], [0, 0, 1]]}
    values["dist"] = [[-0.2, 0.05, 0.001, -0.002]]
    as_json = read_calibration(stored(tmp_path, "a.json", json.dumps(values)))
    as_yaml = read_calibration(stored(tmp_path, "a.yaml", yaml.safe_dump(values)))
    ros = read_calibration(stored(tmp_path, "ros.yaml", ROS))
    assert as_json == as_yaml == ros
    page = (CONFIG.parent / "docs" / "cameras.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```(?:yaml)?\n(.*?)```", page, re.DOTALL)
    opencv = next(block for block in blocks if block.startswith("%YAML"))
    colmap = next(block for block in blocks if block.startswith("# CAMERA_ID"))
    first = read_calibration(stored(tmp_path, "a.yaml", opencv))
    second = read_calibration(stored(tmp_path, "cameras.txt", colmap))
    assert first == dataclasses.replace(second, distortion=first.distortion)
    assert first.distortion[:4] == second.distortion[:4]
