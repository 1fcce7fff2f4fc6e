"""Distances from surfaces against trimesh and closed forms, and plans that keep them."""

import numpy as np
import pytest
import trimesh

from synfeal.config.collection import CollectionConfig
from synfeal.errors import InputError
from synfeal.mesh.clearance import Clearance, cut_to_size, point_triangle_distances
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import plan_mesh, plan_split
from tests.support.empty_room import ROOM, SCENE, mesh_of

pytestmark = pytest.mark.portable

COLLECTION = CollectionConfig(max_tries=300, frame_spacing_m=0.1, min_path_m=1.0)


def furnished():
    """A room of 6 x 4 x 2.5 m with a pillar and a thin wall in it."""
    pillar, wall = [[-0.5, -0.5, 0.0], [0.5, 0.5, 1.8]], [[1.0, -2.0, 0.0], [1.2, 1.0, 2.5]]
    return mesh_of(ROOM, pillar, wall)


def nearest_m(points, mesh):
    """Distance of each point to the nearest of all triangles, by trimesh."""
    found = np.full(len(points), np.inf)
    for triangle in mesh.vertices_m[mesh.faces]:
        closest = trimesh.triangles.closest_point(np.tile(triangle, (len(points), 1, 1)), points)
        found = np.minimum(found, np.linalg.norm(closest - points, axis=1))
    return found


def test_distances_of_points_over_every_part_of_a_triangle():
    """In closed form: over the inside, the three edges and the three corners."""
    triangle = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    points = np.array(
        [
            [1, 1, 2],
            [2, -1, 0],
            [-2, 1, 0],
            [2.0 + 3, 1.5 + 4, 0],
            [-3, -4, 0],
            [7, 0, 4],
            [0, 5, 0],
        ]
    )
    expected = [2, 1, 2, 5, 5, 5, 2]
    found = point_triangle_distances(points.astype(float), np.tile(triangle, (7, 1, 1)))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_distances_are_those_of_trimesh_also_for_slivers():
    rng = np.random.default_rng(0)
    triangles, points = rng.normal(size=(5000, 3, 3)), rng.normal(size=(5000, 3))
    triangles[::5, 2] = triangles[::5, 0] + 1e-4 * rng.normal(size=(1000, 3))
    closest = trimesh.triangles.closest_point(triangles, points)
    expected = np.linalg.norm(closest - points, axis=1)
    np.testing.assert_allclose(point_triangle_distances(points, triangles), expected, atol=1e-9)


def test_a_triangle_without_area_is_a_line_or_a_point():
    line = np.array([[0.0, 0, 0], [2, 0, 0], [1, 0, 0]])
    point = np.ones((3, 3))
    found = point_triangle_distances(np.array([[1.0, 3, 0], [1, 1, 6]]), np.stack([line, point]))
    np.testing.assert_allclose(found, [3, 5])


def test_pieces_cover_their_triangles_and_are_small():
    triangles = np.random.default_rng(1).normal(size=(20, 3, 3))
    pieces = cut_to_size(triangles, 0.4)
    edges = np.roll(pieces, -1, axis=1) - pieces
    assert np.linalg.norm(edges, axis=-1).max() <= 0.4

    def area(t):
        return np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() / 2

    assert area(pieces) == pytest.approx(area(triangles))
    assert len(cut_to_size(triangles[:0], 0.4)) == 0


@pytest.mark.parametrize("clearance_m", [0.02, 0.15, 1.0])
@pytest.mark.parametrize("away_m", [0.0, 1e6])
def test_points_keep_the_clearance_that_trimesh_measures(clearance_m, away_m):
    mesh = furnished()
    points = np.random.default_rng(2).uniform(*ROOM, (4000, 3))
    expected_m = nearest_m(points, mesh)
    keeps = Clearance(mesh.vertices_m + away_m, mesh.faces, clearance_m).keeps(points + away_m)
    sure = np.abs(expected_m - clearance_m) > 1e-8
    np.testing.assert_array_equal(keeps[sure], expected_m[sure] >= clearance_m)
    assert 0 < keeps.mean() < 1


def test_no_camera_of_a_plan_is_nearer_to_a_surface_than_asked():
    mesh = furnished()
    least_m = {}
    for asked_m in (0.0, 0.3):
        scene = SCENE.model_copy(update={"min_clearance_m": asked_m})
        table = plan_mesh(mesh, "room", scene, COLLECTION, 600, np.random.default_rng(1), "train")
        least_m[asked_m] = nearest_m(table.position_m, mesh).min()
        steps_m = np.linalg.norm(np.diff(table.position_m, axis=0), axis=1)
        assert steps_m.max() < 0.1 * 1.05  # paths stay connected
    assert least_m[0.0] < 0.1
    assert least_m[0.3] >= 0.3


def test_independent_poses_keep_it_too():
    mesh = furnished()
    scene = SCENE.model_copy(update={"min_clearance_m": 0.3})
    collection = COLLECTION.model_copy(update={"mode": "random"})
    table = plan_mesh(mesh, "room", scene, collection, 200, np.random.default_rng(1), "train")
    assert nearest_m(table.position_m, mesh).min() >= 0.3


def test_without_a_clearance_plans_stay_as_they_were():
    mesh = furnished()
    planned = plan_mesh(mesh, "room", SCENE, COLLECTION, 300, np.random.default_rng(3), "train")
    bare = plan_split(RayCaster(*mesh), ROOM, SCENE, COLLECTION, 300, np.random.default_rng(3))
    np.testing.assert_array_equal(planned.position_m, bare.position_m)


def test_a_clearance_no_camera_can_keep_is_named():
    scene = SCENE.model_copy(update={"min_clearance_m": 5.0})
    with pytest.raises(InputError, match=r"keeps `min_clearance_m` \(5\.0 m\) from surfaces"):
        plan_mesh(furnished(), "room", scene, COLLECTION, 9, np.random.default_rng(0), "train")


def test_a_dead_end_names_the_clearance_among_what_may_be_lowered():
    scene = SCENE.model_copy(update={"min_clearance_m": 0.2})
    collection = COLLECTION.model_copy(update={"max_tries": 3, "min_path_m": 50.0})
    with pytest.raises(InputError, match=r"or `min_clearance_m` \(0\.2 m\)"):
        plan_mesh(furnished(), "room", scene, collection, 1, np.random.default_rng(0), "train")
