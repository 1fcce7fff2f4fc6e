"""Scans of procedural scenes: grids, light, rounding, warping, holes, textures."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh

from reproduction.rooms.bake import ATLAS_PX, GUTTER_PX, laid_out, pack, scanned_mesh
from reproduction.rooms.lighting import Lamp, Lighting, Sun, baked
from reproduction.rooms.scan import (
    Scanner,
    jittered,
    refined,
    rounded,
    seen_faces,
    stations,
    surface_of,
)
from synfeal.mesh.triangles import weld
from synfeal.objects.patches import Item, Maker, Patch, level, upright

GREY = np.full((8, 8, 3), 128, np.uint8)
DARK = np.zeros((2, 2, 2, 3), np.float32)
LOWER, UPPER = (0.0, 0.0, 0.0), (4.0, 4.0, 3.0)


def rng():
    return np.random.default_rng(0)


def grey_box(size_m):
    return Maker(rng()).box(size_m, lambda c: c.plain((0.5, 0.5, 0.5)), 20)


def room():
    """A closed room of 4 × 4 × 3 m seen from inside."""
    corners = ((4, 0), (0, 0), (0, 4), (4, 4), (4, 0))
    walls = [upright(a, b, 0, 3) for a, b in pairwise(corners)]
    ends = [level((0, 4), (0, 4), 0), level((0, 4), (0, 4), 3, face_down=True)]
    return [Patch(points, GREY) for points in (*walls, *ends)]


def welded_box(size_m, cell_m):
    surface = surface_of(rng(), grey_box(size_m).patches, cell_m)
    return weld(surface.points_m)[0], surface


@pytest.mark.parametrize("shape", ["turned", "tube"])
def test_round_things_face_outwards(shape):
    if shape == "turned":
        profile = [(0.5, 1.0), (0.5, 0.0)]
        (patch,) = Maker(rng()).turned(profile, lambda c: c.plain((1, 0, 0)), 50, 64).patches
    else:
        path = [(0, 0, z) for z in (0, 0.5, 1)]
        (patch,) = Maker(rng()).tube(path, 0.5, lambda c: c.plain((1, 0, 0)), 50, 64).patches
    grid = refined(patch, 0.1)
    radial = grid.points_m[..., :2] / np.linalg.norm(grid.points_m[..., :2], axis=-1, keepdims=True)
    assert (np.sum(radial * grid.normals[..., :2], axis=-1) > 0.99).all()
    assert max(patch.picture.shape) / min(patch.picture.shape[:2]) == pytest.approx(np.pi, rel=0.02)


def test_grid_has_the_area_of_its_patch_and_faces_its_front():
    surface = surface_of(rng(), room(), 0.13)
    assert trimesh.triangles.area(surface.points_m[surface.faces]).sum() == pytest.approx(
        2 * 16 + 4 * 12
    )
    corner = surface.points_m[surface.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    towards_middle = np.array([2, 2, 1.5]) - corner.mean(axis=1)
    assert (np.sum(normals * towards_middle, axis=1) > 0).all()


def test_neighbouring_patches_divide_their_common_rim_alike():
    points, surface = welded_box((0.62, 0.4, 1.1), 0.047)
    faces = weld(surface.points_m)[1][surface.faces]
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, count = np.unique(sides, axis=0, return_counts=True)
    assert (count == 2).all()  # watertight
    assert len(points) - len(count) + len(faces) == 2  # Euler


def test_jitter_leaves_rims_and_pictures_in_place():
    points = level((0, 3), (0, 2), 1)
    grid = refined(Patch(points, GREY), 0.1)
    moved, shares = jittered(rng(), grid, grid.points_m)
    # Where a vertex lies on the picture still tells where it lies in the room.
    expected = np.stack([3 * shares[:, 1], 2 - 2 * shares[:, 0], np.ones(len(shares))], axis=1)
    np.testing.assert_allclose(moved, expected, atol=1e-12)
    change = np.linalg.norm(moved.reshape(grid.points_m.shape) - grid.points_m, axis=-1)
    assert change[1:-1, 1:-1].max() > 0.02
    for edge in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
        np.testing.assert_array_equal(change[edge], 0)


def test_rounding_keeps_planes_and_takes_off_edges():
    points, surface = welded_box((1.0, 1.0, 1.0), 0.1)
    index = weld(surface.points_m)[1]
    smooth = rounded(points, index[surface.edges], index[surface.faces])
    change = np.linalg.norm(smooth - points, axis=1)
    sides = (np.abs(np.abs(points - (0, 0, 0.5)) - 0.5) < 1e-9).sum(axis=1)
    np.testing.assert_allclose(change[sides == 1], 0, atol=1e-12)
    assert change[sides == 2].min() > 0.01
    assert change[sides == 3].min() > change[sides == 2].max()
    assert np.abs(smooth - (0, 0, 0.5)).max() <= 0.5 + 1e-12


def test_a_box_in_a_room_hides_what_is_below_and_behind_it():
    wardrobe = grey_box((1.0, 0.5, 1.0)).placed(2.0, 3.75)
    surface = surface_of(rng(), [*room(), *wardrobe.patches], 0.1)
    seen = seen_faces(surface.points_m, surface.faces, np.array([[2.0, 1.0, 1.5]]))
    middle = surface.points_m[surface.faces].mean(axis=1)
    under = (np.abs(middle[:, 0] - 2) < 0.35) & (middle[:, 1] > 3.65) & (middle[:, 2] < 0.01)
    behind = (np.abs(middle[:, 0] - 2) < 0.35) & (middle[:, 1] > 3.99) & (middle[:, 2] < 0.6)
    assert not seen[under].any()
    assert not seen[behind].any()
    assert seen[middle[:, 1] < 3.0].all()
    front = (np.abs(middle[:, 1] - 3.5) < 0.01) & (np.abs(middle[:, 0] - 2) < 0.45)
    assert seen[front].all()


def light_on(patches, lighting, albedo=0.0):
    """Linear light (V, 3) on a surface, up to the exposure."""
    surface = surface_of(rng(), patches, 0.1)
    count = len(surface.points_m)
    reflects = np.full((count, 3), albedo, np.float32)
    factor = baked(surface, reflects, np.zeros(count, np.float32), lighting)
    return surface, factor.astype(np.float64) ** 2.2


def test_lamp_light_falls_off_as_it_should_and_a_table_shades_it():
    lamp = Lamp((0.0, 0.0, 2.0), (0, 0, -1), (1, 1, 1))
    floor = [Patch(level((-2, 2), (-2, 2), 0), GREY)]
    surface, light = light_on(floor, Lighting((-2, -2, 0), (2, 2, 3), DARK, [lamp], None))
    distance2 = (surface.inner_m[:, :2] ** 2).sum(axis=1) + 1.985**2  # measured 15 mm up
    expected = 1.985**2 / distance2 / (distance2 + 0.15)
    np.testing.assert_allclose(
        light[:, 0] / np.median(light), expected / np.median(expected), rtol=1e-4
    )
    lamp = Lamp((2.0, 2.0, 2.8), (0, 0, -1), (1, 1, 1))
    top = grey_box((1.0, 1.0, 0.05)).placed(2.0, 2.0, 1.4)
    surface, light = light_on([*room(), *top.patches], Lighting(LOWER, UPPER, DARK, [lamp], None))
    on_floor = surface.points_m[:, 2] < 1e-9
    off = np.abs(surface.points_m[:, :2] - 2).max(axis=1)
    # The shadow of a half side of 0.5 m at half the height is twice as wide.
    assert (light[on_floor & (off < 0.9)] == 0).all()
    assert (light[on_floor & (off > 1.15) & (off < 1.9)] > 0).all()


def test_sun_falls_through_its_opening_only():
    opening = (((0.0, 1.0, 1.0), (0.0, 2.0, 2.0)),)
    sun = Sun((1.0, 0.0, -1.0), (1, 1, 1), opening)
    ambient = np.full_like(DARK, 1e-3)
    surface, light = light_on(room(), Lighting(LOWER, UPPER, ambient, [], sun))
    x, y, z = surface.inner_m.T
    bright = light[:, 0] > 0.5 * light.max()
    # At 45 degrees a window from 1 to 2 m shines on the floor 1 to 2 m away from it.
    patch = (z < 1e-9) & (x > 1.05) & (x < 1.95) & (y > 1.05) & (y < 1.95)
    assert bright[patch].all()
    outside = (x < 0.9) | (x > 2.1) | (y < 0.9) | (y > 2.1)
    assert not bright[outside].any()


def test_a_red_wall_tints_its_neighbours():
    patches = room()
    surface = surface_of(rng(), patches, 0.2)
    albedo = np.full((len(surface.points_m), 3), 0.5, np.float32)
    red = surface.points_m[:, 0] < 1e-9  # the wall at x = 0, with its rims
    albedo[red] = (0.8, 0.05, 0.05)
    lamp = Lamp((2.0, 2.0, 2.9), (0, 0, -1), (1, 1, 1))
    lighting = Lighting(LOWER, UPPER, DARK, [lamp], None)
    light = baked(surface, albedo, np.zeros(len(albedo), np.float32), lighting)
    floor = surface.points_m[:, 2] < 1e-9
    redness = light[:, 0] / light[:, 1]
    near, far = (surface.points_m[:, 0] < 0.5), (surface.points_m[:, 0] > 3.5)
    assert redness[floor & near & ~red].mean() > redness[floor & far].mean() + 0.03 > 1.03


def test_packing_never_overlaps_and_pictures_keep_a_rim():
    sizes = [(int(h), int(w)) for h, w in rng().integers(5, 900, (150, 2))]
    places, atlases = pack(sizes)
    assert len(atlases) > 1
    used = [np.zeros(size, np.int64) for size in atlases]
    for (atlas, row, column), (high, wide) in zip(places, sizes, strict=True):
        assert row + high <= atlases[atlas][0] <= ATLAS_PX
        assert column + wide <= atlases[atlas][1] <= ATLAS_PX
        used[atlas][row : row + high, column : column + wide] += 1
    assert max(grid.max() for grid in used) == 1
    assert sum(grid.sum() for grid in used) == sum(high * wide for high, wide in sizes)
    pictures = [np.full((20, 30, 3), value, np.uint8) for value in (10, 200)]
    places, (texture,) = laid_out(pictures)
    for (_, row, column), picture in zip(places, pictures, strict=True):
        around = texture[
            row - GUTTER_PX : row + 20 + GUTTER_PX, column - GUTTER_PX : column + 30 + GUTTER_PX
        ]
        assert (around == picture[0, 0, 0]).all()


def test_scan_shows_every_picture_where_it_belongs():
    """A ramp painted on the floor is found again through the texture coordinates."""
    ramp = np.repeat(np.linspace(0, 255, 400)[None, :, None], 300, axis=0).repeat(3, axis=2)
    floor = Patch(level((0, 4), (0, 4), 0), ramp.astype(np.uint8), glow=1.0)
    walls = room()
    del walls[4]
    scanner = Scanner(0.1, stations(LOWER, UPPER, (2, 2, 2)), LOWER, UPPER)
    lighting = Lighting(LOWER, UPPER, DARK + 1, [], None)
    mesh = scanned_mesh(rng(), Item((floor, *walls)), lighting, scanner)
    np.testing.assert_allclose(mesh.bounds_m, [LOWER, UPPER], atol=0.003)  # nearly: jitter
    (part,) = mesh.parts
    assert part.texture is not None
    assert part.uv is not None
    height, width = part.texture.shape[:2]
    x, y, z = part.vertices_m.T
    inside = (z < 0.05) & (np.abs(x - 2) < 1.8) & (np.abs(y - 2) < 1.8)
    row = ((1 - part.uv[inside, 1]) * height).astype(int)
    column = (part.uv[inside, 0] * width).astype(int)
    found = part.texture[row, column, 0] / 255 * 4
    off = np.abs(found - x[inside])
    assert np.median(off) < 0.01  # the scan is bent by millimetres
    assert off.max() < 0.06
