"""Vertex colours as a texture: triangles go, colours stay where they were."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from synfeal.config.dataset import RenderConfig
from synfeal.mesh.atlas import texel_size_m, with_baked_colors
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.triangles import with_fewer_faces
from synfeal.render import open_renderer
from tests.support.small_room import BACKENDS, LOOK_ALONG_X, PYOPENGL_WARNS, camera_of, room_poses

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)
CAMERA = camera_of(width=80, height=60)


def drawn(part, poses, camera=CAMERA):
    render = RenderConfig.model_validate({"backend": BACKENDS[0]})
    with open_renderer(TexturedMesh((part,)), camera, render) as renderer:
        return np.stack([renderer.render(pose) for pose in poses]).astype(float)


def stripes(points):
    """Smooth stripes, about ten along two metres, and a gradient."""
    waves = np.sin(points @ np.array([[9.0, 4.0, 0.0], [3.0, -8.0, 1.0], [0.0, 5.0, 10.0]]))
    return np.rint(128.0 + 100.0 * waves).astype(np.uint8)


@pytest.fixture(scope="module")
def cave():
    """A sphere around the cameras, of which a triangle is far smaller than a stripe."""
    sphere = trimesh.creation.icosphere(subdivisions=6, radius=1.5)
    vertices = np.asarray(sphere.vertices, np.float64)
    faces = np.asarray(sphere.faces, np.int64)
    return MeshPart("cave", vertices, faces, vertex_rgb=stripes(vertices))


def views():
    poses = room_poses(4, seed=3)
    poses[:, :3, 3] *= 0.1
    return poses


def test_few_triangles_show_the_colours_of_many(cave):
    pytest.importorskip("meshoptimizer")
    reduced = with_fewer_faces(TexturedMesh((cave,)), len(cave.faces) // 32).parts[0]
    baked = with_baked_colors(reduced, cave, texel_size_m(cave))
    assert len(baked.faces) == len(reduced.faces)
    truth = drawn(cave, views())
    plain, textured = (np.abs(drawn(part, views()) - truth).mean() for part in (reduced, baked))
    assert textured < 4.0
    assert textured < plain / 4.0


def test_triangles_stay_where_they_are_and_colours_are_those_of_their_places(cave):
    baked = with_baked_colors(cave, cave, texel_size_m(cave))
    np.testing.assert_array_equal(baked.vertices_m[baked.faces], cave.vertices_m[cave.faces])
    assert baked.uv is not None
    assert baked.texture is not None
    assert baked.vertex_rgb is None
    assert (np.abs(baked.uv - 0.5) < 0.5).all()
    height, width = baked.texture.shape[:2]
    column = (baked.uv[:, 0] * width).astype(int)
    row = ((1.0 - baked.uv[:, 1]) * height).astype(int)
    found = baked.texture[row, column].astype(float)
    # A corner lies up to 0.7 texels of 0.025 m from a texel's centre, which on a slope are 0.03 m;
    # the stripes change by 1,000 levels a metre at most.
    assert np.abs(found - stripes(baked.vertices_m)).max() < 40.0
    assert np.abs(found - stripes(baked.vertices_m)).mean() < 6.0


def test_baking_is_the_same_each_time(cave):
    first, second = (with_baked_colors(cave, cave, 0.05) for _ in range(2))
    np.testing.assert_array_equal(first.texture, second.texture)
    np.testing.assert_array_equal(first.uv, second.uv)


def grid(x, rgb, towards_camera):
    """A sheet of 2 m at ``x``, of one colour, with vertices every 5 cm."""
    side = np.linspace(-1.0, 1.0, 41)
    y, z = (a.ravel() for a in np.meshgrid(side, side))
    at = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = (s.ravel() for s in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])
    faces = faces if towards_camera else faces[:, ::-1]
    vertices = np.stack([np.full(len(y), x), y, z], axis=1)
    return vertices, faces, np.tile(np.array(rgb, np.uint8), (len(y), 1))


def test_the_back_of_a_thin_sheet_does_not_shine_through():
    red, blue = (220, 20, 20), (20, 20, 220)
    sheets = grid(2.0, red, True), grid(2.03, blue, False)
    count = len(sheets[0][0])
    part = MeshPart(
        "sheets",
        np.concatenate([s[0] for s in sheets]),
        np.concatenate([sheets[0][1], sheets[1][1] + count]),
        vertex_rgb=np.concatenate([s[2] for s in sheets]),
    )
    baked = with_baked_colors(part, part, 0.05)
    behind = LOOK_ALONG_X.copy()
    behind[:3, :3] = LOOK_ALONG_X[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    behind[:3, 3] = [4.03, 0.0, 0.0]
    near = camera_of(width=80, height=60, horizontal_fov_deg=40)
    for pose, color in ((LOOK_ALONG_X, red), (behind, blue)):
        np.testing.assert_allclose(
            drawn(baked, [pose], near)[0], np.full((60, 80, 3), color), atol=2
        )


def test_a_mesh_far_from_the_origin_is_baked_alike(cave):
    offset = np.array([4096.0, -8192.0, 128.0])  # of binary fractions: sums are exact enough
    moved = replace(cave, vertices_m=cave.vertices_m + offset)
    here, there = (with_baked_colors(part, part, 0.05) for part in (cave, moved))
    assert here.texture is not None
    assert there.texture is not None
    assert np.abs(here.texture.mean() - there.texture.mean()) < 1.0
