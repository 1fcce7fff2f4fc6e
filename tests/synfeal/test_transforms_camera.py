"""The camera of a transforms.json, as a calibration and in a capture: one form, one reading."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from PIL import Image

from synfeal.camera.calibration import read_calibration
from synfeal.captures.formats import read_capture
from synfeal.errors import InputError

WIDTH, HEIGHT = 64, 48
PINHOLE = {"fl_x": 50.0, "fl_y": 51.0, "cx": 31.0, "cy": 23.5, "w": WIDTH, "h": HEIGHT}
LENS = {"k1": 0.1, "k2": -0.2, "p1": 0.003, "p2": -0.004, "k3": 0.05}
WIDE = {"k1": 0.1, "k2": -0.2, "k3": 0.03, "k4": 0.004}
REFUSED = {
    "a lens that is unknown": ({"camera_model": "DIVISION"}, r"camera_model: 'DIVISION' is not"),
    "a panorama": ({"camera_model": "EQUIRECTANGULAR"}, r"camera_model: 'EQUIRECTANGULAR' is not"),
    "two lenses": ({"camera_model": "OPENCV", "is_fisheye": True}, "is_fisheye: is true, but"),
    "a lens of more coefficients": ({"k4": 0.1}, "k4: only k1, k2, p1, p2 and k3"),
    "a rational lens": ({"camera_model": "FULL_OPENCV", "k6": 0.1}, r"only k1, .*0\.1\] are not 0"),
    "a coefficient in words": ({"k1": "none"}, "k1: must hold numbers"),
    "no focal length": ({"fl_x": None}, "fl_x: must hold numbers"),
    "one that is infinite": ({"fl_y": math.inf}, "finite number"),
    "one that is negative": ({"fl_x": -5.0}, "fx: a focal length is a positive number"),
    "half a pixel": ({"w": 64.5}, "w: must be a whole number of pixels"),
    "a centre outside": ({"cx": 300.0}, "cx: the principal point 300 lies outside"),
}
LACKING = ("cx", "cy", "w", "h", "fl_x")


def written(folder, values):
    """Write a capture of one image whose camera is ``values``; return its transforms.json."""
    Image.new("RGB", (WIDTH, HEIGHT)).save(folder / "0.png")
    frame = {"file_path": "0.png", "transform_matrix": np.eye(4).tolist()}
    (folder / "transforms.json").write_text(json.dumps({**values, "frames": [frame]}))
    return folder / "transforms.json"


def of_calibration(file):
    return read_calibration(file, with_fisheye=True)


def of_capture(file):
    return read_capture(file.parent).frames[0].camera


READERS = pytest.mark.parametrize("read", [of_calibration, of_capture])


@READERS
@pytest.mark.parametrize("case", REFUSED)
def test_a_camera_that_is_not_read_is_refused_by_its_field(read, case, tmp_path):
    changed, said = REFUSED[case]
    file = written(tmp_path, {**PINHOLE, **changed})
    with pytest.raises(InputError, match=said) as refusal:
        read(file)
    assert str(file) in str(refusal.value)


@READERS
@pytest.mark.parametrize("name", LACKING)
def test_a_value_that_is_missing_is_not_guessed(read, name, tmp_path):
    file = written(tmp_path, {key: value for key, value in PINHOLE.items() if key != name})
    with pytest.raises(InputError, match=rf"{name}: missing"):
        read(file)


@READERS
@pytest.mark.parametrize("angle_rad", [0.0, math.pi, -1.0])
def test_an_angle_that_no_lens_has_is_refused(read, angle_rad, tmp_path):
    file = written(tmp_path, {"camera_angle_x": angle_rad, "w": WIDTH, "h": HEIGHT})
    with pytest.raises(InputError, match="camera_angle_x: must be an angle"):
        read(file)


@READERS
def test_lenses_are_read_alike(read, tmp_path):
    found = read(written(tmp_path, {**PINHOLE, **LENS}))
    assert (found.fx, found.fy, found.cx, found.cy) == (50.0, 51.0, 31.0, 23.5)
    assert found.distortion == tuple(LENS.values())
    for said in ({"camera_model": "OPENCV_FISHEYE"}, {"is_fisheye": True}):
        found = read(written(tmp_path, {**PINHOLE, **WIDE, **said}))
        assert found.projection == "fisheye"
        assert found.fisheye_k == tuple(WIDE.values())


@READERS
def test_the_angle_of_a_view_is_that_from_edge_to_edge(read, tmp_path):
    angles = {"camera_angle_x": 2 * math.atan(32 / 50), "camera_angle_y": 2 * math.atan(24 / 51)}
    found = read(written(tmp_path, {**angles, "w": WIDTH, "h": HEIGHT}))
    assert (found.fx, found.fy) == (pytest.approx(50.0), pytest.approx(51.0))
    assert (found.cx, found.cy) == (32.0, 24.0)


def test_a_calibration_of_several_cameras_is_refused(tmp_path):
    file = written(tmp_path, PINHOLE)
    values = json.loads(file.read_text())
    frame = values["frames"][0]
    values["frames"] = [frame, {**frame, "fl_x": 52.0}]
    file.write_text(json.dumps(values))
    with pytest.raises(InputError, match="frames: have 2 cameras"):
        of_calibration(file)
    assert [frame.camera.fx for frame in read_capture(tmp_path).frames] == [50.0, 52.0]
    values["frames"] = [{**frame, "fl_x": 52.0}] * 2
    file.write_text(json.dumps(values))
    assert of_calibration(file).fx == 52.0


def test_the_size_of_a_capture_is_that_of_its_images_where_nothing_says_it(tmp_path):
    angle_rad = 2 * math.atan(32 / 50)
    found = of_capture(written(tmp_path, {"camera_angle_x": angle_rad}))
    assert (found.width, found.height) == (WIDTH, HEIGHT)
    assert found.fx == pytest.approx(50.0)
