"""Rendering: depth, projection, colours and orientation against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import open_renderer, pyrender_backend

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")

CORNER_UV = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])
LOOK_ALONG_X = pose_matrix(rotation_from_rpy([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0])


def camera_of(**values: object) -> CameraConfig:
    return CameraConfig.model_validate({"width": 64, "height": 48, **values})


def facing_quad(
    x: float, half: float, texture: NDArray[np.uint8] | None = None, **values: object
) -> MeshPart:
    """A square at distance ``x`` that faces the camera at the origin; texture left to right."""
    corners = np.array([[x, half, -half], [x, -half, -half], [x, -half, half], [x, half, half]])
    uv = CORNER_UV if texture is not None else None
    return MeshPart("quad", corners, TWO, uv, texture, **values)  # type: ignore[arg-type]


def colored(rgb: tuple[int, int, int]) -> NDArray[np.uint8]:
    return np.array([*rgb, 255], np.uint8)


def test_depth_of_a_frontal_plane_is_its_distance_everywhere() -> None:
    mesh = TexturedMesh((facing_quad(3.0, 10.0, base_color=colored((255, 0, 0))),))
    with open_renderer(mesh, camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    assert (rgb.shape, rgb.dtype) == ((48, 64, 3), np.uint8)
    assert (depth.shape, depth.dtype) == ((48, 64), np.float32)
    np.testing.assert_allclose(depth, 3.0, atol=1e-3)  # z, not the length of the ray
    assert (rgb == [255, 0, 0]).all()


def test_depth_of_a_slanted_floor_in_closed_form() -> None:
    height, pitch = 1.5, 0.6
    floor = np.array([[-99.0, -99, 0], [99, -99, 0], [99, 99, 0], [-99, 99, 0]])
    mesh = TexturedMesh((MeshPart("floor", floor, TWO, base_color=colored((9, 9, 9))),))
    camera = camera_of()
    pose = pose_matrix(rotation_from_rpy([0.0, pitch, 0.4]), [1.0, 2.0, height])
    with open_renderer(mesh, camera) as renderer:
        depth = renderer.render_rgbd(pose)[1]
    _, fy, _, cy = intrinsics_of(camera)
    slope = (np.arange(48) + 0.5 - cy) / fy  # y / z through the pixel centres of each row
    expected = height / (np.sin(pitch) + slope * np.cos(pitch))
    # A multi-sampled pixel holds the depth of one sample, at most half a pixel from its centre.
    half = np.abs(np.gradient(expected)) * 0.5
    assert (np.abs(depth - expected[:, None]) <= half[:, None] + 1e-3).all()


def test_where_nothing_is_depth_is_infinite() -> None:
    mesh = TexturedMesh((facing_quad(2.0, 0.2, base_color=colored((255, 255, 255))),))
    with open_renderer(mesh, camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    assert np.isinf(depth[0, 0])
    assert (rgb[0, 0] == 0).all()
    assert depth[24, 32] == pytest.approx(2.0, abs=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_point_is_seen_at_the_pixel_it_projects_to(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = camera_of(width=161, height=119, horizontal_fov_deg=70.0)
    pose = pose_matrix(rotation_from_rpy(rng.uniform(-0.5, 0.5, 3)), rng.uniform(-1, 1, 3))
    point_cam = np.array([*rng.uniform(-0.7, 0.7, 2), 2.0])
    size = 0.03
    corners_cam = point_cam + size * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    corners = corners_cam @ pose[:3, :3].T + pose[:3, 3]
    mesh = TexturedMesh((MeshPart("dot", corners, TWO, base_color=colored((255, 255, 255))),))
    with open_renderer(mesh, camera) as renderer:
        weight = renderer.render(pose)[..., 0].astype(float)
    rows, columns = np.indices(weight.shape) + 0.5  # pixel centres
    seen = np.array([np.sum(columns * weight), np.sum(rows * weight)]) / weight.sum()
    fx, fy, cx, cy = intrinsics_of(camera)
    x, y, z = (inverse(pose) @ [*(point_cam @ pose[:3, :3].T + pose[:3, 3]), 1.0])[:3]
    np.testing.assert_allclose(seen, [fx * x / z + cx, fy * y / z + cy], atol=0.2)


def test_horizontal_field_of_view_is_exact() -> None:
    fx, fy, cx, cy = intrinsics_of(camera_of(width=640, height=480, horizontal_fov_deg=90.0))
    assert (fx, fy, cx, cy) == (pytest.approx(320.0), pytest.approx(320.0), 320.0, 240.0)


def test_texture_is_upright_and_not_mirrored() -> None:
    quarters = np.zeros((64, 64, 3), np.uint8)  # an image: first row on top
    quarters[:32, :32], quarters[:32, 32:] = (255, 0, 0), (0, 255, 0)
    quarters[32:, :32], quarters[32:, 32:] = (0, 0, 255), (255, 255, 0)
    mesh = TexturedMesh((facing_quad(1.0, 2.0, quarters),))
    with open_renderer(mesh, camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    assert rgb[5, 5].tolist() == [255, 0, 0]
    assert rgb[5, -5].tolist() == [0, 255, 0]
    assert rgb[-5, 5].tolist() == [0, 0, 255]
    assert rgb[-5, -5].tolist() == [255, 255, 0]


def test_up_in_the_world_is_up_in_the_image() -> None:
    above, below = facing_quad(2.0, 0.3), facing_quad(2.0, 0.3)
    parts = tuple(
        MeshPart(
            part.name, part.vertices_m + np.array([0, 0, z]), part.faces, base_color=colored(rgb)
        )
        for part, z, rgb in ((above, 0.5, (255, 0, 0)), (below, -0.5, (0, 0, 255)))
    )
    with open_renderer(TexturedMesh(parts), camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    rows = np.arange(48)[:, None]
    assert (rows * (rgb[..., 0] > 128)).max() < 24
    assert rgb[24:, :, 2].max() == 255


def test_surfaces_show_from_behind() -> None:
    mesh = TexturedMesh((facing_quad(1.0, 5.0, base_color=colored((0, 255, 0))),))
    behind = pose_matrix(rotation_from_rpy([0.0, 0.0, np.pi]), [2.0, 0.0, 0.0])
    with open_renderer(mesh, camera_of()) as renderer:
        assert (renderer.render(behind) == [0, 255, 0]).all()


def test_vertex_colours_are_interpolated() -> None:
    colors = np.array([[0, 0, 0], [200, 0, 0], [200, 0, 0], [0, 0, 0]], np.uint8)
    mesh = TexturedMesh((facing_quad(1.0, 1.0, vertex_rgb=colors),))
    with open_renderer(mesh, camera_of(horizontal_fov_deg=90.0)) as renderer:
        row = renderer.render(LOOK_ALONG_X)[24, :, 0]
    expected = 200.0 * (np.arange(64) + 0.5) / 64.0
    np.testing.assert_allclose(row[2:-2], expected[2:-2], atol=2.0)


def test_alpha_below_the_cutoff_lets_the_wall_behind_through() -> None:
    leaf = np.full((32, 32, 4), (0, 255, 0, 255), np.uint8)
    leaf[:, 16:] = (255, 255, 255, 150)  # right half: alpha 0.59
    back = facing_quad(2.0, 9.0, base_color=colored((255, 0, 0)))
    for cutoff, seen, distance in ((0.7, [255, 0, 0], 2.0), (0.5, [255, 255, 255], 1.0)):
        front = facing_quad(1.0, 3.0, leaf, alpha_cutoff=cutoff)
        with open_renderer(TexturedMesh((front, back)), camera_of()) as renderer:
            rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
        assert rgb[24, 8].tolist() == [0, 255, 0]
        assert rgb[24, 56].tolist() == seen
        assert depth[24, 56] == pytest.approx(distance, abs=1e-3)


def test_hidden_colour_of_cut_out_texels_does_not_bleed() -> None:
    rng = np.random.default_rng(0)
    leaf = np.full((256, 256, 4), (0, 200, 0, 255), np.uint8)
    leaf[rng.random((256, 256)) < 0.5] = (255, 0, 255, 0)  # magenta that must never show
    mesh = TexturedMesh((facing_quad(20.0, 8.0, leaf, alpha_cutoff=0.5),))
    with open_renderer(mesh, camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    assert rgb[..., 1].max() > 50
    assert rgb[..., 0].max() <= 2


def test_fine_texture_is_averaged_not_aliased() -> None:
    checker = np.indices((512, 512)).sum(axis=0) % 2 * 255
    texture = np.repeat(checker[..., None], 3, axis=2).astype(np.uint8)
    mesh = TexturedMesh((facing_quad(3.0, 3.0, texture),))
    with open_renderer(mesh, camera_of()) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    np.testing.assert_allclose(rgb.astype(int), 127, atol=3)


def test_odd_sizes_are_not_sheared() -> None:
    texture = np.zeros((9, 7, 3), np.uint8)
    texture[:, 3] = 255  # a vertical line
    mesh = TexturedMesh((facing_quad(1.0, 1.0, texture),))
    with open_renderer(mesh, camera_of(width=75, height=53)) as renderer:
        columns = renderer.render(LOOK_ALONG_X)[..., 0].argmax(axis=1)
    assert np.ptp(columns) <= 1


def test_several_cameras_and_meshes_share_a_process() -> None:
    red = TexturedMesh((facing_quad(1.0, 5.0, np.full((4, 4, 3), (255, 0, 0), np.uint8)),))
    blue = TexturedMesh((facing_quad(1.0, 5.0, np.full((4, 4, 3), (0, 0, 255), np.uint8)),))
    with (
        open_renderer(red, camera_of()) as first,
        open_renderer(blue, camera_of(width=100, height=30)) as second,
    ):
        for _ in range(2):
            assert (first.render(LOOK_ALONG_X) == [255, 0, 0]).all()
            assert second.render(LOOK_ALONG_X).shape == (30, 100, 3)
    with open_renderer(blue, camera_of()) as third:
        assert (third.render(LOOK_ALONG_X) == [0, 0, 255]).all()


def test_without_egl_the_packages_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise ImportError("libEGL.so.1: cannot open shared object file")

    monkeypatch.setattr(pyrender_backend, "_pyrender", fail)
    with pytest.raises(InputError, match="libegl1 libgl1-mesa-dri"):
        pyrender_backend._offscreen.__wrapped__()


def test_importing_the_interface_loads_no_renderer() -> None:
    source = Path(__file__).parents[1] / "synfeal" / "render" / "__init__.py"
    head = source.read_text().split("def open_renderer")[0]
    assert "pyrender_backend" not in head


def test_parts_with_too_many_vertices_are_drawn_in_pieces() -> None:
    rng = np.random.default_rng(0)
    vertices = rng.normal(size=(300, 3))
    faces = rng.integers(0, 300, (500, 3))
    uv, rgb = rng.random((300, 2)), rng.integers(0, 255, (300, 3), np.uint8)
    part = MeshPart("part", vertices, faces, uv, vertex_rgb=rgb)
    split = list(pyrender_backend.pieces(part, most_vertices=90))
    assert max(len(piece.vertices_m) for piece in split) <= 90
    for name, whole in (("vertices_m", vertices), ("uv", uv), ("vertex_rgb", rgb)):
        corners = np.concatenate([getattr(piece, name)[piece.faces] for piece in split])
        np.testing.assert_array_equal(corners, whole[faces])
    assert list(pyrender_backend.pieces(part, most_vertices=300)) == [part]


def test_images_do_not_depend_on_where_the_scene_lies() -> None:
    """In map coordinates, single precision alone would move everything by centimetres."""
    texture = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    quad = facing_quad(3.0, 1.0, texture)
    offset = np.array([512_345.0, 5_402_678.0, 345.0])
    far = replace(quad, vertices_m=quad.vertices_m + offset)
    moved = LOOK_ALONG_X.copy()
    moved[:3, 3] += offset
    with open_renderer(TexturedMesh((quad,)), camera_of()) as renderer:
        rgb, depth = renderer.render_rgbd(LOOK_ALONG_X)
    with open_renderer(TexturedMesh((far,)), camera_of()) as renderer:
        far_rgb, far_depth = renderer.render_rgbd(moved)
    assert np.abs(rgb.astype(int) - far_rgb).max() <= 1
    np.testing.assert_allclose(far_depth, depth, atol=1e-5)
