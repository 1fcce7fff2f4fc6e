"""Procedural scenes: volumes of the paper, valid textured meshes, same bytes, room for a camera."""

from __future__ import annotations

import hashlib
from functools import cache

import numpy as np
import pytest

from synfeal.errors import InputError
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.scenes import BUILDERS, build_scene
from synfeal.scenes.atlas import pack
from synfeal.scenes.canvas import Canvas
from synfeal.scenes.lighting import first_hit
from synfeal.scenes.patches import Block, Patch, bilinear
from synfeal.scenes.primitives import bumpy, level, turned, upright

VOLUMES_M3 = {"large_room": 89.4, "sanctuary": 183.18}  # the paper's table 1
BOXES_M = {  # where cameras go
    "large_room": ((1.5, 3.5), (1.5, 5.0), (1.0, 2.0)),
    "sanctuary": ((-1.9, 1.9), (-3.4, 2.8), (1.0, 2.5)),
    "pretext_room": ((1.0, 4.0), (1.0, 4.0), (1.0, 2.0)),
}
every_scene = pytest.mark.parametrize("name", sorted(BUILDERS))


@cache
def scene(name: str) -> TexturedMesh:
    return build_scene(name, 0)


@cache
def caster(name: str) -> RayCaster:
    return RayCaster(*scene(name).merged())


def digest(mesh: TexturedMesh) -> str:
    value = hashlib.sha256()
    for part in mesh.parts:
        for array in (part.vertices_m, part.faces, part.uv, part.texture):
            assert array is not None
            value.update(np.ascontiguousarray(array).tobytes())
    return value.hexdigest()


def views(name: str, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Origins in the sampling box and directions over the whole sphere, (n, 3) each."""
    rng = np.random.default_rng(5)
    lower, upper = np.array(BOXES_M[name]).T
    directions = rng.normal(size=(n, 3))
    return rng.uniform(lower, upper, (n, 3)), directions / np.linalg.norm(
        directions, axis=1, keepdims=True
    )


def test_unknown_builder_is_an_input_error() -> None:
    with pytest.raises(InputError, match="large_room"):
        build_scene("cathedral", 0)


@pytest.mark.parametrize("name", sorted(VOLUMES_M3))
def test_volume_is_the_papers(name: str) -> None:
    volume = float(np.prod(np.diff(scene(name).bounds_m, axis=0)))
    assert volume == pytest.approx(VOLUMES_M3[name], rel=0.01)


def test_same_seed_same_bytes_and_another_seed_another_scene() -> None:
    again = build_scene("pretext_room", 0)
    assert digest(again) == digest(scene("pretext_room"))
    assert digest(build_scene("pretext_room", 1)) != digest(again)


@every_scene
def test_mesh_is_sound(name: str) -> None:
    mesh = scene(name)
    assert 20_000 <= mesh.n_faces <= 70_000
    assert len(mesh.parts) <= 8
    for part in mesh.parts:
        assert part.uv is not None
        assert part.texture is not None
        assert np.isfinite(part.vertices_m).all()
        assert part.faces.min() >= 0
        assert part.faces.max() < len(part.vertices_m) == len(part.uv)
        assert part.uv.min() >= 0
        assert part.uv.max() <= 1
        corner = part.vertices_m[part.faces]
        doubled = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        assert (np.linalg.norm(doubled, axis=1) > 0).all()


@every_scene
def test_textures_are_small_enough_and_not_flat(name: str) -> None:
    textures = [part.texture for part in scene(name).parts]
    texels = 0
    for texture in textures:
        assert texture is not None
        assert texture.dtype == np.uint8
        assert max(texture.shape[:2]) <= 2048
        texels += texture.shape[0] * texture.shape[1]
        assert texture.std() > 20
        assert (texture == 255).all(axis=-1).mean() < 0.1  # not burnt out
    assert texels <= 13e6


@every_scene
def test_room_is_closed_around_the_cameras(name: str) -> None:
    origins, directions = views(name, 20_000)
    distance = caster(name).first_hit_m(origins, directions)
    assert np.isfinite(distance).mean() > 0.9995


@every_scene
def test_centre_of_the_sampling_box_is_free(name: str) -> None:
    centre = np.mean(BOXES_M[name], axis=1)
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    distance = caster(name).first_hit_m(np.tile(centre, (6, 1)), directions)
    assert (distance > 0.3).all()
    ends = centre + distance[:, None] * directions
    lower, upper = scene(name).bounds_m
    assert ((ends > lower - 1e-6) & (ends < upper + 1e-6)).all()


@every_scene
def test_most_straight_paths_are_free(name: str) -> None:
    starts, _ = views(name, 2000)
    ends = starts[::-1]
    length = np.linalg.norm(ends - starts, axis=1)
    hit = caster(name).first_hit_m(starts, (ends - starts) / length[:, None])
    assert (hit > length).mean() > 0.6


@every_scene
def test_floor_is_closed(name: str) -> None:
    lower, upper = scene(name).bounds_m
    rng = np.random.default_rng(0)
    origins = rng.uniform(lower + 0.02, upper - 0.02, (4000, 3))
    if name == "pretext_room":  # one corner is cut off
        origins = origins[(origins[:, 0] < 3.85) | (origins[:, 1] < 3.65)]
    origins[:, 2] = 0.05
    down = np.tile([0.0, 0.0, -1.0], (len(origins), 1))
    assert np.isfinite(caster(name).first_hit_m(origins, down)).all()


@every_scene
def test_walls_differ_in_brightness_or_hue(name: str) -> None:
    """Even averaged over half a metre, the first part of a scene has very different places."""
    texture = scene(name).parts[0].texture
    assert texture is not None
    blocks = texture[: len(texture) // 64 * 64, : texture.shape[1] // 64 * 64].astype(float)
    means = blocks.reshape(len(blocks) // 64, 64, -1, 64, 3).mean(axis=(1, 3)).reshape(-1, 3)
    assert means.std(axis=0).max() > 12


def test_packing_never_overlaps() -> None:
    rng = np.random.default_rng(1)
    sizes = [(int(h), int(w)) for h, w in rng.integers(5, 240, (150, 2))]
    corners, (height, width) = pack(sizes)
    used = np.zeros((height, width), np.int64)
    for (row, column), (high, wide) in zip(corners, sizes, strict=True):
        assert row + high <= height
        assert column + wide <= width
        used[row : row + high, column : column + wide] += 1
    assert used.max() == 1
    assert used.sum() == sum(high * wide for high, wide in sizes)


def test_packing_refuses_what_does_not_fit() -> None:
    with pytest.raises(ValueError, match="atlas"):
        pack([(1500, 2000)] * 2)


def test_first_hit_against_closed_form() -> None:
    block = Block(np.array([2.0, 0.0, 0.0]), np.array([0.5, 0.5, 0.5]), np.pi / 4)
    origins = np.zeros((4, 3), np.float32)
    origins[3] = (2, 0, 0)
    segments = np.float32([(4, 0, 0), (-4, 0, 0), (0, 0, 4), (4, 0, 0)])
    # The box stands on its corner: it begins half a diagonal before its centre.
    expected = [(2 - np.sqrt(0.5)) / 4, 1, 1, 0]
    np.testing.assert_allclose(first_hit(origins, segments, [block]), expected, atol=1e-6)


def test_noise_has_zero_mean_unit_deviation_and_the_canvas_size() -> None:
    canvas = Canvas(np.random.default_rng(0), 300, 400, 100)
    noise = canvas.noise(0.1, 4)
    assert noise.shape == (300, 400)
    assert abs(noise.mean()) < 0.1
    assert noise.std() == pytest.approx(1, abs=0.25)


def test_bilinear_is_exact_for_bilinear_functions() -> None:
    rows, columns = np.mgrid[0:4, 0:5].astype(float)
    grid = np.stack([rows, columns, rows * columns], axis=-1)
    at_rows, at_columns = np.array([0.0, 1.25, 3.0]), np.array([0.5, 4.0])
    value = bilinear(grid, at_rows, at_columns)
    r, c = np.meshgrid(at_rows, at_columns, indexing="ij")
    np.testing.assert_allclose(value, np.stack([r, c, r * c], axis=-1), atol=1e-12)


def test_surfaces_face_where_they_say() -> None:
    picture = np.zeros((4, 4, 3), np.float32)
    for points, normal in (
        (upright((0, 0), (1, 0), 0, 1), (0, -1, 0)),
        (level((0, 2), (0, 1), 0), (0, 0, 1)),
        (level((0, 2), (0, 1), 0, face_down=True), (0, 0, -1)),
    ):
        _, normals = Patch(points, picture).sample(0.5)
        np.testing.assert_allclose(normals, np.broadcast_to(normal, normals.shape), atol=1e-12)


def test_bumps_leave_the_rim_in_place() -> None:
    flat = level((0, 2), (0, 1), 0, 0.1)
    rough = bumpy(np.random.default_rng(0), flat, 0.01)
    assert 0 < (rough - flat)[..., 2].max() <= 0.01
    assert (rough - flat)[..., 2].min() >= 0
    for edge in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
        np.testing.assert_array_equal(rough[edge], flat[edge])


def test_turned_cylinder_faces_outwards_and_has_its_area() -> None:
    item = turned(
        np.random.default_rng(0), [(0.5, 1.0), (0.5, 0.0)], lambda c: c.plain((1, 0, 0)), 50, 64
    )
    points, normals = item.patches[0].sample(0.1)
    radial = points[..., :2] / np.linalg.norm(points[..., :2], axis=-1, keepdims=True)
    assert (np.sum(radial * normals[..., :2], axis=-1) > 0.99).all()
    height_px, width_px = item.patches[0].picture.shape[:2]
    assert width_px / height_px == pytest.approx(np.pi, rel=0.02)
