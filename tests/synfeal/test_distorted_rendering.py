"""Images through a lens: where points appear, how lines bend, exact depth, no border."""

import cv2
import numpy as np
import pytest
import trimesh
from scipy.ndimage import map_coordinates

from synfeal.camera.projection import normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import open_renderer
from synfeal.render.distorted import DistortedRenderer, covering_camera
from tests.support.collected import painted
from tests.support.room_scene import random_texture

AHEAD = pose_matrix(rotation_from_rpy([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0])
LENSES = {
    "barrel": (-0.28, 0.09, 0.001, -0.0007, -0.01),
    "pincushion": (0.25, 0.05, 0.0, 0.0, 0.0),
    "tangential": (-0.05, 0.0, 0.02, -0.01, 0.0),
}
SLANT = np.array([0.3, -0.2, 1.0]) / 2.5  # the plane of points with SLANT @ point = 1
each_lens = pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)


def camera_of(lens, width=160, height=120):
    values = {"fx": 0.75 * width, "fy": 0.7425 * width, "cx": 0.52 * width, "cy": 0.49 * height}
    return CameraConfig(width=width, height=height, distortion=lens, **values)


def expected_pixels(points_cam, camera):
    """OpenCV's, whose first pixel has its centre at (0, 0)."""
    matrix = camera.intrinsics.matrix(centre_shift_px=-0.5)
    lens = np.array(camera.distortion)
    return cv2.projectPoints(points_cam, np.zeros(3), np.zeros(3), matrix, lens)[0][:, 0] + 0.5


def pixel_centres(camera):
    row, column = np.mgrid[: camera.height, : camera.width] + 0.5
    return np.stack([column, row], axis=-1)


class Analytic:
    """A scene in closed form: colour and depth as functions of normalised image coordinates."""

    def __init__(self, camera, color=None, depth=None, samples=4):
        self.camera, self.color, self.depth, self.samples = camera, color, depth, samples

    def render(self, world_from_cam):
        steps = (np.arange(self.samples) + 0.5) / self.samples - 0.5
        centre, total = pixel_centres(self.camera), 0.0
        for offset in np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2):
            total = total + self.color(normalised_of_pixels(self.camera, centre + offset))
        grey = np.rint(total / self.samples**2).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=2)

    def render_rgbd(self, world_from_cam):
        normalised = normalised_of_pixels(self.camera, pixel_centres(self.camera))
        black = np.zeros((*normalised.shape[:2], 3), np.uint8)
        return black, self.depth(normalised).astype(np.float32)


def noise_color(normalised):
    row_column = np.moveaxis(240 * normalised[..., ::-1], -1, 0)
    return map_coordinates(NOISE, row_column, order=1, mode="wrap")


NOISE = random_texture(np.random.default_rng(0))


def disc(centre_cam, radius):
    """A white disc that faces the camera; its round edge averages over where samples lie."""
    angle = np.linspace(0.0, 2 * np.pi, 61)[:-1]
    rim = centre_cam + radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    vertices = np.vstack([centre_cam, rim]) @ AHEAD[:3, :3].T
    following = np.roll(np.arange(1, 61), -1)
    faces = np.column_stack([np.zeros(60, int), np.arange(1, 61), following])
    return MeshPart("disc", vertices, faces, base_color=np.full(4, 255, np.uint8))


@each_lens
def test_points_appear_where_opencv_projects_them(lens):
    camera = camera_of(lens, 320, 240)
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform([-0.5, -0.35], [0.5, 0.35], (6, 2)), np.ones(6)]) * 2.0
    for (column, row), point in zip(expected_pixels(points, camera), points, strict=True):
        dot = disc(point, 0.02)
        with open_renderer(TexturedMesh((dot,)), camera) as renderer:
            weight = renderer.render(AHEAD)[..., :1].astype(float)
        seen = (pixel_centres(camera) * weight).sum(axis=(0, 1)) / weight.sum()
        np.testing.assert_allclose(seen, [column, row], atol=0.05)


@each_lens
def test_colours_are_nearly_those_of_64_rays(lens):
    camera = camera_of(lens)
    expected = Analytic(camera, noise_color, samples=8).render(AHEAD).astype(float)
    found = DistortedRenderer(lambda pinhole: Analytic(pinhole, noise_color), camera).render(AHEAD)
    error = found - expected
    assert np.sqrt((error**2).mean()) < 0.03 * expected.std()
    assert abs(error.mean()) < 0.1


@each_lens
def test_depth_of_a_plane_is_exact(lens):
    camera = camera_of(lens)

    def depth(normalised):
        return 1.0 / (normalised @ SLANT[:2] + SLANT[2])

    renderer = DistortedRenderer(lambda pinhole: Analytic(pinhole, depth=depth), camera)
    found = renderer.render_rgbd(AHEAD)[1]
    assert found.dtype == np.float32
    expected = depth(normalised_of_pixels(camera, pixel_centres(camera)))
    assert np.ptp(expected) > 0.5
    np.testing.assert_allclose(found, expected, atol=1e-5)


@each_lens
def test_depth_is_never_between_two_surfaces(lens):
    """A wall at 4 m before nothing, and before it a board at 2 m."""
    camera = camera_of(lens)

    def depth(normalised):
        wall = np.where(normalised[..., 0] < 0.3, 4.0, np.inf)
        return np.where(np.abs(normalised).max(axis=-1) < 0.2, 2.0, wall)

    renderer = DistortedRenderer(lambda pinhole: Analytic(pinhole, depth=depth), camera)
    found = renderer.render_rgbd(AHEAD)[1].round(5)
    assert set(np.unique(found)) == {2.0, 4.0, np.inf}
    expected = depth(normalised_of_pixels(camera, pixel_centres(camera)))
    differs = found != expected
    assert differs.mean() < 0.01
    near = normalised_of_pixels(camera, pixel_centres(camera))[differs]
    edges = np.abs(np.abs(near).max(axis=-1) - 0.2), np.abs(near[:, 0] - 0.3)
    assert (np.minimum(*edges) < 0.5 / 120).all()  # half a pixel


@each_lens
def test_a_closed_room_fills_the_image(lens):
    camera = camera_of(lens)
    room = painted(trimesh.creation.box((4.0, 4.0, 4.0)), (200, 200, 200))
    with open_renderer(room, camera) as renderer:
        seen, depth = renderer.render_rgbd(AHEAD)
        np.testing.assert_array_equal(renderer.render(AHEAD), seen)
    assert (seen.shape, seen.dtype) == ((120, 160, 3), np.uint8)
    assert (np.abs(seen.astype(int) - 200) <= 1).all()
    ahead = np.abs(normalised_of_pixels(camera, pixel_centres(camera))).max(-1) < 0.95
    np.testing.assert_allclose(depth[ahead], 2.0, atol=1e-3)  # the wall that faces the camera


def test_the_pinhole_keeps_resolution_and_clip_planes_and_a_lens_may_be_too_wide():
    camera = camera_of(LENSES["barrel"]).model_copy(update={"near_m": 0.2, "far_m": 30.0})
    pinhole = covering_camera(camera)
    assert (pinhole.fx, pinhole.fy) == (2 * camera.fx, 2 * camera.fy)
    assert (pinhole.near_m, pinhole.far_m) == (0.2, 30.0)
    assert not any(pinhole.distortion)
    with pytest.raises(InputError, match="give a smaller width"):
        covering_camera(camera_of((-0.2, 0.0, 0.0, 0.0, 0.0), 8192, 4096))
