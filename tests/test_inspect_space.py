"""Free space and the suggested box, in rooms whose free space is known."""

import itertools

import numpy as np
import pytest
import trimesh

from synfeal.inspect.freespace import find_free_space, survey, viewpoint
from synfeal.inspect.suggest import UNWANTED_WEIGHT, largest_box, suggest_box
from synfeal.mesh.rays import RayCaster

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


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("shape", [(5, 4, 3), (2, 9, 1), (1, 12, 1)])
def test_largest_box_against_trying_them_all(shape, seed):
    wanted = np.random.default_rng(seed).random(shape) < 0.75
    worth = np.where(wanted, 1.0, -UNWANTED_WEIGHT)

    def worth_of(lower, upper):
        slices = tuple(slice(a, b + 1) for a, b in zip(lower, upper, strict=True))
        return float(worth[slices].sum())

    limits = [list(itertools.combinations_with_replacement(range(n), 2)) for n in wanted.shape]
    best = max(
        worth_of((a, c, e), (b, d, f)) for (a, b), (c, d), (e, f) in itertools.product(*limits)
    )
    assert worth_of(*largest_box(wanted)) == best
