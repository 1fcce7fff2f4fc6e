"""Rendering: projection, depth and orientation against closed forms, for every backend."""

from dataclasses import replace

import numpy as np
import pytest

from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from tests.render_backends import (
    BACKENDS,
    LOOK_ALONG_X,
    PYOPENGL_WARNS,
    TWO,
    camera_of,
    colored,
    facing_quad,
    opener_of,
)

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)


@pytest.fixture(params=BACKENDS)
def opened(request):
    return opener_of(request.param)


def test_depth_of_a_frontal_plane_is_its_distance_also_from_behind_and_else_infinite(opened):
    mesh = TexturedMesh((facing_quad(3.0, 10.0, base_color=colored((255, 0, 0))),))
    with opened(mesh, camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    assert (rgb.shape, rgb.dtype) == ((48, 64, 3), np.uint8)
    assert (depth.shape, depth.dtype) == ((48, 64), np.float32)
    np.testing.assert_allclose(depth, 3.0, atol=1e-5)  # z, not the length of the ray
    assert (rgb == [255, 0, 0]).all()
    mesh = TexturedMesh((facing_quad(2.0, 0.2, base_color=colored((255, 255, 255))),))
    with opened(mesh, camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    assert np.isinf(depth[0, 0])
    assert (rgb[0, 0] == 0).all()
    assert depth[24, 32] == pytest.approx(2.0, abs=1e-5)
    mesh = TexturedMesh((facing_quad(1.0, 5.0, base_color=colored((0, 255, 0))),))
    behind = pose_matrix(rotation_from_rpy([0.0, 0.0, np.pi]), [2.0, 0.0, 0.0])
    with opened(mesh, camera_of()) as renderer:
        assert (renderer.render(behind) == [0, 255, 0]).all()


def test_depth_of_a_slanted_floor_in_closed_form_and_fine_far_away(opened):
    height, pitch = 1.5, 0.6
    floor = np.array([[-99.0, -99, 0], [99, -99, 0], [99, 99, 0], [-99, 99, 0]])
    mesh = TexturedMesh((MeshPart("floor", floor, TWO, base_color=colored((9, 9, 9))),))
    camera = camera_of()
    pose = pose_matrix(rotation_from_rpy([0.0, pitch, 0.4]), [1.0, 2.0, height])
    with opened(mesh, camera) as renderer:
        depth = renderer.render_rgbd(pose)[1]
    _, fy, _, cy = camera.intrinsics
    slope = (np.arange(48) + 0.5 - cy) / fy  # y / z through the pixel centres of each row
    expected = height / (np.sin(pitch) + slope * np.cos(pitch))
    np.testing.assert_allclose(depth, np.repeat(expected[:, None], 64, axis=1), rtol=1e-5)
    # A 24-bit depth buffer that begins at 5 cm has steps of 8 mm at 80 m.
    distances = np.linspace(79.0, 80.0, 9)
    camera = camera_of(width=16, height=16)
    for distance in distances:
        mesh = TexturedMesh((facing_quad(distance, 99.0),))
        with opened(mesh, camera) as renderer:
            depth = renderer.render_rgbd(LOOK_ALONG_X)[1]
        np.testing.assert_allclose(depth, distance, atol=2e-4)


@pytest.mark.parametrize("seed", range(4))
def test_a_point_is_seen_at_the_pixel_it_projects_to(opened, seed):
    rng = np.random.default_rng(seed)
    camera = camera_of(width=161, height=119, fx=110.0, fy=125.0, cx=70.0, cy=66.0)
    pose = pose_matrix(rotation_from_rpy(rng.uniform(-0.5, 0.5, 3)), rng.uniform(-1, 1, 3))
    point_cam = np.array([*rng.uniform(-0.7, 0.7, 2), 2.0])
    # A square turned against the pixels, so that samples on its edges average out.
    turned = 0.12 * np.array([[-0.5, -1, 0], [1, -0.5, 0], [0.5, 1, 0], [-1, 0.5, 0]])
    corners_cam = point_cam + turned
    corners = corners_cam @ pose[:3, :3].T + pose[:3, 3]
    mesh = TexturedMesh((MeshPart("dot", corners, TWO, base_color=colored((255, 255, 255))),))
    with opened(mesh, camera) as renderer:
        weight = renderer.render(pose)[..., 0].astype(float)
    rows, columns = np.indices(weight.shape) + 0.5  # pixel centres
    seen = np.array([np.sum(columns * weight), np.sum(rows * weight)]) / weight.sum()
    fx, fy, cx, cy = camera.intrinsics
    x, y, z = (inverse(pose) @ [*(point_cam @ pose[:3, :3].T + pose[:3, 3]), 1.0])[:3]
    np.testing.assert_allclose(seen, [fx * x / z + cx, fy * y / z + cy], atol=0.03)


def test_up_in_the_world_is_up_in_the_image(opened):
    above, below = facing_quad(2.0, 0.3), facing_quad(2.0, 0.3)
    parts = tuple(
        MeshPart(
            part.name, part.vertices_m + np.array([0, 0, z]), part.faces, base_color=colored(rgb)
        )
        for part, z, rgb in ((above, 0.5, (255, 0, 0)), (below, -0.5, (0, 0, 255)))
    )
    with opened(TexturedMesh(parts), camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    rows = np.arange(48)[:, None]
    assert (rows * (rgb[..., 0] > 128)).max() < 24
    assert rgb[24:, :, 2].max() == 255


def test_several_cameras_and_meshes_share_a_process(opened):
    red = TexturedMesh((facing_quad(1.0, 5.0, np.full((4, 4, 3), (255, 0, 0), np.uint8)),))
    blue = TexturedMesh((facing_quad(1.0, 5.0, np.full((4, 4, 3), (0, 0, 255), np.uint8)),))
    with opened(red, camera_of()) as first, opened(blue, camera_of(width=100, height=30)) as second:
        for _ in range(2):  # in turns
            assert (first.render(LOOK_ALONG_X) == [255, 0, 0]).all()
            assert second.render(LOOK_ALONG_X).shape == (30, 100, 3)
    with opened(blue, camera_of()) as third:
        assert (third.render(LOOK_ALONG_X) == [0, 0, 255]).all()


def test_images_do_not_depend_on_where_the_scene_lies(opened):
    """In map coordinates, single precision alone would move everything by centimetres."""
    texture = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    quad = facing_quad(3.0, 1.0, texture)
    offset = np.array([512_345.0, 5_402_678.0, 345.0])
    far = replace(quad, vertices_m=quad.vertices_m + offset)
    moved = LOOK_ALONG_X.copy()
    moved[:3, 3] += offset
    with opened(TexturedMesh((quad,)), camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    with opened(TexturedMesh((far,)), camera_of()) as renderer:
        far_rgb, far_depth = renderer.render_rgbd(moved)
    assert np.abs(rgb.astype(int) - far_rgb).max() <= 1
    np.testing.assert_allclose(far_depth, depth, atol=1e-5)


def test_near_and_far_cut_along_the_optical_axis(opened):
    camera = camera_of(near_m=1.0, far_m=5.0)
    quads = {
        x: facing_quad(x, 3.0 * x, base_color=colored((0, 0, int(x * 20)))) for x in (0.9, 1.1)
    }
    with opened(TexturedMesh(tuple(quads.values())), camera) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    assert (rgb[..., 2] == 22).all()
    np.testing.assert_allclose(depth, 1.1, atol=1e-5)
    for distance, is_drawn in ((4.9, True), (5.1, False)):
        quad = facing_quad(distance, 20.0, base_color=colored((9, 9, 9)))
        with opened(TexturedMesh((quad,)), camera) as renderer:
            rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
        assert (rgb == (9 if is_drawn else 0)).all()
        np.testing.assert_allclose(depth, distance if is_drawn else np.inf, atol=1e-4)
    camera = camera_of(far_m=2.01, horizontal_fov_deg=120.0)  # corner rays are 4.6 m long
    with opened(TexturedMesh((facing_quad(2.0, 9.0),)), camera) as renderer:
        assert np.isfinite(renderer.render_rgbd(LOOK_ALONG_X)[1]).all()


def test_edges_are_smooth(opened):
    """A half-plane whose edge is slanted: each pixel is as bright as it is covered."""
    edge = np.array([[2.0, 0.0, 9.0], [2.0, -9.0, 9.0], [2.0, -9.0, -9.0], [2.0, 1.0, -9.0]])
    camera = camera_of(width=101, height=101, horizontal_fov_deg=60.0)
    with opened(TexturedMesh((MeshPart("half", edge, TWO),)), camera) as renderer:
        covered = renderer.render(LOOK_ALONG_X)[..., 0] / 255.0
    fx, fy, cx, cy = camera.intrinsics
    # The edge runs through y = (9 - z) / 18 at x = 2; columns grow towards -y.
    fine = (np.arange(101 * 16) + 0.5) / 16.0
    y, z = -(fine - cx) / fx * 2.0, -(fine - cy) / fy * 2.0
    inside = y[None, :] < (9.0 - z[:, None]) / 18.0
    share = inside.reshape(101, 16, 101, 16).mean(axis=(1, 3))
    assert np.abs(covered - share).max() <= 0.25  # four samples
    assert np.abs(covered - share).mean() <= 0.002
    assert len(np.unique(covered)) == 5
