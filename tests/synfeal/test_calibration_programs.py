"""Calibration files of other programs, by their descriptions; OpenCV projects the points."""

import json

import cv2
import numpy as np
import pytest

from synfeal.camera.calibration import read_calibration
from synfeal.camera.projection import pixels_of_points
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError

pytestmark = pytest.mark.portable

WIDTH, HEIGHT = 752, 480
FX, FY, CX, CY = 458.654, 457.296, 367.215, 248.375
K1, K2, P1, P2 = -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05
LENS, NONE = (K1, K2, P1, P2), (0.0, 0.0, 0.0, 0.0)
WIDE = (0.0034, 0.0007, -0.0020, 0.0002)
MATRIX = np.array([[FX, 0, CX], [0, FY, CY], [0, 0, 1]])

KALIBR = f"""\
cam0:
  cam_overlaps: []
  camera_model: pinhole
  distortion_coeffs: [{K1}, {K2}, {P1}, {P2}]
  distortion_model: radtan
  intrinsics: [{FX}, {FY}, {CX}, {CY}]
  resolution: [{WIDTH}, {HEIGHT}]
  rostopic: /cam0/image_raw
"""
KALIBR_WIDE = KALIBR.replace("radtan", "equidistant").replace(
    f"[{K1}, {K2}, {P1}, {P2}]", str(list(WIDE))
)
EUROC = f"""\
# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)
T_BS:
  cols: 4
  rows: 4
  data: [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
rate_hz: 20
resolution: [{WIDTH}, {HEIGHT}]
camera_model: pinhole
intrinsics: [{FX}, {FY}, {CX}, {CY}] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [{K1}, {K2}, {P1}, {P2}]
"""
ROS2 = f"""\
header:
  stamp:
    sec: 1700000000
    nanosec: 12345
  frame_id: camera_color_optical_frame
height: {HEIGHT}
width: {WIDTH}
distortion_model: plumb_bob
d:
- {K1}
- {K2}
- {P1}
- {P2}
- 0.0
k:
- {FX}
- 0.0
- {CX}
- 0.0
- {FY}
- {CY}
- 0.0
- 0.0
- 1.0
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [{FX}, 0.0, {CX}, 0.0, 0.0, {FY}, {CY}, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
"""
ROS1 = (
    f"height: {HEIGHT}\nwidth: {WIDTH}\ndistortion_model: 'plumb_bob'\n"
    f"D: [{K1}, {K2}, {P1}, {P2}, 0]\n"
    f"K: [{FX}, 0.0, {CX}, 0.0, {FY}, {CY}, 0.0, 0.0, 1.0]\nbinning_x: 1\nbinning_y: 1\n"
)
REALSENSE = {"width": WIDTH, "height": HEIGHT, "ppx": CX, "ppy": CY, "fx": FX, "fy": FY}
ORBSLAM3 = f"""\
%YAML:1.0

#--- Camera Parameters. Adjust them!
File.version: "1.0"
Camera.type: "PinHole"

# Camera calibration and distortion parameters (OpenCV)
Camera1.fx: {FX}
Camera1.fy: {FY}
Camera1.cx: {CX}
Camera1.cy: {CY}

Camera1.k1: {K1}
Camera1.k2: {K2}
Camera1.p1: {P1}
Camera1.p2: {P2}

Camera.width: {WIDTH}
Camera.height: {HEIGHT}
Camera.newWidth: 600
Camera.newHeight: 350
Camera.fps: 20
Camera.RGB: 1
ORBextractor.nFeatures: 1000
"""
ORBSLAM2 = ORBSLAM3.replace("Camera1.", "Camera.")
KANNALA = ORBSLAM2.replace('"PinHole"', '"KannalaBrandt8"')
for old, new in zip(("k1", "k2", "p1", "p2"), range(4), strict=True):
    KANNALA = KANNALA.replace(f"Camera.{old}: {LENS[new]}", f"Camera.k{new + 1}: {WIDE[new]}")
OPEN3D = {
    "height": HEIGHT,
    "intrinsic_matrix": [FX, 0, 0, 0, FY, 0, CX, CY, 1],  # by columns
    "width": WIDTH,
}
VINS = f"""\
%YAML:1.0
---
model_type: PINHOLE
camera_name: camera
image_width: {WIDTH}
image_height: {HEIGHT}
distortion_parameters:
   k1: {K1}
   k2: {K2}
   p1: {P1}
   p2: {P2}
projection_parameters:
   fx: {FX}
   fy: {FY}
   cx: {CX}
   cy: {CY}
"""
STELLA = f"""\
Camera:
  name: "EuRoC monocular"
  setup: "monocular"
  model: "perspective"
  fx: {FX}
  fy: {FY}
  cx: {CX}
  cy: {CY}
  k1: {K1}
  k2: {K2}
  p1: {P1}
  p2: {P2}
  k3: 0.0
  fps: 20.0
  cols: {WIDTH}
  rows: {HEIGHT}
  color_order: "Gray"
Feature:
  scale_factor: 1.2
"""


# COLMAP's centre of the first pixel is half a pixel further than OpenCV's.
NERFSTUDIO = {"w": WIDTH, "h": HEIGHT, "fl_x": FX, "fl_y": FY, "cx": CX + 0.5, "cy": CY + 0.5}
NERFSTUDIO |= {"aabb_scale": 16, "frames": []}


def realsense(model, coeffs):
    return json.dumps({**REALSENSE, "model": model, "coeffs": coeffs})


FILES = {
    "kalibr.yaml": (KALIBR, LENS),
    "euroc.yaml": (EUROC, LENS),
    "ros2.yaml": (ROS2, LENS),
    "ros2-twice.yaml": (ROS2 + ROS2, LENS),
    "ros1.yaml": (ROS1, LENS),
    "realsense.json": (realsense("distortion.brown_conrady", [*LENS, 0.0]), LENS),
    "realsense-d435.json": (realsense("distortion.inverse_brown_conrady", [0.0] * 5), NONE),
    "realsense-enum.json": (realsense(4, [*LENS, 0.0]), LENS),
    "orbslam3.yaml": (ORBSLAM3, LENS),
    "orbslam2.yaml": (ORBSLAM2, LENS),
    "open3d.json": (json.dumps(OPEN3D), NONE),
    "open3d-pose.json": (
        json.dumps({"class_name": "PinholeCameraParameters", "extrinsic": [], "intrinsic": OPEN3D}),
        NONE,
    ),
    "open3d-poses.json": (json.dumps({"parameters": [{"intrinsic": OPEN3D}] * 2}), NONE),
    "transforms.json": (
        json.dumps({**NERFSTUDIO, "k1": K1, "k2": K2, "p1": P1, "p2": P2, "k3": 0}),
        LENS,
    ),
    "vins.yaml": (VINS, LENS),
    "stella.yaml": (STELLA, LENS),
}
FISHEYES = {
    "kalibr.yaml": KALIBR_WIDE,
    "orbslam.yaml": KANNALA,
    "transforms.json": json.dumps(
        {**NERFSTUDIO, "camera_model": "OPENCV_FISHEYE"}
        | dict(zip(("k1", "k2", "k3", "k4"), WIDE, strict=True))
    ),
    "t265.json": realsense("distortion.kannala_brandt4", [*WIDE, 0.0]),
}


def points():
    rng = np.random.default_rng(0)
    return np.column_stack([rng.uniform(-0.6, 0.6, (50, 2)), np.ones(50)])


@pytest.mark.parametrize("name", FILES)
def test_a_calibration_projects_as_opencv_does(name, tmp_path):
    text, lens = FILES[name]
    (tmp_path / name).write_text(text)
    camera = CameraConfig(calibration=tmp_path / name)
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    expected = cv2.projectPoints(points(), np.zeros(3), np.zeros(3), MATRIX, np.array(lens))[0]
    found = pixels_of_points(camera, points())
    np.testing.assert_allclose(found, expected[:, 0] + 0.5, atol=1e-9)


def brown_conrady(place, k1, k2, p1, p2, k3):
    """The polynomial that librealsense evaluates, of places (N, 2)."""
    x, y = place.T
    square = x**2 + y**2
    radial = 1 + k1 * square + k2 * square**2 + k3 * square**3
    across = 2 * p1 * x * y + p2 * (square + 2 * x**2)
    down = 2 * p2 * x * y + p1 * (square + 2 * y**2)
    return place * radial[:, None], np.column_stack([across, down])


@pytest.mark.parametrize("model", ["inverse_brown_conrady", "modified_brown_conrady"])
def test_the_other_models_of_realsense_are_fitted_to_a_tenth_of_a_pixel(model, tmp_path):
    """Of a D455's size: the inverse one goes from the image to the ray."""
    coefficients = (-0.0554, 0.0655, -0.0006, 0.0009, -0.0209)
    (tmp_path / "d455.json").write_text(realsense(model, coefficients))
    camera = CameraConfig(calibration=tmp_path / "d455.json")
    rng = np.random.default_rng(3)
    pixel = rng.uniform([0, 0], [WIDTH - 1, HEIGHT - 1], (300, 2))
    place = (pixel - [CX, CY]) / [FX, FY]
    radial, tangential = brown_conrady(place, *coefficients)
    if model.startswith("inverse"):
        ray, shown = radial + tangential, pixel
    else:
        _, tangential = brown_conrady(radial, *coefficients)
        ray, shown = place, (radial + tangential) * [FX, FY] + [CX, CY]
    found = pixels_of_points(camera, np.column_stack([ray, np.ones(len(ray))]))
    assert np.abs(found - 0.5 - shown).max() < 0.1
    assert np.abs(pixel - (ray * [FX, FY] + [CX, CY])).max() > (2.0 if "inverse" in model else -1)


@pytest.mark.parametrize("name", FISHEYES)
def test_a_fisheye_projects_as_opencv_does(name, tmp_path):
    (tmp_path / name).write_text(FISHEYES[name])
    camera = CameraConfig(calibration=tmp_path / name)
    assert camera.projection == "fisheye"
    expected = cv2.fisheye.projectPoints(
        points()[:, None], np.zeros(3), np.zeros(3), MATRIX, np.array(WIDE)
    )[0]
    np.testing.assert_allclose(pixels_of_points(camera, points()), expected[:, 0] + 0.5, atol=1e-9)


SECOND = KALIBR.replace("cam0", "cam1").replace(str(FX), "460.0")


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.yaml", KALIBR + SECOND, "holds 2 cameras (cam0, cam1); keep the one you want"),
        ("a.yaml", KALIBR.replace("pinhole", "omni"), "cam0.camera_model: 'omni' is not read"),
        ("a.yaml", KALIBR.replace("radtan", "fov"), "cam0.distortion_model: 'fov' is not read"),
        ("a.yaml", KALIBR.replace(f"{FX}, ", ""), "cam0.intrinsics: must hold 4 numbers, found 3"),
        ("a.yaml", ROS2.replace("x_offset: 0", "x_offset: 8"), "roi: the images are a part"),
        ("a.yaml", ROS2.replace("binning_x: 0", "binning_x: 2"), "binning_x: images of merged"),
        ("a.yaml", ROS2.replace(f"- {FX}", "- 0.0", 1), "fx: a focal length is a positive number"),
        ("a.json", realsense("ftheta", [0.1, 0, 0, 0, 0]), "model: 'ftheta'"),
        (
            "a.json",
            realsense("inverse_brown_conrady", [9.0, 0, 0, 0, 0]),
            "model: 'inverse brown conrady' with these",
        ),
        ("a.json", realsense("inverse_brown_conrady", [0.1, 0, 0]), "coeffs: must hold 5"),
        ("a.yaml", ORBSLAM2.replace("Camera.width", "#"), "Camera.width: missing"),
        ("a.json", json.dumps({**OPEN3D, "width": None}), "image_width: must hold numbers"),
        ("a.json", json.dumps({**NERFSTUDIO, "fl_y": "wide"}), "fl_y: must hold numbers"),
        ("a.json", json.dumps({**NERFSTUDIO, "k4": 0.1}), "k4: only k1, k2, p1, p2 and k3"),
        ("a.json", json.dumps({"parameters": []}), "parameters: hold no camera"),
        ("a.yaml", VINS.replace("PINHOLE", "MEI"), "model_type: 'MEI' is not read"),
    ],
)
def test_what_cannot_be_used_names_the_key(name, text, words, tmp_path):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError) as refusal:
        read_calibration(path, with_fisheye=True)
    assert str(refusal.value).startswith(f"{path}: {words}")


@pytest.mark.parametrize("rows", [3, 4])
def test_a_matrix_without_a_size_is_told_what_to_write(rows, tmp_path):
    matrix = np.eye(4)
    matrix[:3, :3] = [[585, 0, 320], [0, 586, 240], [0, 0, 1]]
    path = tmp_path / "camera-intrinsics.txt"
    np.savetxt(path, matrix[:rows, :rows])
    with pytest.raises(InputError, match=rf"matrix of {rows} x {rows}") as refusal:
        read_calibration(path)
    line = str(refusal.value).split("'")[1].replace("WIDTH", "640").replace("HEIGHT", "480")
    path.write_text(line)
    found = read_calibration(path)
    assert (found.fx, found.fy, found.cx, found.cy) == (585, 586, 320, 240)
    np.savetxt(path, np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0])
    with pytest.raises(InputError, match="is it a pose"):
        read_calibration(path)


def test_colmaps_cameras_of_every_image_are_one_if_they_are_alike(tmp_path):
    path = tmp_path / "cameras.txt"
    path.write_text("".join(f"{i} PINHOLE 640 480 500 501 320 240\n" for i in (1, 2, 3)))
    assert read_calibration(path).fy == 501
    path.write_text(path.read_text() + "4 PINHOLE 640 480 500 502 320 240\n")
    with pytest.raises(InputError, match="holds 4 cameras"):
        read_calibration(path)
