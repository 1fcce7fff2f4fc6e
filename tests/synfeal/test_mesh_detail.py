"""Less detail of a textured mesh: what is seen of flat surfaces stays, and seams stay seams."""

import numpy as np
import pytest

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.triangles import with_fewer_faces, with_smaller_textures
from tests.support.small_room import BACKENDS, LOOK_ALONG_X, PYOPENGL_WARNS, camera_of, opener_of

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)
N = 24  # cells along each side of a grid
RED, GREEN, BLUE = (220, 30, 30), (30, 220, 30), (30, 30, 220)


def sheet(y, u, depth=None, half=2.0):
    """Vertices, faces and texture coordinates of a grid at x = 3 m that faces the camera.

    Args:
        y: of its left and right side, metres; left is larger.
        u: texture coordinate of the same.
        depth: what is added to x, as a function of y and z.
        half: half its height, metres.
    """
    right, up = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, N + 1), np.linspace(0, 1, N + 1)))
    ys, zs = y[0] + (y[1] - y[0]) * right, half * (2.0 * up - 1.0)
    xs = 3.0 + (depth(ys, zs) if callable(depth) else 0.0 * ys)
    at = np.arange((N + 1) ** 2).reshape(N + 1, N + 1)
    a, b, c, d = (s.ravel() for s in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([xs, ys, zs], axis=1), faces, np.stack([u[0] + (u[1] - u[0]) * right, up], 1)


def joined(*sheets):
    """Sheets as one part; where they meet there are two copies of each vertex. No texture yet."""
    vertices, faces, uv = zip(*sheets, strict=True)
    first = np.cumsum([0, *map(len, vertices)])
    shifted = [f + offset for f, offset in zip(faces, first, strict=False)]
    return MeshPart("part", np.concatenate(vertices), np.concatenate(shifted), np.concatenate(uv))


def textured(part, texture):
    return MeshPart(part.name, part.vertices_m, part.faces, part.uv, texture)


def bands():
    """Red to 0.4 of the width, blue from 0.6 on, and between them a green that nothing shows."""
    image = np.empty((16, 160, 3), np.uint8)
    image[:, :72], image[:, 72:88], image[:, 88:] = RED, GREEN, BLUE
    return image


def waves(y, z):
    return 0.1 * np.sin(4.0 * z) + 0.08 * np.sin(5.0 * y + z)


def seen(mesh, backend):
    with opener_of(backend)(mesh, camera_of()) as renderer:
        return renderer.render_rgbd(LOOK_ALONG_X)


@pytest.mark.parametrize("factor", [2, 4])
def test_a_smaller_texture_holds_the_means_of_boxes(factor):
    rng = np.random.default_rng(0)
    texture = rng.integers(0, 256, (8, 16, 3)).astype(np.uint8)
    part = textured(joined(sheet((2, -2), (0, 1))), texture)
    smaller = with_smaller_textures(TexturedMesh((part,)), factor).parts[0].texture
    boxes = texture.reshape(8 // factor, factor, 16 // factor, factor, 3).mean(axis=(1, 3))
    assert smaller is not None
    np.testing.assert_allclose(smaller, boxes, atol=0.5001)


def test_what_is_cut_out_does_not_shine_through_a_smaller_texture():
    texture = np.zeros((2, 2, 4), np.uint8)
    texture[:, 0] = (200, 100, 50, 255)
    part = textured(joined(sheet((2, -2), (0, 1))), texture)
    smaller = with_smaller_textures(TexturedMesh((part,)), 2).parts[0].texture
    assert smaller is not None
    np.testing.assert_allclose(smaller, [[[200, 100, 50, 128]]], atol=1)


class TestFewerFaces:
    """Needs the simplifier, which a machine without a compiler may lack."""

    @pytest.fixture(autouse=True)
    def _simplifier(self):
        pytest.importorskip("meshoptimizer")

    @pytest.mark.parametrize("backend", BACKENDS)
    def test_a_flat_wall_looks_the_same(self, backend):
        texture = np.random.default_rng(1).integers(0, 256, (64, 64, 3)).astype(np.uint8)
        full = TexturedMesh((textured(joined(sheet((2, -2), (0, 1))), texture),))
        reduced = with_fewer_faces(full, 60)
        assert reduced.n_faces <= 60
        before, after = seen(full, backend), seen(reduced, backend)
        np.testing.assert_allclose(after[0], before[0].astype(int), atol=1)
        np.testing.assert_allclose(after[1], before[1], atol=1e-5)

    @pytest.mark.parametrize("parts", [1, 2])
    def test_a_seam_neither_smears_nor_opens(self, parts):
        left = sheet((2.5, 0.2), (0.0, 0.4), waves)
        right = sheet((0.2, -2.5), (0.6, 1.0), waves)
        sheets = [joined(left, right)] if parts == 1 else [joined(left), joined(right)]
        full = TexturedMesh(tuple(textured(part, bands()) for part in sheets))
        reduced = with_fewer_faces(full, full.n_faces // 8)
        assert reduced.n_faces < full.n_faces // 7
        (before, _), (rgb, depth_m) = (seen(mesh, "raycast") for mesh in (full, reduced))
        assert np.isfinite(depth_m).all()  # nothing is seen through the seam
        assert rgb[..., 1].max() < 40  # no green: no triangle reaches into the other chart
        assert (np.abs(rgb.astype(int) - before) > 2).mean() < 0.02  # along the seam at most
        np.testing.assert_allclose(depth_m, 3.0, atol=0.25)

    def test_what_remains_is_a_subset_with_its_own_coordinates(self):
        part = textured(joined(sheet((2, -2), (0, 1), waves)), bands())
        offset = np.array([5e5, 4e6, 100.123456789])  # a scan in map coordinates
        part = MeshPart(part.name, part.vertices_m + offset, part.faces, part.uv, part.texture)
        rgb = np.random.default_rng(2).integers(0, 256, (len(part.vertices_m), 3)).astype(np.uint8)
        ball = MeshPart("ball", part.vertices_m + 9.0, part.faces, vertex_rgb=rgb)
        reduced = with_fewer_faces(TexturedMesh((part, ball), ("a finding",)), 600)
        assert reduced.findings == ("a finding",)
        assert reduced.n_faces == pytest.approx(600, rel=0.05)
        for out, full in zip(reduced.parts, (part, ball), strict=True):
            assert len(np.unique(out.faces)) == len(out.vertices_m)
            known = {tuple(p): i for i, p in enumerate(full.vertices_m.tolist())}
            index = [known[tuple(p)] for p in out.vertices_m.tolist()]
            if full.uv is not None:
                np.testing.assert_array_equal(out.uv, full.uv[index])
            else:
                np.testing.assert_array_equal(out.vertex_rgb, rgb[index])

    def test_a_part_of_which_nothing_is_left_is_left_out(self):
        wall = joined(sheet((2, -2), (0, 1)))
        speck = TexturedMesh((wall, MeshPart("speck", 1e-7 * wall.vertices_m, wall.faces)))
        reduced = with_fewer_faces(speck, 20)
        assert all(len(part.faces) for part in reduced.parts)
