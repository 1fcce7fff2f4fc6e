"""Rendering against closed forms, for every backend: projection, depth, textures and alpha."""

from dataclasses import replace

import numpy as np
import pytest

from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from tests.support.small_room import (
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
RED = colored((255, 0, 0))
WALL = facing_quad(2.0, 9.0, base_color=RED)


@pytest.fixture(params=BACKENDS)
def opened(request):
    return opener_of(request.param)


@pytest.fixture
def seen(opened):
    """Colours and depths of parts from a pose, through a camera of 64 x 48 or another."""

    def render(*parts, pose=LOOK_ALONG_X, **camera):
        with opened(TexturedMesh(parts), camera_of(**camera)) as renderer:
            return renderer.render_rgbd(pose)

    return render


def test_depth_of_a_frontal_plane_is_its_distance_also_from_behind_and_else_infinite(seen):
    rgb, depth = seen(facing_quad(3.0, 10.0, base_color=RED))
    assert (rgb.shape, rgb.dtype) == ((48, 64, 3), np.uint8)
    assert (depth.shape, depth.dtype) == ((48, 64), np.float32)
    np.testing.assert_allclose(depth, 3.0, atol=1e-5)  # z, not the length of the ray
    assert (rgb == [255, 0, 0]).all()
    rgb, depth = seen(facing_quad(2.0, 0.2, base_color=RED))
    assert np.isinf(depth[0, 0])
    assert (rgb[0, 0] == 0).all()
    assert depth[24, 32] == pytest.approx(2.0, abs=1e-5)
    behind = pose_matrix(rotation_from_rpy([0.0, 0.0, np.pi]), [2.0, 0.0, 0.0])
    rgb, _ = seen(facing_quad(1.0, 5.0, base_color=RED), pose=behind)
    assert (rgb == [255, 0, 0]).all()


def test_depth_of_a_slanted_floor_in_closed_form_and_fine_far_away(seen):
    height, pitch = 1.5, 0.6
    floor = np.array([[-99.0, -99, 0], [99, -99, 0], [99, 99, 0], [-99, 99, 0]])
    pose = pose_matrix(rotation_from_rpy([0.0, pitch, 0.4]), [1.0, 2.0, height])
    _, depth = seen(MeshPart("floor", floor, TWO, base_color=RED), pose=pose)
    _, fy, _, cy = camera_of().intrinsics
    slope = (np.arange(48) + 0.5 - cy) / fy  # y / z through the pixel centres of each row
    expected = height / (np.sin(pitch) + slope * np.cos(pitch))
    np.testing.assert_allclose(depth, np.repeat(expected[:, None], 64, axis=1), rtol=1e-5)
    # A 24-bit depth buffer that begins at 5 cm has steps of 8 mm at 80 m.
    for distance in np.linspace(79.0, 80.0, 9):
        _, depth = seen(facing_quad(distance, 99.0), width=16, height=16)
        np.testing.assert_allclose(depth, distance, atol=2e-4)


@pytest.mark.parametrize("seed", range(4))
def test_a_point_is_seen_at_the_pixel_it_projects_to(seen, seed):
    rng = np.random.default_rng(seed)
    camera = {"width": 161, "height": 119, "fx": 110.0, "fy": 125.0, "cx": 70.0, "cy": 66.0}
    pose = pose_matrix(rotation_from_rpy(rng.uniform(-0.5, 0.5, 3)), rng.uniform(-1, 1, 3))
    point_cam = np.array([*rng.uniform(-0.7, 0.7, 2), 2.0])
    # A square turned against the pixels, so that samples on its edges average out.
    turned = 0.12 * np.array([[-0.5, -1, 0], [1, -0.5, 0], [0.5, 1, 0], [-1, 0.5, 0]])
    corners = (point_cam + turned) @ pose[:3, :3].T + pose[:3, 3]
    dot = MeshPart("dot", corners, TWO, base_color=colored((255, 255, 255)))
    weight = seen(dot, pose=pose, **camera)[0][..., 0].astype(float)
    rows, columns = np.indices(weight.shape) + 0.5  # pixel centres
    found = np.array([np.sum(columns * weight), np.sum(rows * weight)]) / weight.sum()
    x, y, z = (inverse(pose) @ [*(point_cam @ pose[:3, :3].T + pose[:3, 3]), 1.0])[:3]
    expected = camera["fx"] * x / z + camera["cx"], camera["fy"] * y / z + camera["cy"]
    np.testing.assert_allclose(found, expected, atol=0.03)


def test_several_cameras_and_meshes_share_a_process(opened):
    red = TexturedMesh((facing_quad(1.0, 5.0, np.full((4, 4, 3), (255, 0, 0), np.uint8)),))
    blue = TexturedMesh((facing_quad(1.0, 5.0, np.full((4, 4, 3), (0, 0, 255), np.uint8)),))
    with opened(red, camera_of()) as first, opened(blue, camera_of(width=100, height=30)) as second:
        for _ in range(2):  # in turns
            assert (first.render(LOOK_ALONG_X) == [255, 0, 0]).all()
            assert second.render(LOOK_ALONG_X).shape == (30, 100, 3)
    with opened(blue, camera_of()) as third:
        assert (third.render(LOOK_ALONG_X) == [0, 0, 255]).all()


def test_images_do_not_depend_on_where_the_scene_lies(seen):
    """In map coordinates, single precision alone would move everything by centimetres."""
    texture = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    quad = facing_quad(3.0, 1.0, texture)
    offset = np.array([512_345.0, 5_402_678.0, 345.0])
    moved = LOOK_ALONG_X.copy()
    moved[:3, 3] += offset
    rgb, depth = seen(quad)
    far_rgb, far_depth = seen(replace(quad, vertices_m=quad.vertices_m + offset), pose=moved)
    assert np.abs(rgb.astype(int) - far_rgb).max() <= 1
    np.testing.assert_allclose(far_depth, depth, atol=1e-5)


def test_near_and_far_cut_along_the_optical_axis(seen):
    limits = {"near_m": 1.0, "far_m": 5.0}
    quads = [facing_quad(x, 3.0 * x, base_color=colored((0, 0, int(x * 20)))) for x in (0.9, 1.1)]
    rgb, depth = seen(*quads, **limits)
    assert (rgb[..., 2] == 22).all()
    np.testing.assert_allclose(depth, 1.1, atol=1e-5)
    for distance, is_drawn in ((4.9, True), (5.1, False)):
        rgb, depth = seen(facing_quad(distance, 20.0, base_color=colored((9, 9, 9))), **limits)
        assert (rgb == (9 if is_drawn else 0)).all()
        np.testing.assert_allclose(depth, distance if is_drawn else np.inf, atol=1e-4)
    # The rays to the corners are 4.6 m long.
    _, depth = seen(facing_quad(2.0, 9.0), far_m=2.01, horizontal_fov_deg=120.0)
    assert np.isfinite(depth).all()


def test_edges_are_smooth(seen):
    """A half-plane whose edge is slanted: each pixel is as bright as it is covered."""
    edge = np.array([[2.0, 0.0, 9.0], [2.0, -9.0, 9.0], [2.0, -9.0, -9.0], [2.0, 1.0, -9.0]])
    camera = {"width": 101, "height": 101, "horizontal_fov_deg": 60.0}
    covered = seen(MeshPart("half", edge, TWO), **camera)[0][..., 0] / 255.0
    fx, fy, cx, cy = camera_of(**camera).intrinsics
    # The edge runs through y = (9 - z) / 18 at x = 2; columns grow towards -y.
    fine = (np.arange(101 * 16) + 0.5) / 16.0
    y, z = -(fine - cx) / fx * 2.0, -(fine - cy) / fy * 2.0
    inside = y[None, :] < (9.0 - z[:, None]) / 18.0
    share = inside.reshape(101, 16, 101, 16).mean(axis=(1, 3))
    assert np.abs(covered - share).max() <= 0.25  # four samples
    assert np.abs(covered - share).mean() <= 0.002
    assert len(np.unique(covered)) == 5


def test_textures_are_upright_and_neither_mirrored_nor_sheared(seen):
    quarters = np.zeros((64, 64, 3), np.uint8)  # an image: first row on top
    quarters[:32, :32], quarters[:32, 32:] = (255, 0, 0), (0, 255, 0)
    quarters[32:, :32], quarters[32:, 32:] = (0, 0, 255), (255, 255, 0)
    rgb, _ = seen(facing_quad(1.0, 2.0, quarters))
    corners = rgb[[5, 5, -5, -5], [5, -5, 5, -5]]
    assert corners.tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0]]
    texture = np.zeros((9, 7, 3), np.uint8)
    texture[:, 3] = 255  # a vertical line
    rgb, _ = seen(facing_quad(1.0, 1.0, texture), width=75, height=53)
    assert np.ptp(rgb[..., 0].argmax(axis=1)) <= 1


def test_vertex_colours_are_interpolated_and_multiplied(seen):
    colors = np.array([[0, 0, 0], [200, 0, 0], [200, 0, 0], [0, 0, 0]], np.uint8)
    rgb, _ = seen(facing_quad(1.0, 1.0, vertex_rgb=colors), horizontal_fov_deg=90.0)
    expected = 200.0 * (np.arange(64) + 0.5) / 64.0
    np.testing.assert_allclose(rgb[24, 2:-2, 0], expected[2:-2], atol=2.0)
    factor = np.array([128, 255, 51, 255], np.uint8)
    grey = np.full((4, 4, 3), 200, np.uint8)
    expected = np.array([200 * 128 / 255, 200, 200 * 51 / 255])
    for values in ({"texture": grey}, {"vertex_rgb": grey[0]}):
        rgb, _ = seen(facing_quad(1.0, 3.0, base_color=factor, **values))
        assert np.abs(rgb - expected).max() <= 1.0


def test_alpha_below_the_cutoff_lets_the_wall_behind_through(seen):
    leaf = np.full((32, 32, 4), (0, 255, 0, 255), np.uint8)
    leaf[:, 16:] = (255, 255, 255, 150)  # right half: alpha 0.59
    for cutoff, color, distance in ((0.7, [255, 0, 0], 2.0), (0.5, [255, 255, 255], 1.0)):
        rgb, depth = seen(facing_quad(1.0, 3.0, leaf, alpha_cutoff=cutoff), WALL)
        assert rgb[24, [8, 56]].tolist() == [[0, 255, 0], color]
        assert depth[24, 56] == pytest.approx(distance, abs=1e-3)
    faint = np.array([255, 255, 255, 100], np.uint8)  # 0.39: of the base colour, which counts too
    for values in ({"texture": leaf, "base_color": faint}, {"base_color": faint // 5}):
        rgb, _ = seen(facing_quad(1.0, 3.0, alpha_cutoff=0.5, **values), WALL)
        assert (rgb == [255, 0, 0]).all()


def test_textures_are_averaged_without_aliasing_or_hidden_colour(seen):
    checker = np.indices((1024, 1024)).sum(axis=0) % 2 * 255
    texture = np.repeat(checker[..., None], 3, axis=2).astype(np.uint8)
    for distance in (0.7, 0.75, 0.8, 0.95, 1.1, 1.4, 2.0):  # from two texels a sample on
        rgb, _ = seen(facing_quad(distance, 2.0, texture), width=48, height=48)
        np.testing.assert_allclose(rgb.astype(int), 127, atol=4)
    rng = np.random.default_rng(0)
    leaf = np.full((256, 256, 4), (0, 200, 0, 255), np.uint8)
    leaf[rng.random((256, 256)) < 0.5] = (255, 0, 255, 0)  # magenta that must never show
    rgb, _ = seen(facing_quad(20.0, 8.0, leaf, alpha_cutoff=0.5))
    assert rgb[..., 1].max() > 50
    assert rgb[..., 0].max() <= 2


def test_rays_pass_through_many_layers(seen):
    """Twenty sheets with a hole in the middle, a wall behind them."""
    sheet = np.full((4, 4, 4), (0, 0, 255, 255), np.uint8)
    sheet[1:3, 1:3, 3] = 0
    layers = [facing_quad(1.0 + 0.01 * k, 0.5, sheet, alpha_cutoff=0.5) for k in range(20)]
    rgb, depth = seen(*layers, WALL)
    assert rgb[[24, 2], 32].tolist() == [[255, 0, 0], [0, 0, 255]]
    assert depth[[24, 2], 32].tolist() == pytest.approx([2.0, 1.0], abs=1e-5)


def test_depth_of_a_cut_out_ends_where_half_of_it_is_left(seen):
    """Alpha falls from 1 to 0 between the middles of texels 15 and 16: half is where they meet."""
    leaf = np.full((32, 32, 4), (0, 255, 0, 255), np.uint8)
    leaf[:, 16:, 3] = 0
    quad = facing_quad(1.0, 1.0, leaf, alpha_cutoff=0.5)
    _, depth = seen(quad, width=640, height=16, horizontal_fov_deg=90.0)
    # Repeated textures fade out towards the other side as well, over half a texel: 10 pixels.
    assert np.isfinite(depth[:, 11:319]).all()
    assert np.isinf(depth[:, 321:629]).all()


def test_textures_repeat(seen):
    texture = np.zeros((2, 2, 3), np.uint8)
    texture[:, 1] = 255
    quad = facing_quad(1.0, 1.0, texture)
    twice = replace(quad, uv=quad.uv * 4.0 - 1.0)
    row = seen(twice, width=64, height=64, horizontal_fov_deg=90.0)[0][32, :, 0].astype(float)
    np.testing.assert_allclose(row[16:32], row[32:48], atol=1.0)
    # From the middle of the dark texel to that of the bright one, 8 pixels of a straight line.
    np.testing.assert_allclose(row[20:28], 255.0 * (np.arange(8) + 0.5) / 8.0, atol=2.0)
