"""The one reader of depth images: units, what is no measurement, and what is no depth image."""

import cv2
import numpy as np
import pytest
from PIL import Image

from synfeal.dataset.depth import (
    depth_units_of,
    encode_depth,
    is_measured,
    own_units_per_m,
    read_depth_m,
    share_beyond_storage,
)
from synfeal.dataset.frame_files import encode_png
from synfeal.errors import InputError

STORED = np.array([[0, 1, 1234], [5000, 65534, 65535]], np.uint16)


@pytest.fixture(params=["ours", "opencv"])
def path(request, tmp_path):
    """An image of ``STORED``, by our codec and by OpenCV."""
    file = tmp_path / "frame-000000.depth.png"
    if request.param == "ours":
        file.write_bytes(encode_png(STORED))
    else:
        assert cv2.imwrite(str(file), STORED)
    return file


def test_units_are_those_of_the_file(path):
    stored_m = read_depth_m(path, units_per_m=1.0, nothing=0.0)
    assert np.array_equal(stored_m, STORED * (STORED < 65535))
    assert own_units_per_m(path) is None


@pytest.mark.parametrize(("units_per_m", "one_m"), [(1000.0, 1.234), (5000.0, 0.2468)])
@pytest.mark.parametrize("nothing", [np.inf, 0.0])
def test_depth_is_in_metres_and_neither_0_nor_65535_is_measured(path, units_per_m, one_m, nothing):
    depth_m = read_depth_m(path, units_per_m=units_per_m, nothing=nothing)
    assert depth_m.dtype == np.float32
    assert depth_m[0, 2] == np.float32(one_m)
    assert depth_m[0, 0] == depth_m[1, 2] == nothing
    assert np.allclose(depth_m.flat[[1, 3, 4]], STORED.flat[[1, 3, 4]] / units_per_m)


@pytest.mark.parametrize("name", ["frame-000000.depth.tif", "frame-000000.depth.png"])
def test_floats_are_metres_whatever_the_name_and_the_units_of_whole_numbers(tmp_path, name):
    stored = np.array([[0.0, 1.25, 70.5], [np.nan, -1.0, np.inf]], np.float32)
    Image.fromarray(stored).save(tmp_path / name, format="TIFF")
    depth_m = read_depth_m(tmp_path / name, units_per_m=5000.0, nothing=0.0)
    assert depth_m.tolist() == [[0.0, 1.25, 70.5], [0.0, 0.0, 0.0]]
    assert own_units_per_m(tmp_path / name) is None


def test_floats_that_are_no_metres_are_refused(tmp_path):
    path = tmp_path / "frame-000000.depth.tif"
    Image.fromarray(np.full((4, 4), 1850.0, np.float32)).save(path)
    with pytest.raises(InputError, match="count as metres, and half of them are above 1850"):
        read_depth_m(path)


def test_every_millimetre_survives_a_round_trip(tmp_path):
    every = np.arange(65536, dtype=np.uint16).reshape(256, 256)
    (tmp_path / "depth.png").write_bytes(encode_png(every))
    back = depth_units_of(read_depth_m(tmp_path / "depth.png"))
    assert np.array_equal(back[is_measured(every)], every[is_measured(every)])
    assert (back[~is_measured(every)] == 65535).all()


@pytest.mark.parametrize(
    ("pixels", "line"),
    [
        (np.zeros((2, 3), np.uint8), "must be a 16-bit grey image of depth, not of mode L"),
        (np.zeros((2, 3, 3), np.uint8), "must be a 16-bit grey image of depth, not of mode RGB"),
        (np.zeros((3, 2), np.uint16), "is of 2 x 3 pixels, the camera of 3 x 2"),
    ],
)
def test_other_images_are_refused_in_one_line(pixels, line, tmp_path):
    path = tmp_path / "frame-000000.depth.png"
    Image.fromarray(pixels).save(path)
    with pytest.raises(InputError, match=rf"frame-000000\.depth\.png: {line}.*; measure again$"):
        read_depth_m(path, size=(3, 2), remedy="; measure again")


def test_a_missing_image_is_named(tmp_path):
    with pytest.raises(InputError, match=r"frame-000000\.depth\.png: missing$"):
        read_depth_m(tmp_path / "frame-000000.depth.png")


def test_the_share_beyond_what_can_be_stored_counts_surfaces_alone():
    depth_m = np.array([[1.0, 65.534, 65.536, 99.0], [np.inf, np.inf, 0.5, 2.0]], np.float32)
    assert share_beyond_storage(depth_m) == 2 / 8


def test_a_file_in_coarser_units_says_them_itself(tmp_path):
    """Even to a reader that expects others, and to Pillow and OpenCV as a plain 16-bit image."""
    depth_m = np.array([[0.5, 70.0, 250.126], [655.33, 655.4, np.inf]], np.float32)
    path = tmp_path / "frame-000000.depth.png"
    path.write_bytes(encode_depth(depth_m, 100.0))
    units = np.array([[50, 7000, 25013], [65533, 65535, 65535]])
    assert np.array_equal(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), units)
    with Image.open(path) as opened:
        assert np.array_equal(np.asarray(opened), units)
        assert float(opened.text["depth_units_per_m"]) == 100.0
    assert own_units_per_m(path) == 100.0
    for units_per_m in (1000.0, 5000.0):
        back = read_depth_m(path, units_per_m=units_per_m)
        assert np.allclose(back[np.isfinite(back)], units[units < 65535] / 100.0)
        assert np.isinf(back).tolist() == [[False] * 3, [False, True, True]]
    assert share_beyond_storage(depth_m, 100.0) == 1 / 6
    assert share_beyond_storage(depth_m) == 4 / 6


@pytest.mark.parametrize("said", ["0", "-3", "inf", "many"])
def test_units_that_are_no_number_are_refused(said, tmp_path):
    path = tmp_path / "frame-000000.depth.png"
    path.write_bytes(encode_png(STORED, {"depth_units_per_m": said}))
    with pytest.raises(InputError, match=r"frame-000000\.depth\.png: .*depth"):
        read_depth_m(path)


def test_millimetres_are_the_bytes_they_always_were():
    depth_m = np.array([[0.001, 1.5], [65.534, np.inf]], np.float32)
    stored = np.array([[1, 1500], [65534, 65535]], np.uint16)
    assert encode_depth(depth_m) == encode_png(stored)
