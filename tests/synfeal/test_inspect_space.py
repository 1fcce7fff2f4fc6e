"""Free space, surface points, texel density and doubts, known or worked out by hand."""

import itertools
import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from synfeal.config.collect import PlaceConfig
from synfeal.errors import InputError
from synfeal.inspection import doubts as doubts_module
from synfeal.inspection import freespace
from synfeal.inspection.boxes import (
    UNWANTED_WEIGHT,
    largest_box,
    share_inside,
    suggest_box,
    suggest_boxes,
)
from synfeal.inspection.doubts import (
    Inspection,
    color_doubts,
    doubts_of,
    floor_areas_m2,
    load_as_meant,
)
from synfeal.inspection.facts import detail_of, texels_per_m
from synfeal.inspection.freespace import (
    FreeSpace,
    find_free_space,
    find_free_spaces,
    survey,
    viewpoint,
)
from synfeal.inspection.pieces import without_small_pieces
from synfeal.inspection.surface import SurfacePoints, nearest_texels
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, simplify

ROOM_M = (6.0, 4.0, 3.0)


def box_at(extents, centre):
    return trimesh.creation.box(extents).apply_translation(centre)


def space_of(meshes, box_m=None):
    mesh = trimesh.util.concatenate(meshes)
    surface, _ = trimesh.sample.sample_surface(mesh, 60_000, seed=0)
    bounds = np.asarray(mesh.bounds) if box_m is None else box_m
    caster = RayCaster(mesh.vertices, mesh.faces)
    return find_free_space(caster, survey(caster, np.asarray(surface), bounds))


def room():
    """6 x 4 x 3 m, floor at z = 0."""
    return box_at(ROOM_M, (0.0, 0.0, 1.5))


def test_a_closed_room_is_free_and_its_box_keeps_off_the_walls():
    space = space_of([room()])
    assert space.share > 0.97
    assert space.enclosure == 1.0
    assert space.floor_m == pytest.approx(0.0, abs=1e-4)
    box = suggest_box(space)
    assert box is not None
    low, high = np.array([-2.7, -1.7, 0.8]), np.array([2.7, 1.7, 2.0])
    assert (box[0] >= low - 0.06).all()  # heights are of points; the box reaches a little beyond
    assert (box[1] <= high + 0.06).all()
    np.testing.assert_allclose(box, [low, high], atol=0.2)


def test_a_room_without_a_ceiling_is_a_room_and_an_open_plain_is_none():
    mesh = room()
    mesh.update_faces(mesh.face_normals[:, 2] < 0.5)
    space = space_of([mesh], np.array([[-3.0, -2, 0], [3, 2, 2]]))
    assert space.share > 0.95
    plain = box_at((400.0, 400.0, 0.01), (0.0, 0.0, 0.0))
    space = space_of([plain], np.array([[-3.0, -3, 0.5], [3, 3, 2.5]]))
    assert space.share == 0.0
    assert suggest_box(space) is None
    assert viewpoint(space, None) is None


def test_cameras_go_neither_into_a_cupboard_nor_around_low_furniture():
    space = space_of([room(), box_at((1.5, 1.5, 2.9), (-2.0, 0.0, 1.45))])
    x, y, z = space.axes_m
    inside = np.ix_(np.abs(x + 2.0) < 0.7, np.abs(y) < 0.7, z < 2.8)
    assert not space.is_free[inside].any()
    assert not space.is_clear[inside].any()
    box = suggest_box(space)
    assert box is not None
    assert box[0, 0] >= -1.25 + 0.3 - 0.06  # in front of the cupboard
    position = viewpoint(space, box)
    assert position is not None
    assert ((position >= box[0]) & (position <= box[1])).all()
    space = space_of([room(), box_at((4.0, 1.0, 0.4), (0.0, 0.0, 0.2))])
    assert space.floor_m == pytest.approx(0.0, abs=1e-4)
    box = suggest_box(space)
    assert box is not None
    np.testing.assert_allclose(box[:, :2], [[-2.7, -1.7], [2.7, 1.7]], atol=0.2)


def two_rooms(door):
    """Rooms of 4 x 4 and 3 x 4 m behind each other, with a doorway of 1 m between or without."""
    walls = box_at((7.2, 4.0, 2.6), (0.0, 0.0, 1.3))
    if not door:
        return [walls, box_at((0.2, 4.0, 2.6), (0.5, 0.0, 1.3))]
    sides = [box_at((0.2, 1.5, 2.6), (0.5, sign * 1.25, 1.3)) for sign in (-1, 1)]
    return [walls, *sides]


def storeys():
    """Two floors of 6 x 4 m, the upper one at 2.8 m, and no stairs."""
    rooms = [box_at((6.0, 4.0, 2.6), (0.0, 0.0, 1.3 + z)) for z in (0.0, 2.8)]
    return [*rooms, box_at((2.0, 1.0, 0.7), (0.0, 0.0, 0.35))]


def spaces_of(meshes):
    mesh = trimesh.util.concatenate(meshes)
    surface, _ = trimesh.sample.sample_surface(mesh, 60_000, seed=0)
    caster = RayCaster(mesh.vertices, mesh.faces)
    return find_free_spaces(caster, survey(caster, np.asarray(surface), np.asarray(mesh.bounds)))


@pytest.mark.parametrize(
    ("meshes", "n_spaces", "inside"),
    [
        (two_rooms(door=True), 1, [(-2.0, 0.0, 1.4), (2.0, 0.0, 1.4)]),
        (two_rooms(door=False), 2, [(-2.0, 0.0, 1.4), (2.0, 0.0, 1.4)]),
        (storeys(), 2, [(-2.0, 0.0, 1.4), (-2.0, 0.0, 4.2)]),
    ],
    ids=["a doorway", "a closed door", "two storeys"],
)
def test_boxes_hold_every_room(meshes, n_spaces, inside):
    spaces = spaces_of(meshes)
    assert len(spaces) == n_spaces
    assert spaces[0].elsewhere < 0.05
    boxes, points = suggest_boxes(spaces)
    assert 2 <= len(boxes) <= 6
    for place in np.array(inside):
        assert ((place >= boxes[:, 0]) & (place <= boxes[:, 1])).all(axis=1).any()
    assert share_inside(points, boxes) > 0.85
    assert share_inside(points, boxes[:1]) < 0.7
    sizes = np.prod(np.ptp(boxes, axis=1), axis=1)
    assert sizes.argmax() == 0
    caster = RayCaster(*trimesh_of(meshes))
    for low, high in boxes:  # two thirds of a box or more are free
        drawn = np.random.default_rng(0).uniform(low, high, (2000, 3))
        assert (np.abs(caster.first_hit_m(drawn, np.eye(3)[[2] * 2000])) > 0.1).mean() > 2 / 3


def trimesh_of(meshes):
    whole = trimesh.util.concatenate(meshes)
    return whole.vertices, whole.faces


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("shape", [(5, 4, 3), (2, 9, 1), (1, 12, 1)])
def test_largest_box_against_trying_them_all(shape, seed):
    rng = np.random.default_rng(seed)
    wanted = rng.random(shape) < 0.75
    neutral = ~wanted & (rng.random(shape) < 0.3 * (seed % 2))
    worth = np.where(wanted, 1.0, np.where(neutral, 0.0, -UNWANTED_WEIGHT))

    def worth_of(lower, upper):
        slices = tuple(slice(a, b + 1) for a, b in zip(lower, upper, strict=True))
        return float(worth[slices].sum())

    limits = [list(itertools.combinations_with_replacement(range(n), 2)) for n in wanted.shape]
    best = max(
        worth_of((a, c, e), (b, d, f)) for (a, b), (c, d), (e, f) in itertools.product(*limits)
    )
    assert worth_of(*largest_box(wanted, neutral)) == best


UNIT_UV = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def square(side_m, texture=None, **values):
    """A horizontal square with the whole texture on it."""
    corners = np.column_stack([UNIT_UV * side_m, np.zeros(4)])
    uv = None if texture is None else UNIT_UV
    return MeshPart("square", corners, TWO, uv, texture, **values)


def texture_of(height, width, channels=3):
    return np.zeros((height, width, channels), np.uint8)


def closed_space(enclosure=1.0):
    mask = np.ones((2, 2, 2), np.bool_)
    axis = np.array([0.0, 1.0])
    return FreeSpace((axis, axis, axis), mask, mask, enclosure, 0.0)


def test_texels_and_colours_of_squares():
    assert texels_per_m([square(2.0, texture_of(64, 64))]) == pytest.approx([32.0] * 3)
    assert texels_per_m([square(2.0, texture_of(64, 16))]) == pytest.approx([16.0] * 3)
    rgb = np.zeros((4, 3), np.uint8)
    detail = detail_of(
        TexturedMesh((square(1.0, texture_of(8, 8)), square(2.0, vertex_rgb=rgb), square(3.0)))
    )
    assert detail["area_m2"] == pytest.approx(
        {"textured": 1.0, "colored_by_vertex": 4.0, "plain": 9.0}
    )
    assert detail["colored_vertices_per_m"] == pytest.approx(1.0)  # 4 vertices on 4 m²
    bare = detail_of(TexturedMesh((square(1.0),)))
    assert bare["texels_per_m"] is None
    assert bare["colored_vertices_per_m"] is None
    texture = np.arange(4, dtype=np.uint8).reshape(2, 2, 1)  # 0 1 above 2 3
    uv = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [1.75, -0.25], [0.0, 0.0], [1.0, 1.0]])
    assert nearest_texels(texture, uv)[:, 0].tolist() == [2, 3, 0, 1, 2, 2]


def test_points_are_spread_by_area_and_carry_the_texture():
    texture = texture_of(2, 2, 4)
    texture[:, 0] = [255, 0, 0, 255]
    texture[:, 1] = [0, 0, 255, 100]
    part = square(2.0, texture, alpha_cutoff=0.5)
    points = SurfacePoints.of(TexturedMesh((part,)), np.random.default_rng(0), 20_000)
    assert len(points.position_m) == pytest.approx(20_000, rel=0.02)
    np.testing.assert_allclose(points.position_m.mean(axis=0), [1.0, 1.0, 0.0], atol=0.03)
    np.testing.assert_allclose(points.position_m[:, :2].var(axis=0), [1 / 3, 1 / 3], atol=0.01)
    assert (points.normal == [0, 0, 1]).all()
    left = points.position_m[:, 0] < 1.0
    assert (points.rgb[left] == [255, 0, 0]).all()
    assert (points.rgb[~left] == [0, 0, 255]).all()
    assert (points.is_drawn == left).all()


def test_a_texture_that_is_clamped_does_not_begin_again_beyond_its_edge():
    texture = texture_of(2, 2, 3)
    texture[:, 0], texture[:, 1] = [255, 0, 0], [0, 0, 255]
    part = square(2.0, texture)
    beyond = replace(part, uv=part.uv + np.array([1.0, 0.0]), clamped_uv=(True, False))
    points = SurfacePoints.of(TexturedMesh((beyond,)), np.random.default_rng(0), 100)
    assert (points.rgb == [0, 0, 255]).all()


def doubts(extents, **values):
    floors = np.array([1.0, 1.0, 10.0])
    given = {"floors_m2": floors, "space": closed_space(), **values}
    return "\n".join(doubts_of(np.array(extents), **given))


@pytest.mark.parametrize(
    ("extents", "unit_m", "words"),
    [
        ((5.0, 6.0, 3.0), 1.0, []),
        ((5000.0, 6000.0, 3000.0), 1.0, ["6e+03 m", "try `unit_m` 0.001, 0.01 or 0.0254"]),
        ((500.0, 600.0, 300.0), 0.1, ["600 m", "try `unit_m` 0.001, 0.01 or 0.0254"]),
        ((0.5, 0.4, 0.3), 1.0, ["0.5 m", "try `unit_m` 10 or 100"]),
        ((0.5, 0.4, 0.3), 0.001, ["0.5 m", "try `unit_m` 0.01 or 0.0254"]),
        ((6e7, 5e7, 4e7), 1.0, ["6e+07 m", "remove what lies far away"]),
        ((6e4, 5e4, 4e4), 0.001, ["6e+04 m", "remove what lies far away"]),
        ((2e-4, 1e-4, 1e-4), 1.0, ["0.0002 m", "give `unit_m`"]),
        ((400.0, 400.0, 12.0), 1.0, ["400 m", "terrain or a town"]),
    ],
)
def test_sizes_that_are_not_metres_are_doubted(extents, unit_m, words):
    """No unit is named in which the mesh would be doubted again, or in which it was taken."""
    found = doubts(extents, unit_m=unit_m)
    assert bool(found) == bool(words)
    assert all(word in found for word in words)
    for named in re.findall(r"[0-9.]+", found.partition("unit_m")[2]):
        assert not doubts(np.array(extents) * float(named) / unit_m, unit_m=float(named))


@pytest.mark.parametrize(("side", "taken"), [(6000.0, 0.001), (6e7, 1.0), (4.0, 1.0), (0.004, 1e3)])
def test_a_unit_is_assumed_only_where_it_makes_a_room(tmp_path, side, taken):
    """No unit makes a room of 60,000 km: then nothing is assumed, and no advice contradicts it."""
    trimesh.creation.box((side, side, 0.6 * side)).export(tmp_path / "box.ply")
    scene = PlaceConfig(mesh=tmp_path / "box.ply").scene
    scene, mesh, notes = load_as_meant(scene, unit_is_given=False)
    assert scene.unit_m == taken
    assert bool(notes) == (taken != 1.0)
    found = doubts(np.ptp(mesh.bounds_m, axis=0), unit_m=scene.unit_m)
    assert "unit_m" not in found
    assert bool(found) == (side == 6e7)


def flecks(low, high, count=900):
    """Triangles of some centimetres, which a laser scanner makes of dust, glass and mirrors."""
    rng = np.random.default_rng(2)
    corners = rng.uniform(low, high, (count, 1, 3)) + rng.normal(0.0, 0.04, (count, 3, 3))
    return trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def test_a_room_is_found_among_what_a_scanner_made_of_dust_and_windows(tmp_path, monkeypatch):
    """Neither does dust count as in the way, nor does what lies far outside change the unit."""

    def suggest_unplanned(mesh, caster, searched, found, scene, plain):
        spaces = find_free_spaces(searched, found)
        boxes_m, _ = suggest_boxes(spaces)
        return spaces[0], SimpleNamespace(boxes_m=boxes_m) if len(boxes_m) else None

    monkeypatch.setattr(doubts_module, "suggest", suggest_unplanned)
    monkeypatch.setattr(freespace, "N_POINTS", 4000)
    stray = [flecks((-2.9, -1.9, 0.1), (2.9, 1.9, 2.9)), flecks((3, -150, 0), (150, 150, 60))]
    open_room = room()
    open_room.update_faces(open_room.face_normals[:, 2] < 0.5)
    whole = trimesh.util.concatenate([open_room, *stray])
    whole.export(tmp_path / "scan.ply")
    found = Inspection.of(PlaceConfig(mesh=tmp_path / "scan.ply", up_axis="z").scene, False)
    assert found.scene.unit_m == 1.0
    assert found.left_out == pytest.approx(1.0 - len(open_room.faces) / len(whole.faces))
    assert len(found.suggested_m)
    low, size = np.array([-3.0, -2.0, 0.0]), np.array(ROOM_M)
    assert ((found.suggested_m >= low) & (found.suggested_m <= low + size)).all()
    assert np.ptp(found.suggested_m[0, :, :2], axis=0) == pytest.approx(size[:2] - 0.6, abs=0.6)


def test_pieces_are_small_against_the_largest_only():
    small = flecks((-2.0, -1.0, 0.0), (2.0, 1.0, 2.0), count=40)
    alone = TexturedMesh((MeshPart("dust", small.vertices, small.faces),))
    assert without_small_pieces(alone) is alone
    box = room()
    both = TexturedMesh(
        (MeshPart("room", np.array(box.vertices), np.array(box.faces)), *alone.parts)
    )
    assert [part.name for part in without_small_pieces(both).parts] == ["room"]


def test_terrain_is_no_room_in_inches(tmp_path):
    trimesh.creation.box((400.0, 400.0, 12.0)).export(tmp_path / "box.ply")
    scene, _, notes = load_as_meant(PlaceConfig(mesh=tmp_path / "box.ply").scene, False)
    assert scene.unit_m == 1.0
    assert notes == []


def test_plain_and_open_meshes_are_doubted_and_a_flat_floor_is_a_floor():
    plain = {"textured": 1.0, "colored_by_vertex": 0.0, "plain": 3.0}
    two = (square(1.0, vertex_rgb=np.eye(4, 3, dtype=np.uint8) * 255), square(2.0))
    assert "75%" in color_doubts(TexturedMesh(two), plain)[0]
    assert "of one colour" in color_doubts(TexturedMesh(two[1:]), plain)[0]
    assert not color_doubts(TexturedMesh(two), {**plain, "plain": 0.5})
    assert "25%" in doubts((5.0, 5.0, 3.0), space=closed_space(0.75))
    points = np.column_stack([np.random.default_rng(0).random((100, 2)), np.zeros(100)])
    normals = np.tile([0.0, 0.0, -1.0], (100, 1))
    assert floor_areas_m2(normals, points, 7.0).tolist() == [0.0, 0.0, pytest.approx(7.0)]


@pytest.mark.parametrize(
    ("turn", "words"), [((0, 1, 2), ""), ((0, 2, 1), "`up_axis`"), ((2, 1, 0), "turn the mesh")]
)
def test_the_largest_floor_tells_the_up_axis(turn, words):
    room = trimesh.creation.box((8.0, 6.0, 3.0))  # its floor has 48 m², its walls 18 and 24
    points, faces = trimesh.sample.sample_surface(room, 20_000, seed=0)
    points, normals = np.asarray(points)[:, turn], np.asarray(room.face_normals)[faces][:, turn]
    floors = floor_areas_m2(normals, points, room.area)
    np.testing.assert_allclose(floors, np.array([18.0, 24.0, 48.0])[list(turn)], rtol=0.05)
    found = doubts((8.0, 6.0, 3.0), floors_m2=floors)
    assert found.isascii()
    assert words in found
    assert bool(found) == bool(words)


def test_open3d_is_an_extra(monkeypatch):
    """Who installs the simulator alone may lack it."""
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(InputError, match=r"pip install 'synfeal\[inspect\]'"):
        simplify(Triangles(np.eye(3), np.array([[0, 1, 2]])), 1)
