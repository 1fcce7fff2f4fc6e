"""Lens distortion and pixels: against OpenCV, closed forms, and each other."""

import cv2
import numpy as np
import pycolmap
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from baselines.labels.sfm.features import colmap_parameters
from synfeal.camera.distortion import distort, fold_radius, undistort
from synfeal.camera.projection import normalised_of_pixels, pixels_of_normalised
from synfeal.config.dataset import CameraConfig

LENSES = {
    "none": (0.0, 0.0, 0.0, 0.0, 0.0),
    "barrel": (-0.28, 0.09, 0.001, -0.0007, -0.01),
    "pincushion": (0.25, 0.05, 0.0, 0.0, 0.02),
    "tangential": (0.0, 0.0, 0.01, -0.02, 0.0),
    "folding": (-0.3, 0.0, 0.0, 0.0, 0.0),
}
CAMERA = {"width": 640, "height": 480, "cx": 330, "cy": 235}
SMALL = st.floats(-0.2, 0.2)
TINY = st.floats(-0.01, 0.01)


def points_within(radius, count=500):
    rng = np.random.default_rng(0)
    angle, r = rng.uniform(0, 2 * np.pi, count), radius * np.sqrt(rng.random(count))
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
def test_distortion_is_opencvs(lens):
    normalised = points_within(min(1.2, fold_radius(lens)))
    rays = np.column_stack([normalised, np.ones(len(normalised))])
    expected, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), np.eye(3), np.array(lens))
    np.testing.assert_allclose(distort(normalised, lens), expected[:, 0], atol=1e-14)


@given(SMALL, SMALL, TINY, TINY, SMALL)
@settings(deadline=None, max_examples=100, derandomize=True)
def test_pixels_return_within_1e_10(k1, k2, p1, p2, k3):
    lens = (k1, k2, p1, p2, k3)
    normalised = points_within(min(1.5, 0.9 * fold_radius(lens)), 50)
    seen = distort(normalised, lens)
    back = undistort(seen, lens)
    kept = ~np.isnan(back).any(axis=-1)
    np.testing.assert_allclose(500 * distort(back, lens)[kept], 500 * seen[kept], atol=1e-10)
    np.testing.assert_allclose(back[kept], normalised[kept], atol=1e-10)
    if (p1, p2) == (0.0, 0.0):
        assert kept.all()


@pytest.mark.parametrize("k1", [-0.3, -0.05])
def test_the_fold_of_one_coefficient_in_closed_form(k1):
    """r (1 + k1 r²) grows up to r² = -1 / (3 k1), where it is 2 r / 3."""
    lens = (k1, 0.0, 0.0, 0.0, 0.0)
    r = np.sqrt(-1 / (3 * k1))
    assert fold_radius(lens) == pytest.approx(r, rel=1e-12)
    seen = np.array([[2 / 3 * r - 1e-6, 0.0], [2 / 3 * r + 1e-6, 0.0]])
    inside, outside = undistort(seen, lens)
    assert r - 0.01 < inside[0] < r
    assert np.isnan(outside).all()


def test_a_lens_without_fold_is_inverted_far_out():
    """r + r³ = y in closed form, Cardano's."""
    y = np.array([0.0, 1e-9, 0.1, 10.0, 1000.0])
    root = np.sqrt(y**2 / 4 + 1 / 27)
    expected = np.cbrt(y / 2 + root) + np.cbrt(y / 2 - root)
    found = undistort(np.stack([0 * y, y], axis=-1), (1.0, 0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(found[:, 1], expected, rtol=1e-9, atol=1e-13)


def test_pixels_of_points_are_opencvs_but_for_half_a_pixel():
    camera = CameraConfig(**CAMERA, fx=500, fy=510, distortion=LENSES["barrel"])
    points = np.random.default_rng(0).uniform([-1, -0.8, 2], [1, 0.8, 4], (50, 3))
    matrix = camera.intrinsics.matrix(centre_shift_px=-0.5)
    lens = np.array(camera.distortion)
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, lens)
    normalised = points[:, :2] / points[:, 2:]
    pixel = pixels_of_normalised(camera, normalised)
    np.testing.assert_allclose(pixel, expected[:, 0] + 0.5, atol=1e-10)
    np.testing.assert_allclose(normalised_of_pixels(camera, pixel), normalised, atol=1e-13)


def test_a_lens_that_folds_inside_the_image_is_refused():
    values = {"width": 400, "height": 300, "fx": 200, "fy": 200, "cx": 200, "cy": 150}
    lens = (-0.3, 0.0, 0.0, 0.0, 0.0)  # folds at 0.703 from the centre of the distorted image
    with pytest.raises(ValidationError, match=r"distortion: folds over inside the image at pixel"):
        CameraConfig.model_validate({**values, "distortion": lens})
    CameraConfig.model_validate({**values, "fx": 400, "fy": 400, "distortion": lens})


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
def test_structure_from_motion_is_told_the_same_camera(lens):
    camera = CameraConfig(**CAMERA, fx=900, fy=910, distortion=lens)
    model = "FULL_OPENCV" if any(lens) else "PINHOLE"
    told = pycolmap.Camera(model=model, width=640, height=480, params=colmap_parameters(camera))
    normalised = np.random.default_rng(0).uniform(-0.3, 0.3, (30, 2))
    seen = told.img_from_cam(np.column_stack([normalised, np.ones(30)]))
    np.testing.assert_allclose(pixels_of_normalised(camera, normalised), seen, atol=1e-9)
