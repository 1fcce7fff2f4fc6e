"""All renderers that work here draw the same images, so that data does not depend on which did.

Nor does what OpenGL culls, or what else is drawn in its process, change a pixel.
"""

import hashlib
import itertools
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import choose, opengl_part
from synfeal.render.base import UnavailableError
from synfeal.render.opengl_backend import OpenglRenderer, clip_from_cam, shared_context
from synfeal.render.opengl_part import FACES_PER_CHUNK, chunks_of, visible_runs
from tests.support.small_room import (
    BACKENDS,
    LOOK_ALONG_X,
    PYOPENGL_WARNS,
    camera_of,
    facing_quad,
    furnished_room,
    room_poses,
)

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

# Fine enough that every pixel has detail, coarse enough that it can be seen.
PAINT_TEXELS = (1.5, 4.0, 16.0)
ROOM_CAMERA = CameraConfig(width=160, height=120, fx=130.0, fy=138.0, cx=77.0, cy=64.5)
JUMP = 0.02  # neighbours whose depths differ by more than this share lie on either side of an edge


@pytest.fixture(scope="module")
def room_frames():
    """A dozen views of a furnished room by every backend, in turns: colours and depths."""
    mesh, views = furnished_room(PAINT_TEXELS), room_poses(12, seed=3)
    opened = {name: choose.BACKENDS[name](mesh, ROOM_CAMERA, RenderConfig()) for name in BACKENDS}
    seen = [{name: opened[name].render_rgbd(pose) for name in opened} for pose in views]
    for renderer in opened.values():
        renderer.close()
    return {
        name: [np.stack(k) for k in zip(*(s[name] for s in seen), strict=True)] for name in opened
    }


def away_from_edges(depth_m):
    """Pixels (N, H, W) among whose 3 x 3 neighbours depth does not jump; the border is out."""
    least, most = minimum_filter(depth_m, (1, 3, 3)), maximum_filter(depth_m, (1, 3, 3))
    smooth = np.isfinite(most) & (most <= (1.0 + JUMP) * least)
    smooth[:, [0, -1]] = smooth[:, :, [0, -1]] = False
    return np.asarray(smooth, np.bool_)


@pytest.mark.parametrize(("first", "second"), list(itertools.combinations(BACKENDS, 2)))
def test_colours_and_depths_agree(room_frames, first, second):
    (rgb, depth_m), (other_rgb, other_depth_m) = room_frames[first], room_frames[second]
    smooth = away_from_edges(depth_m) & away_from_edges(other_depth_m)
    assert smooth.mean() > 0.5  # there is something away from edges
    level = np.abs(rgb.astype(np.int16) - other_rgb)
    assert level.mean() <= 0.5
    # Where OpenGL, which measures a texture's footprint on blocks of 2 x 2 samples, takes another
    # mip level than the footprint at the sample asks for: one pixel in ten thousand.
    assert level[smooth].max() <= 48
    sees = np.isfinite(depth_m), np.isfinite(other_depth_m)
    assert np.mean(sees[0] != sees[1]) <= 0.001
    both = sees[0] & sees[1]
    assert np.mean(np.abs(depth_m[both] - other_depth_m[both]) <= 1e-3) >= 0.999
    assert np.abs(depth_m[smooth] - other_depth_m[smooth]).max() <= 1e-4


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


def digest(renderer, views):
    images = [renderer.render_rgbd(view) for view in views]
    return [hashlib.sha256(rgb.tobytes() + depth.tobytes()).hexdigest() for rgb, depth in images]


def has_context():
    """Whether this machine has OpenGL at all; asked without drawing, or defects would skip."""
    try:
        shared_context()
    except UnavailableError:
        return False
    return True


needs_opengl = pytest.mark.skipif(not has_context(), reason="OpenGL does not work here")


@needs_opengl
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
    for pose in room_poses(20, 1):
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


@needs_opengl
def test_culling_changes_no_pixel(monkeypatch):
    mesh, views = soup(6000), room_poses(8, 1)
    with OpenglRenderer(mesh, CAMERA) as renderer:
        culled = digest(renderer, views)

        def all_of(chunks, clip_from_mesh):
            return [(0, 3 * len(chunks.faces))]

        monkeypatch.setattr(opengl_part, "visible_runs", all_of)
        assert digest(renderer, views) == culled


@needs_opengl
def test_images_do_not_depend_on_what_was_drawn_before():
    mesh, views = soup(3000), room_poses(6, 1)
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
from synfeal.render.opengl_backend import OpenglRenderer
from tests.support.small_room import room_poses
from tests.synfeal.test_render_agreement import CAMERA, digest, soup
with OpenglRenderer(soup(3000), CAMERA) as renderer:
    print(*digest(renderer, room_poses(6, 1)))
"""
OPEN3D = """
import open3d
assert len(open3d.geometry.TriangleMesh.create_box().triangles) == 12
"""


@needs_opengl
@pytest.mark.parametrize(("code", "threads"), [(OPEN3D + DRAW, "1"), (DRAW + OPEN3D + DRAW, "3")])
def test_images_are_the_same_in_another_process(code, threads):
    """With other numbers of threads, and Open3D imported before or after."""
    with OpenglRenderer(soup(3000), CAMERA) as renderer:
        here = digest(renderer, room_poses(6, 1))
    there = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        env={**os.environ, "LP_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        check=True,
    )
    assert {tuple(line.split()) for line in there.stdout.splitlines()} == {tuple(here)}


@needs_opengl
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
        OpenglRenderer(soup(10), camera_of(), RenderConfig(supersampling=3))


@needs_opengl
def test_closing_frees_the_device(monkeypatch):
    """All that a renderer asked for is released by its end, by moderngl's own count."""
    context, freed = shared_context(), []
    with context:
        context.gc()  # what other tests left
    release = type(context).gc
    monkeypatch.setattr(type(context), "gc", lambda held: freed.append(release(held)))
    with OpenglRenderer(soup(50), CAMERA) as renderer:
        renderer.render_rgbd(LOOK_ALONG_X)
    # Two parts with 3 buffers, 2 programs and 2 vertex arrays each, one of them with a texture; a
    # program and a vertex array for means; 3 framebuffers with 2 images each.
    assert freed == [2 * 7 + 1 + 2 + 3 * 3]
