"""Rendering: textures, colours and alpha, for every backend."""

from dataclasses import replace

import numpy as np
import pytest

from synfeal.mesh.model import TexturedMesh
from tests.render_backends import (
    BACKENDS,
    LOOK_ALONG_X,
    PYOPENGL_WARNS,
    camera_of,
    colored,
    facing_quad,
    opener_of,
)

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)


@pytest.fixture(params=BACKENDS)
def opened(request):
    return opener_of(request.param)


def test_textures_are_upright_and_neither_mirrored_nor_sheared(opened):
    quarters = np.zeros((64, 64, 3), np.uint8)  # an image: first row on top
    quarters[:32, :32], quarters[:32, 32:] = (255, 0, 0), (0, 255, 0)
    quarters[32:, :32], quarters[32:, 32:] = (0, 0, 255), (255, 255, 0)
    mesh = TexturedMesh((facing_quad(1.0, 2.0, quarters),))
    with opened(mesh, camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    assert rgb[5, 5].tolist() == [255, 0, 0]
    assert rgb[5, -5].tolist() == [0, 255, 0]
    assert rgb[-5, 5].tolist() == [0, 0, 255]
    assert rgb[-5, -5].tolist() == [255, 255, 0]
    texture = np.zeros((9, 7, 3), np.uint8)
    texture[:, 3] = 255  # a vertical line
    mesh = TexturedMesh((facing_quad(1.0, 1.0, texture),))
    with opened(mesh, camera_of(width=75, height=53)) as renderer:
        columns = renderer.render(LOOK_ALONG_X)[..., 0].argmax(axis=1)
    assert np.ptp(columns) <= 1


def test_vertex_colours_are_interpolated_and_multiplied(opened):
    colors = np.array([[0, 0, 0], [200, 0, 0], [200, 0, 0], [0, 0, 0]], np.uint8)
    mesh = TexturedMesh((facing_quad(1.0, 1.0, vertex_rgb=colors),))
    with opened(mesh, camera_of(horizontal_fov_deg=90.0)) as renderer:
        row = renderer.render(LOOK_ALONG_X)[24, :, 0]
    expected = 200.0 * (np.arange(64) + 0.5) / 64.0
    np.testing.assert_allclose(row[2:-2], expected[2:-2], atol=2.0)
    factor = np.array([128, 255, 51, 255], np.uint8)
    grey = np.full((4, 4, 3), 200, np.uint8)
    expected = np.array([200 * 128 / 255, 200, 200 * 51 / 255])
    for values in ({"texture": grey}, {"vertex_rgb": grey[0]}):
        quad = facing_quad(1.0, 3.0, base_color=factor, **values)
        with opened(TexturedMesh((quad,)), camera_of()) as renderer:
            rgb = renderer.render(LOOK_ALONG_X)
        assert np.abs(rgb - expected).max() <= 1.0


def test_alpha_below_the_cutoff_lets_the_wall_behind_through(opened):
    leaf = np.full((32, 32, 4), (0, 255, 0, 255), np.uint8)
    leaf[:, 16:] = (255, 255, 255, 150)  # right half: alpha 0.59
    back = facing_quad(2.0, 9.0, base_color=colored((255, 0, 0)))
    for cutoff, seen, distance in ((0.7, [255, 0, 0], 2.0), (0.5, [255, 255, 255], 1.0)):
        front = facing_quad(1.0, 3.0, leaf, alpha_cutoff=cutoff)
        with opened(TexturedMesh((front, back)), camera_of()) as renderer:
            rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
        assert rgb[24, 8].tolist() == [0, 255, 0]
        assert rgb[24, 56].tolist() == seen
        assert depth[24, 56] == pytest.approx(distance, abs=1e-3)


def test_textures_are_averaged_without_aliasing_or_hidden_colour(opened):
    checker = np.indices((512, 512)).sum(axis=0) % 2 * 255
    texture = np.repeat(checker[..., None], 3, axis=2).astype(np.uint8)
    mesh = TexturedMesh((facing_quad(3.0, 3.0, texture),))
    with opened(mesh, camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    np.testing.assert_allclose(rgb.astype(int), 127, atol=3)
    rng = np.random.default_rng(0)
    leaf = np.full((256, 256, 4), (0, 200, 0, 255), np.uint8)
    leaf[rng.random((256, 256)) < 0.5] = (255, 0, 255, 0)  # magenta that must never show
    mesh = TexturedMesh((facing_quad(20.0, 8.0, leaf, alpha_cutoff=0.5),))
    with opened(mesh, camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    assert rgb[..., 1].max() > 50
    assert rgb[..., 0].max() <= 2


def test_alpha_of_the_base_colour_counts_and_parts_that_never_show_are_left_out(opened):
    leaf = np.full((8, 8, 4), (0, 255, 0, 255), np.uint8)
    faint = np.array([255, 255, 255, 100], np.uint8)  # 0.39
    back = facing_quad(2.0, 9.0, base_color=colored((255, 0, 0)))
    front = facing_quad(1.0, 3.0, leaf, alpha_cutoff=0.5, base_color=faint)
    with opened(TexturedMesh((front, back)), camera_of()) as renderer:
        assert (renderer.render(LOOK_ALONG_X) == [255, 0, 0]).all()
    shaft = facing_quad(1.0, 3.0, alpha_cutoff=0.5, base_color=np.array([9, 9, 9, 20], np.uint8))
    with opened(TexturedMesh((shaft, back)), camera_of()) as renderer:
        assert (renderer.render(LOOK_ALONG_X) == [255, 0, 0]).all()


def test_rays_pass_through_many_layers(opened):
    """Twenty sheets with a hole in the middle, a wall behind them."""
    sheet = np.full((4, 4, 4), (0, 0, 255, 255), np.uint8)
    sheet[1:3, 1:3, 3] = 0
    layers = [facing_quad(1.0 + 0.01 * k, 0.5, sheet, alpha_cutoff=0.5) for k in range(20)]
    back = facing_quad(2.0, 9.0, base_color=colored((255, 0, 0)))
    with opened(TexturedMesh((*layers, back)), camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    assert rgb[24, 32].tolist() == [255, 0, 0]
    assert depth[24, 32] == pytest.approx(2.0, abs=1e-5)
    assert rgb[2, 32].tolist() == [0, 0, 255]
    assert depth[2, 32] == pytest.approx(1.0, abs=1e-5)


def test_depth_of_a_cut_out_ends_where_half_of_it_is_left(opened):
    """Alpha falls from 1 to 0 between the middles of texels 15 and 16: half is where they meet."""
    leaf = np.full((32, 32, 4), (0, 255, 0, 255), np.uint8)
    leaf[:, 16:, 3] = 0
    camera = camera_of(width=640, height=16, horizontal_fov_deg=90.0)
    with opened(TexturedMesh((facing_quad(1.0, 1.0, leaf, alpha_cutoff=0.5),)), camera) as renderer:
        depth = renderer.render_rgbd(LOOK_ALONG_X)[1]
    # Repeated textures fade out towards the other side as well, over half a texel: 10 pixels.
    assert np.isfinite(depth[:, 11:319]).all()
    assert np.isinf(depth[:, 321:629]).all()


def test_textures_repeat(opened):
    texture = np.zeros((2, 2, 3), np.uint8)
    texture[:, 1] = 255
    quad = facing_quad(1.0, 1.0, texture)
    twice = replace(quad, uv=quad.uv * 4.0 - 1.0)
    camera = camera_of(width=64, height=64, horizontal_fov_deg=90.0)
    with opened(TexturedMesh((twice,)), camera) as renderer:
        row = renderer.render(LOOK_ALONG_X)[32, :, 0].astype(float)
    np.testing.assert_allclose(row[16:32], row[32:48], atol=1.0)
    # From the middle of the dark texel to that of the bright one, 8 pixels of a straight line.
    np.testing.assert_allclose(row[20:28], 255.0 * (np.arange(8) + 0.5) / 8.0, atol=2.0)
