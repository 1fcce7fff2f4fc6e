"""The OpenGL backend: culling, sampling and company in one process never change a pixel."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render.opengl import backend as opengl
from synfeal.render.opengl import part as opengl_part
from synfeal.render.opengl.backend import OpenglRenderer, clip_from_cam
from synfeal.render.opengl.chunks import FACES_PER_CHUNK, chunks_of, visible_runs
from synfeal.render.opengl.context import shared_context
from tests.render_backends import LOOK_ALONG_X, PYOPENGL_WARNS, camera_of, facing_quad

CAMERA = camera_of(fx=45.0, fy=55.0, cx=20.5, cy=33.0)


def soup(n_faces, seed=0):
    """Small triangles all over a room of 8 m, coloured and textured, some of them coincident."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-4, 4, (n_faces, 1, 3)) + rng.normal(0, 0.4, (n_faces, 3, 3))
    corners[1::7] = corners[0::7][: len(corners[1::7])]
    vertices = corners.reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    half = n_faces // 2
    image = rng.integers(0, 256, (64, 64, 3), np.uint8)
    rgb = rng.integers(0, 256, (len(vertices), 3), np.uint8)
    return TexturedMesh(
        (
            MeshPart("colours", vertices, faces[:half], vertex_rgb=rgb),
            MeshPart("texture", vertices, faces[half:], rng.random((len(vertices), 2)), image),
        )
    )


def poses(count, seed=1):
    rng = np.random.default_rng(seed)
    return [
        pose_matrix(rotation_from_rpy(rng.uniform(-3, 3, 3)), rng.uniform(-3, 3, 3))
        for _ in range(count)
    ]


def digest(renderer, views):
    images = [renderer.render_rgbd(view) for view in views]
    return [hashlib.sha256(rgb.tobytes() + depth.tobytes()).hexdigest() for rgb, depth in images]


def has_context():
    """Whether this machine has OpenGL at all; asked without drawing, or defects would skip."""
    try:
        shared_context()
    except InputError:
        return False
    return True


pytestmark = [
    pytest.mark.filterwarnings(PYOPENGL_WARNS),
    pytest.mark.skipif(not has_context(), reason="OpenGL does not work here"),
]


def test_chunks_hold_every_triangle_once_and_runs_all_that_are_in_view():
    part = soup(3000).parts[1]
    chunks = chunks_of(part.vertices_m, part.faces)
    found = chunks.vertices[chunks.faces]
    assert sorted(map(tuple, found.tolist())) == sorted(map(tuple, part.faces.tolist()))
    corners = part.vertices_m[found].reshape(len(found), -1, 3)
    for index, start in enumerate(range(0, len(found), FACES_PER_CHUNK)):
        inside = corners[start : start + FACES_PER_CHUNK]
        assert (inside >= chunks.lower_m[index]).all()
        assert (inside <= chunks.upper_m[index]).all()
    part = soup(20_000).parts[0]
    chunks = chunks_of(part.vertices_m, part.faces)
    n_drawn = 0
    for pose in poses(20):
        clip_from_mesh = clip_from_cam(CAMERA) @ np.linalg.inv(pose)
        drawn = np.zeros(len(part.faces), bool)
        for first, count in visible_runs(chunks, clip_from_mesh):
            drawn[first // 3 : (first + count) // 3] = True
        corners = part.vertices_m[chunks.vertices[chunks.faces]]
        clip = np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2)
        clip = clip @ clip_from_mesh.T
        in_view = (np.abs(clip[..., :3]) <= clip[..., 3:]).all(axis=2).any(axis=1)
        assert drawn[in_view].all()
        n_drawn += drawn.sum()
    assert n_drawn < 0.75 * 20 * len(part.faces)  # or nothing is culled


def test_culling_changes_no_pixel(monkeypatch):
    mesh, views = soup(6000), poses(8)
    with OpenglRenderer(mesh, CAMERA) as renderer:
        culled = digest(renderer, views)

        def all_of(chunks, clip_from_mesh):
            return [(0, 3 * len(chunks.faces))]

        monkeypatch.setattr(opengl_part, "visible_runs", all_of)
        assert digest(renderer, views) == culled


def test_images_do_not_depend_on_what_was_drawn_before():
    mesh, views = soup(3000), poses(6)
    with OpenglRenderer(mesh, CAMERA) as renderer:
        forth = digest(renderer, views)
        assert digest(renderer, views[::-1])[::-1] == forth
        with OpenglRenderer(soup(500, seed=5), camera_of(width=100, height=30)) as other:
            other.render_rgbd(views[0])
            assert digest(renderer, views) == forth
        assert digest(renderer, views) == forth
    with OpenglRenderer(mesh, CAMERA) as renderer:
        assert digest(renderer, views) == forth
    assert len(set(forth)) == len(views)


DRAW = """
from synfeal.render.opengl.backend import OpenglRenderer
from tests.test_render_opengl import CAMERA, digest, poses, soup
with OpenglRenderer(soup(3000), CAMERA) as renderer:
    print(*digest(renderer, poses(6)))
"""
OPEN3D = """
import open3d
assert len(open3d.geometry.TriangleMesh.create_box().triangles) == 12
"""


@pytest.mark.parametrize(("code", "threads"), [(OPEN3D + DRAW, "1"), (DRAW + OPEN3D + DRAW, "3")])
def test_images_are_the_same_in_another_process(code, threads):
    """With other numbers of threads, and Open3D imported before or after."""
    with OpenglRenderer(soup(3000), CAMERA) as renderer:
        here = digest(renderer, poses(6))
    there = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        env={**os.environ, "LP_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        check=True,
    )
    assert {tuple(line.split()) for line in there.stdout.splitlines()} == {tuple(here)}


def test_colours_alone_draw_no_depth(monkeypatch):
    def fail(*_):
        raise AssertionError("depth was drawn")

    monkeypatch.setattr(OpenglRenderer, "_draw_depth", fail)
    with OpenglRenderer(soup(100), CAMERA) as renderer:
        renderer.render(LOOK_ALONG_X)
        with pytest.raises(AssertionError, match="depth was drawn"):
            renderer.render_rgbd(LOOK_ALONG_X)


def hit_depth_m(mesh, camera):
    """Depth (H, W) of the nearest of few triangles through each pixel's centre, in closed form.

    The camera stands at the origin and looks along world x.
    """
    fx, fy, cx, cy = camera.intrinsics
    row, column = np.indices((camera.height, camera.width)) + 0.5
    rays = np.stack([np.ones_like(row), -(column - cx) / fx, -(row - cy) / fy], axis=-1)
    depth = np.full(row.shape, np.inf)
    vertices, faces = mesh.merged()
    for a, b, c in vertices[faces]:
        columns = np.stack([a, b, c], axis=1)
        if abs(np.linalg.det(columns)) < 1e-9:
            continue  # seen edge-on
        weights = rays @ np.linalg.inv(columns).T  # of the corners, for a ray of length 1 / depth
        inside = (weights > 0).all(axis=-1)
        hit = np.where(inside, 1.0 / weights.sum(axis=-1), np.inf)
        hit[(hit < camera.near_m) | (hit > camera.far_m)] = np.inf
        depth = np.minimum(depth, hit)
    return depth


def test_depth_is_that_of_the_nearest_triangle_at_the_pixels_centre():
    mesh = soup(2000)
    with OpenglRenderer(mesh, CAMERA) as renderer:
        depth = renderer.render_rgbd(LOOK_ALONG_X)[1]
    expected = hit_depth_m(mesh, CAMERA)
    same = np.isclose(depth, expected, rtol=1e-5)
    assert same.mean() > 0.999  # a centre may lie on an edge to within rounding
    assert np.isfinite(expected).mean() > 0.5


@pytest.mark.parametrize("distance", [0.7, 0.75, 0.8, 0.95, 1.1, 1.4, 2.0])
def test_fine_checkerboards_are_grey_at_every_distance(distance):
    """From four texels a pixel on, two a sample, there is nothing to resolve."""
    checker = np.indices((1024, 1024)).sum(axis=0) % 2 * 255
    image = np.repeat(checker[..., None], 3, axis=2).astype(np.uint8)
    mesh = TexturedMesh((facing_quad(distance, 2.0, image),))
    with OpenglRenderer(mesh, camera_of(width=48, height=48)) as renderer:
        rgb = renderer.render(LOOK_ALONG_X)
    np.testing.assert_allclose(rgb.astype(int), 127, atol=4)


def test_textures_and_images_beyond_the_devices_limit(monkeypatch):
    image = np.zeros((300, 100, 3), np.uint8)
    image[:150] = 200
    with OpenglRenderer(TexturedMesh((facing_quad(2.0, 0.9, image),)), CAMERA) as renderer:
        full = renderer.render(LOOK_ALONG_X).astype(int)
    context = shared_context()
    monkeypatch.setitem(context.info, "GL_MAX_TEXTURE_SIZE", 150)
    with OpenglRenderer(TexturedMesh((facing_quad(2.0, 0.9, image),)), CAMERA) as renderer:
        assert renderer._parts[0]._texture.size == (50, 150)
        reduced = renderer.render(LOOK_ALONG_X).astype(int)
    assert np.abs(reduced - full).mean() < 2.0
    monkeypatch.setitem(shared_context().info, "GL_MAX_TEXTURE_SIZE", 128)
    with pytest.raises(InputError, match=r"camera: 64x48 pixels at 3 .* lower render\.supersamp"):
        OpenglRenderer(soup(10), camera_of(), supersampling=3)


def test_closing_frees_the_device(monkeypatch):
    """Every object the renderer asked the context for is released by its end."""
    context = shared_context()
    made = []

    class Recorder:
        def __getattr__(self, name):
            value = getattr(context, name)
            if name in ("buffer", "texture", "program", "vertex_array", "renderbuffer") or (
                "framebuffer" in name or name == "depth_renderbuffer"
            ):
                return lambda *args, **kwargs: made.append(value(*args, **kwargs)) or made[-1]
            return value

        def __enter__(self):
            return context.__enter__()

        def __exit__(self, *error):
            return context.__exit__(*error)

    monkeypatch.setattr(opengl, "shared_context", Recorder)
    with OpenglRenderer(soup(50), CAMERA) as renderer:
        renderer.render_rgbd(LOOK_ALONG_X)
    assert len(made) > 15
    assert [type(item).__name__ for item in made if "Invalid" not in type(item.mglo).__name__] == []
