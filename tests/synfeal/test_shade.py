"""Light for meshes without texture: a lamp at the camera by closed form, ambient by bounds."""

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import synfeal
from synfeal.camera.projection import normalised_of_pixels
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.ambient import (
    LEAST,
    brightness,
    cut_part,
    hemisphere_directions,
    with_ambient_light,
)
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.save import save_glb
from synfeal.render import choose
from synfeal.render.base import EDGE_ON_SHARE
from tests.support.collected import SMALL, refused
from tests.support.small_room import (
    BACKENDS,
    LOOK_ALONG_X,
    PYOPENGL_WARNS,
    TWO,
    colored,
    facing_quad,
    furnished_room,
    room_poses,
)

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

CAMERA = CameraConfig(width=64, height=48, fx=40.0, fy=44.0, cx=30.0, cy=25.0)
HEADLIGHT = RenderConfig(supersampling=1, shade="headlight")


def pixel_rays(camera):
    """Lines of sight (H, W, 3) of unit length, camera coordinates."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    at = normalised_of_pixels(camera, np.stack([column, row], axis=-1).reshape(-1, 2))
    rays = np.column_stack([at, np.ones(len(at))]).reshape(camera.height, camera.width, 3)
    return rays / np.linalg.norm(rays, axis=2, keepdims=True)


@pytest.mark.parametrize("turned_deg", [0.0, 50.0])
@pytest.mark.parametrize("far_away_m", [0.0, 3e5])
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_wall_shows_the_cosine_at_which_it_is_seen(backend, far_away_m, turned_deg):
    wall = facing_quad(0.0, 40.0, base_color=colored((200, 100, 50)))
    turn = Rotation.from_euler("z", turned_deg, degrees=True).as_matrix()
    place = np.array([2.0, 0.0, 0.0]) + far_away_m
    mesh = TexturedMesh((replace(wall, vertices_m=wall.vertices_m @ turn.T + place),))
    pose = pose_matrix(rotation_from_rpy([0.3, 0.1, 0.0]), np.full(3, far_away_m))
    with choose.BACKENDS[backend](mesh, CAMERA, HEADLIGHT) as renderer:
        rgb, depth_m = renderer.render_rgbd(pose)
    cosine = np.abs(pixel_rays(CAMERA) @ pose[:3, :3].T @ turn[:, 0])
    expected = (EDGE_ON_SHARE + (1.0 - EDGE_ON_SHARE) * cosine)[..., None] * [200.0, 100.0, 50.0]
    seen = np.isfinite(depth_m)
    assert seen.mean() > 0.9
    assert np.abs(rgb[seen] - expected[seen]).max() <= 1.0


def test_all_backends_light_a_furnished_room_alike():
    mesh, poses = furnished_room((1.5, 4.0, 16.0)), room_poses(4, seed=1)
    images = []
    for name in BACKENDS:
        with choose.BACKENDS[name](mesh, CAMERA, RenderConfig(shade="headlight")) as renderer:
            images.append(np.stack([renderer.render(pose) for pose in poses]).astype(np.int16))
    for image in images[1:]:
        assert np.abs(image - images[0]).mean() < 0.7
    with choose.BACKENDS[BACKENDS[0]](mesh, CAMERA, RenderConfig()) as renderer:
        plain = np.stack([renderer.render(pose) for pose in poses])
    assert (images[0] <= plain + 1).all()  # a lamp shows at most the colour that is there
    assert images[0].mean() < 0.95 * plain.mean()


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_empty_keeps_its_background(backend):
    mesh = TexturedMesh((facing_quad(2.0, 0.2, base_color=colored((10, 10, 10))),))
    render = HEADLIGHT.model_copy(update={"background_rgb": (90, 120, 200)})
    with choose.BACKENDS[backend](mesh, CAMERA, render) as renderer:
        rgb, depth_m = renderer.render_rgbd(LOOK_ALONG_X)
    assert (rgb[np.isinf(depth_m)] == [90, 120, 200]).all()


def white_box(extents=(6.0, 5.0, 3.0)):
    """A closed room around the origin without any colours."""
    box = trimesh.creation.box(extents)
    return TexturedMesh((MeshPart("walls", np.asarray(box.vertices), np.asarray(box.faces)),))


def test_cutting_leaves_no_long_edge_no_gap_and_the_same_surface():
    (part,) = white_box().parts
    rng = np.random.default_rng(0)
    part = replace(part, uv=part.vertices_m[:, :2] @ rng.random((2, 2)))
    pieces = cut_part(part, 0.4)
    corners = pieces.vertices_m[pieces.faces]
    assert np.linalg.norm(np.roll(corners, 1, axis=1) - corners, axis=2).max() <= 0.4
    whole = trimesh.Trimesh(pieces.vertices_m, pieces.faces)  # joins vertices at one place
    assert whole.is_watertight
    assert whole.volume == pytest.approx(6.0 * 5.0 * 3.0)
    matrix = np.linalg.lstsq(part.vertices_m[:, :2], part.uv, rcond=None)[0]
    np.testing.assert_allclose(pieces.uv, pieces.vertices_m[:, :2] @ matrix, atol=1e-9)
    assert cut_part(pieces, 0.4) is pieces


def test_directions_are_those_of_lambert():
    """The cosine is 2/3 on average, its square 1/2: integrals of cos^2 and cos^3 over the dome."""
    directions = hemisphere_directions(4000)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert directions[:, 2].mean() == pytest.approx(2 / 3, abs=1e-3)
    assert (directions[:, 2] ** 2).mean() == pytest.approx(1 / 2, abs=1e-3)
    np.testing.assert_allclose(directions[:, :2].mean(axis=0), 0.0, atol=2e-3)


def test_ambient_light_is_darker_in_corners_and_the_same_from_everywhere():
    lit = with_ambient_light(white_box())
    (part,) = lit.parts
    assert part.vertex_rgb is not None
    grey = part.vertex_rgb[:, 0].astype(float)
    off_floor = np.abs(part.vertices_m[:, 2] + 1.5) < 1e-6
    # Of the copies that meet in an edge only those of the floor.
    floor = off_floor & np.isin(
        np.arange(len(grey)), part.faces[np.ptp(part.vertices_m[part.faces][..., 2], axis=1) < 1e-6]
    )
    to_wall_m = np.min(np.array([3.0, 2.5]) - np.abs(part.vertices_m[:, :2]), axis=1)
    in_corner = floor & (np.abs(part.vertices_m[:, :2]) > [2.9, 2.4]).all(axis=1)
    assert grey[floor & (to_wall_m > 1.8)].min() > grey[floor & (to_wall_m < 0.1)].max()
    assert grey[in_corner].max() < grey[floor & (to_wall_m < 0.1)].mean()
    again = with_ambient_light(white_box()).parts[0]
    np.testing.assert_array_equal(again.vertex_rgb, part.vertex_rgb)


def test_brightness_between_two_planes_is_that_of_the_integral():
    """3 m apart and endless: the mean of d / (d + 1) is 6 - 18 ln(4/3), weighted by cosine.

    With d = 3 / z along directions of density 2 z, and the facing of the floor from the axis.
    """
    planes = trimesh.creation.box((2000.0, 2000.0, 3.0))
    up = np.array([[0.0, 0.0, 1.0]])
    found = brightness(
        RayCaster(planes.vertices, planes.faces), np.array([[0.3, 0.2, -1.5]]), up, 1e-3
    )
    openness = 6.0 - 18.0 * np.log(4.0 / 3.0)
    expected = LEAST + (1.0 - LEAST) * openness * (0.75 + 0.25 * np.sqrt(0.32))
    assert found[0] == pytest.approx(expected, rel=0.01)


def test_both_sides_of_a_thick_wall_are_lit():
    """Its inside is shut: brightness is that of what cameras see."""
    wall = trimesh.creation.box((0.1, 6.0, 3.0))
    lit = with_ambient_light(
        TexturedMesh((MeshPart("wall", np.asarray(wall.vertices), np.asarray(wall.faces)),))
    )
    (part,) = lit.parts
    assert part.vertex_rgb.min() > 0.7 * 255


def test_ambient_light_keeps_textures_and_colours():
    textured = furnished_room((1.5, 4.0, 16.0))
    lit = with_ambient_light(textured)
    assert [part.name for part in lit.parts] == [part.name for part in textured.parts]
    for before, after in zip(textured.parts, lit.parts, strict=True):
        assert (before.texture is None) == (after.texture is None)
        assert before.alpha_cutoff == after.alpha_cutoff
        assert after.vertex_rgb is not None
        if before.vertex_rgb is not None:
            assert after.vertex_rgb.max() <= before.vertex_rgb.max()


@pytest.fixture
def bare_room(tmp_path):
    """A room of two cupboards and walls in one plain colour, as OBJ without materials."""
    boxes = [trimesh.creation.box((6.0, 5.0, 3.0))]
    for x, y in ((-1.0, 1.0), (1.5, -1.2)):
        boxes.append(trimesh.creation.box((0.8, 0.6, 1.8)).apply_translation([x, y, -0.6]))
    path = tmp_path / "bare.obj"
    path.write_text(trimesh.util.concatenate(boxes).export(file_type="obj"))
    return path


def test_a_mesh_without_colours_is_refused_with_the_way_out_and_collected_with_it(
    bare_room, tmp_path, capfd
):
    command = ["collect", str(bare_room), "--frames", "30", *SMALL, "--depth"]
    said = refused(capfd, *command, "--out", tmp_path / "plain")
    assert "--shade" in said
    assert "neither a texture nor" in said
    for shade in ("headlight", "ambient"):
        out = tmp_path / shade
        assert main([*command, "--shade", shade, "--out", str(out)]) == 0
        assert main(["validate", str(out)]) == 0
        assert json.loads((out / "manifest.json").read_text())["render"]["shade"] == shade


def test_the_renderer_of_the_python_interface_shades(bare_room):
    mesh = synfeal.load_mesh(bare_room)
    pose = pose_matrix(rotation_from_rpy([0.0, 0.1, 1.0]), np.zeros(3))
    sizes = {}
    for shade in (None, "headlight", "ambient"):
        with synfeal.Renderer(mesh, width=64, height=48, shade=shade) as renderer:
            sizes[shade] = np.ptp(renderer.render(pose))
    assert sizes[None] == 0
    assert min(sizes["headlight"], sizes["ambient"]) > 40


def test_shaded_colours_survive_saving(tmp_path):
    lit = with_ambient_light(TexturedMesh((facing_quad(2.0, 1.0),)))
    save_glb(tmp_path / "lit.glb", lit)
    (part,) = load_mesh(tmp_path / "lit.glb").parts
    np.testing.assert_array_equal(part.vertex_rgb, lit.parts[0].vertex_rgb)
    assert len(part.faces) > len(TWO)
