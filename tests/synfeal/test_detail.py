"""Level of detail: what a resolution does not show is left out, and images stay as true as before.

Truth is the full mesh through 16 rays per pixel: another renderer than the one that draws.
"""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import trimesh

from synfeal.collection.detail import choose_detail, middle_of, write_detail
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import EffectsConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.dataset.render_sequence import render_packed, render_sequence
from synfeal.effects.scene import open_scene
from synfeal.geometry.rotations import quat_wxyz_from_matrix
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.render import open_renderer
from tests import ROOT
from tests.support.small_room import BACKENDS, PYOPENGL_WARNS, camera_of, furnished_room, room_poses

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)
pytest.importorskip("meshoptimizer")
SMALL = camera_of(width=64, height=48)
RENDER = RenderConfig.model_validate({"backend": BACKENDS[0]})
RAYS = RenderConfig(backend="raycast", supersampling=4)


def fine_room(levels=3):
    """The furnished room, each triangle cut in four several times: flat walls of many faces."""
    return TexturedMesh(
        tuple(subdivided(part, levels) for part in furnished_room((2.0, 8.0)).parts)
    )


def subdivided(part, levels):
    if part.uv is None:
        return part
    columns = np.concatenate([part.vertices_m, part.uv], axis=1)
    faces = part.faces
    for _ in range(levels):
        columns, faces = trimesh.remesh.subdivide(columns, faces)
    return replace(part, vertices_m=columns[:, :3], uv=columns[:, 3:], faces=faces)


def drawn(mesh, poses, render=RENDER):
    with open_renderer(mesh, SMALL, render) as renderer:
        return np.stack([renderer.render(pose) for pose in poses]).astype(float)


@pytest.fixture(scope="module")
def chosen():
    mesh = fine_room()
    return mesh, choose_detail(mesh, SMALL, room_poses(8, seed=5), RENDER)


def test_the_choice_has_a_fraction_of_the_faces_and_its_images_are_as_true(chosen):
    mesh, detail = chosen
    assert detail.chosen.mesh.n_faces < mesh.n_faces / 3
    poses = room_poses(5, seed=11)  # none of those it was chosen by
    truth = drawn(mesh, poses, RAYS)
    full, less = (np.abs(drawn(m, poses) - truth).mean() for m in (mesh, detail.chosen.mesh))
    assert less < 1.15 * full


def test_the_choice_is_the_same_each_time(chosen):
    mesh, detail = chosen
    again = choose_detail(mesh, SMALL, room_poses(8, seed=5), RENDER)
    assert again.record(RENDER) == detail.record(RENDER)
    for part, other in zip(again.chosen.mesh.parts, detail.chosen.mesh.parts, strict=True):
        np.testing.assert_array_equal(part.vertices_m, other.vertices_m)
        np.testing.assert_array_equal(part.faces, other.faces)


def test_a_lens_is_judged_by_the_size_of_its_pixels():
    lens = camera_of(width=400, height=300, fx=210.0, fy=205.0, cx=190.0, cy=160.0)
    lens = lens.model_copy(update={"distortion": (-0.1, 0.01, 0.0, 0.0, 0.0)})
    window = middle_of(lens)
    assert not any(window.distortion)
    assert (window.width, window.height) == (320, 240)
    assert window.intrinsics[:2] == lens.intrinsics[:2]
    # The ray of the window's corner is that of the pixel 40 columns and 30 rows into the image.
    assert window.intrinsics[2:] == (190.0 - 40.0, 160.0 - 30.0)


@pytest.fixture
def scene(tmp_path):
    """The files of a scene of which two walls were taken away for colours."""
    mesh, poses = furnished_room((2.0, 8.0)), room_poses(3, seed=2)
    save_glb(tmp_path / "mesh.glb", mesh)
    save_glb(tmp_path / "detail.glb", TexturedMesh(mesh.parts[2:]))
    index = np.arange(len(poses))
    rotations = quat_wxyz_from_matrix(poses[:, :3, :3])
    write_pose_table(tmp_path / "test.csv", PoseTable(index, index, poses[:, :3, 3], rotations))
    return tmp_path


def test_depth_is_that_of_the_full_mesh_and_colour_that_of_the_detail(scene):
    pose = room_poses(3, seed=2)[0]

    def seen(*meshes, render=RENDER):
        with open_scene(meshes[0], SMALL, render, *meshes[1:]) as renderer:
            return renderer.render_rgbd(pose)

    full, less = seen(scene / "mesh.glb"), seen(scene / "detail.glb")
    assert (full[0] != less[0]).any()
    assert (full[1] != less[1]).any()
    mixed = seen(scene / "mesh.glb", scene / "detail.glb")
    np.testing.assert_array_equal(mixed[0], less[0])
    np.testing.assert_array_equal(mixed[1], full[1])
    asked = RENDER.model_copy(update={"detail": "full"})
    whole = seen(scene / "mesh.glb", scene / "detail.glb", render=asked)
    np.testing.assert_array_equal(whole[0], full[0])


def test_switched_light_is_drawn_on_the_full_mesh():
    assert not RenderConfig().draws_full_mesh
    states = EffectsConfig.model_validate({"light": {"states": ["daylight"]}})
    assert RenderConfig(effects=states).draws_full_mesh
    assert not RenderConfig(effects=EffectsConfig(jpeg_quality=50)).draws_full_mesh


def test_frames_and_packed_frames_are_drawn_of_the_detail(scene):
    files = scene / "mesh.glb", SMALL, scene / "test.csv"
    render_packed(*files, 0, 3, 32, "whole", RENDER, scene / "full.npy")
    render_packed(*files, 0, 3, 32, "whole", RENDER, scene / "less.npy", scene / "detail.glb")
    full, less = np.load(scene / "full.npy"), np.load(scene / "less.npy")
    assert (full != less).any()
    render_sequence(*files, 0, 3, True, RENDER, scene / "seq-full")
    render_sequence(*files, 0, 3, True, RENDER, scene / "seq-less", scene / "detail.glb")
    for number in range(3):
        name = f"frame-{number:06d}.depth.png"
        depth_m = [read_depth_m(scene / folder / name) for folder in ("seq-full", "seq-less")]
        np.testing.assert_array_equal(*depth_m)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.12, 0.02, 0.001, 0.0, 0.0)])
def test_depth_alone_is_the_depth_of_both(backend, distortion):
    camera = CameraConfig(width=64, height=48, distortion=distortion)
    pose = room_poses(1, seed=4)[0]
    with open_renderer(furnished_room((2.0, 8.0)), camera, RenderConfig(backend=backend)) as r:
        np.testing.assert_array_equal(r.render_depth(pose), r.render_rgbd(pose)[1])


def test_what_is_written_can_be_drawn_and_says_what_it_is(tmp_path):
    mesh, poses = fine_room(), room_poses(6, seed=5)
    index = np.arange(len(poses))
    save_glb(tmp_path / "mesh.glb", mesh)
    rotations = quat_wxyz_from_matrix(poses[:, :3, :3])
    write_pose_table(tmp_path / "test.csv", PoseTable(index, index, poses[:, :3, 3], rotations))
    out = tmp_path / "detail.glb", tmp_path / "detail.json"
    write_detail(tmp_path / "mesh.glb", [tmp_path / "test.csv"], SMALL, RENDER, *out)
    record = json.loads(out[1].read_text())
    assert record["full_faces"] == mesh.n_faces
    assert record["faces"] < mesh.n_faces
    with open_scene(tmp_path / "mesh.glb", SMALL, RENDER, out[0]) as renderer:
        seen = renderer.render(poses[0])
    with open_renderer(mesh, SMALL, RENDER) as renderer:
        assert np.abs(seen.astype(float) - renderer.render(poses[0])).mean() < 3.0


@pytest.fixture(scope="module")
def ball():
    """A ball around the cameras, coloured at its vertices, and two poses in it."""
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=1.5)
    rgb = (128.0 + 100.0 * np.sin(6.0 * sphere.vertices)).astype(np.uint8)
    poses = room_poses(2, seed=1)
    poses[:, :3, 3] = 0.0
    part = MeshPart("ball", sphere.vertices, np.asarray(sphere.faces, np.int64), vertex_rgb=rgb)
    return TexturedMesh((part,)), poses


def test_colours_of_vertices_have_levels_and_the_next_one_would_show(ball):
    mesh, poses = ball
    detail = choose_detail(mesh, SMALL, poses, RENDER)
    assert detail.chosen.mesh.n_faces < mesh.n_faces / 4
    truth = drawn(mesh, poses, RAYS)
    worst = max(detail.tried, key=lambda level: level.error_levels)
    chosen, refused = (
        np.abs(drawn(level.mesh, poses) - truth).mean() for level in (detail.chosen, worst)
    )
    assert refused > 1.5 > chosen


def test_a_larger_image_keeps_more(ball):
    mesh, poses = ball
    faces = [
        choose_detail(mesh, camera_of(width=width, height=height), poses, RENDER)
        for width, height in ((24, 18), (200, 150))
    ]
    assert faces[0].chosen.mesh.n_faces <= faces[1].chosen.mesh.n_faces


def tracked_rows():
    """The tracked table of what levels of detail cost and are worth, by scene and size."""
    table = pd.read_csv(ROOT / "results/benchmarks/detail.csv")
    return [
        pytest.param(rows, id=f"{scene}-{width}x{height}")
        for (scene, width, height), rows in table.groupby(["scene", "width", "height"])
    ]


@pytest.mark.parametrize("rows", tracked_rows())
def test_what_is_shipped_is_on_the_measured_front(rows):
    """Nothing measured is both quicker and closer to the truth than what is drawn by default."""
    samples = RenderConfig().supersampling
    chosen = rows[(rows.level == "chosen") & (rows.supersampling == samples)]
    full = rows[(rows.level == "full") & (rows.supersampling == samples)].iloc[0]
    used = chosen.iloc[0] if len(chosen) else full  # nothing was left out
    # Times of two runs differ by a few percent.
    better = (rows.cpu_ms < 0.95 * used.cpu_ms) & (rows.error_levels < used.error_levels)
    assert not better.any(), rows[better]
    assert used.error_levels <= max(1.05 * full.error_levels, 1.6)
