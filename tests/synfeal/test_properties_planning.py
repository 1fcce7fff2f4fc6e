"""Properties of planning in a room whose free space is known in closed form."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.errors import InputError
from synfeal.mesh.triangles import load_collision_mesh, save_collision_mesh
from synfeal.planning.coverage import plan_coverage, scene_coverage
from synfeal.planning.plan import plan_mesh, plan_split, sampling_box_of, sampling_boxes_of
from synfeal.planning.space import (
    PoseSpace,
    Questions,
    admissible,
    connected_space,
    draw_questions,
    has_free_view,
    largest_group,
    sample_start,
    seeing_groups,
)
from tests.support.empty_room import (
    BOUNDS,
    EMPTY,
    ROOM,
    SCENE,
    SQUARE,
    caster_of,
    divided,
    inside_poses,
    mesh_of,
    wall_distance_m,
    walls,
)
from tests.support.property_support import few, fewer, seeds, vectors

pytestmark = pytest.mark.portable

distances = st.floats(0.0, 4.0)


def free_by_closed_form(vectors_, least_m):
    """Whether poses in the empty room look farther, and which of them are too near to tell."""
    rotation = Rotation.from_euler("ZYX", vectors_[:, :2:-1])
    distance = wall_distance_m(vectors_[:, :3], rotation.apply([1.0, 0.0, 0.0]))
    return distance > least_m, np.abs(distance - least_m) < 1e-4


@few
@given(seeds, distances)
def test_in_an_empty_room_a_candidate_needs_a_free_view_and_no_more(seed, least_m):
    candidates = inside_poses(seed, 40)
    expected, near = free_by_closed_form(candidates, least_m)
    found = has_free_view(EMPTY, candidates, least_m)
    np.testing.assert_array_equal(found[~near], expected[~near])
    into_the_void = np.array([[9.0, 0, 1, 0, 0, 0]])
    assert not has_free_view(EMPTY, into_the_void, least_m).any()
    starts = inside_poses(seed + 1, 40)
    for start in (starts[0], starts):
        np.testing.assert_array_equal(admissible(EMPTY, start, candidates, least_m), found)
    questions = Questions(starts, candidates, least_m)
    np.testing.assert_array_equal(questions.answers(EMPTY), found)


@few
@given(seeds, walls)
def test_no_candidate_behind_a_wall_is_admissible(seed, wall):
    candidates, start = inside_poses(seed, 60), np.array([-2.0, 0, 1, 0, 0, 0])
    found = admissible(divided(wall), start, candidates, 0.0)
    assert not found[candidates[:, 0] > wall].any()
    assert found[candidates[:, 0] < wall - 1e-3].all()


@fewer
@given(seeds, walls, st.floats(0.0, 1.0))
def test_of_a_divided_room_the_larger_part_is_the_space(seed, wall, view_m):
    caster = divided(wall)

    def sampled():
        return PoseSpace(caster, BOUNDS, view_m, np.random.default_rng(seed))

    group = largest_group(sampled(), 100, 200)
    assert (group[:, 0] < wall).all()
    assert has_free_view(caster, group, view_m).all()
    start = sample_start(sampled(), 100)
    assert ((start >= BOUNDS[0]) & (start <= BOUNDS[1])).all()
    assert has_free_view(caster, start[None], view_m).all()
    space = connected_space(sampled(), 100)
    points = inside_poses(seed, 50)[:, :3]
    points = points[np.abs(points[:, 0] - wall) > 0.2]
    groups = seeing_groups(caster, points)
    np.testing.assert_array_equal(
        groups[:, None] == groups, (points[:, 0] < wall)[:, None] == (points[:, 0] < wall)
    )
    np.testing.assert_array_equal(space.contains(points), points[:, 0] < wall)


@fewer
@given(seeds, walls)
def test_questions_start_where_a_camera_can_get_to(seed, wall):
    caster = divided(wall)
    scene = SCENE.model_copy(update={"min_view_distance_m": 0.5})
    found = draw_questions(caster, scene, ROOM, np.random.default_rng(seed), 50)
    assert len(found.starts) == len(found.candidates) == 50
    assert found.min_view_distance_m == 0.5
    side = found.starts[:, 0] < wall  # walks never pass the wall, wherever they began
    assert side.all() or not side.any()
    assert has_free_view(caster, found.starts, 0.5).all()
    assert ((found.candidates >= BOUNDS[0]) & (found.candidates <= BOUNDS[1])).all()


@fewer
@given(seeds, st.integers(1, 200), st.floats(0.05, 0.5), st.sampled_from(["rpy", "slerp"]))
def test_a_plan_is_a_free_path_and_a_prefix_of_longer_ones(seed, count, spacing_m, how):
    collection = CollectionConfig(frame_spacing_m=spacing_m, interpolation=how)

    def planned(n):
        return plan_split(EMPTY, ROOM, SCENE, collection, n, np.random.default_rng(seed))

    found = planned(count)
    np.testing.assert_array_equal(found.frame, np.arange(count))
    assert set(np.diff(found.path)) <= {0, 1}
    assert ((found.position_m >= ROOM[0]) & (found.position_m <= ROOM[1])).all()
    steps = np.linalg.norm(np.diff(found.position_m, axis=0), axis=1)
    # A path of at least 1.5 m is cut into a whole number of steps: n - 1/2 of n spacings at least.
    assert (np.abs(steps - spacing_m) <= 0.25 * spacing_m).all()
    longer = planned(count + 37)
    np.testing.assert_array_equal(longer.position_m[:count], found.position_m)
    np.testing.assert_array_equal(longer.quat_wxyz[:count], found.quat_wxyz)
    np.testing.assert_array_equal(longer.path[:count], found.path)


@settings(few, max_examples=1)
@given(seed=seeds)
def test_a_scene_is_planned_and_measured_from_its_collision_mesh(seed, tmp_path_factory):
    mesh, path = mesh_of(ROOM), tmp_path_factory.mktemp("scene") / "collision.ply"
    save_collision_mesh(path, mesh)
    collection = CollectionConfig(frame_spacing_m=0.2)
    asked = ("room", SCENE, collection, 20)
    plan, direct = (
        plan_mesh(given, *asked, np.random.default_rng(seed), "train")
        for given in (load_collision_mesh(path), mesh)
    )
    same = plan_split(EMPTY, ROOM, SCENE, collection, 20, np.random.default_rng(seed))
    np.testing.assert_allclose(plan.position_m, same.position_m, atol=1e-9)
    np.testing.assert_array_equal(plan.position_m, direct.position_m)
    found = scene_coverage(path, SCENE, plan, SQUARE)
    assert found == plan_coverage(mesh, ROOM, SCENE, plan, SQUARE)


@few
@given(vectors(5.0), vectors(5.0))
def test_the_box_is_the_configured_one_and_else_the_mesh(a, b):
    np.testing.assert_array_equal(sampling_box_of(SCENE, ROOM, "scene"), ROOM)
    box = np.sort([a, b], axis=0)
    assume((box[1] - box[0] > 0.1).all())
    sides = dict(zip("xyz", box.T.tolist(), strict=True))
    scene = SceneConfig.model_validate({**SCENE.model_dump(), "sampling_box": sides})
    overlap = np.minimum(box[1], ROOM[1]) - np.maximum(box[0], ROOM[0])
    if (overlap > 0.0).all():
        twice = scene.model_copy(update={"further_boxes": (scene.sampling_box,)})
        found = sampling_boxes_of(twice, ROOM, "scene")
        np.testing.assert_array_equal(found, [box, box])
        np.testing.assert_array_equal(sampling_box_of(scene, ROOM, "scene"), box)
    else:
        with pytest.raises(InputError, match=r"^scene: .* lies outside the mesh"):
            sampling_box_of(scene, ROOM, "scene")


# A wall with a door leaves the last 2 m of the room, and a cupboard shuts off a corner.
WALL = [[1.0, -1.5, 0.0], [1.1, 2.0, 2.5]]
CUPBOARD = np.array([[-3.0, -2.0, 0.0], [-1.5, -0.5, 2.5]])
VIEWS = SCENE.model_copy(update={"min_view_distance_m": 0.8})


@pytest.fixture(scope="module")
def flat():
    return caster_of(ROOM, WALL, CUPBOARD)


def random_plan(caster, n_frames, seed=0, **values):
    collection = CollectionConfig.model_validate({"mode": "random", **values})
    return plan_split(caster, ROOM, VIEWS, collection, n_frames, np.random.default_rng(seed))


def test_random_poses_have_a_free_view_in_the_connected_space(flat):
    plan = random_plan(flat, 3000)
    np.testing.assert_array_equal(plan.frame, np.arange(3000))
    np.testing.assert_array_equal(plan.path, np.arange(3000))  # no two are of one path
    view_m = flat.first_hit_m(plan.position_m, plan.world_from_cam[:, :3, 2])
    assert ((view_m > 0.8) & np.isfinite(view_m)).all()
    at = plan.position_m
    assert not ((at > CUPBOARD[0]) & (at < CUPBOARD[1])).all(axis=1).any()
    assert np.mean(at[:, 0] > 1.1) > 0.1  # beyond the door too: one space, not one convex part


def test_random_poses_are_uniform_where_all_views_are_free():
    box = np.array([[-1.0, -0.5, 1.0], [1.0, 0.5, 1.5]])  # at least 1 m from every wall
    scene = VIEWS.model_copy(update={"min_view_distance_m": 0.5})
    random = CollectionConfig(mode="random")
    plan = plan_split(EMPTY, box, scene, random, 5000, np.random.default_rng(3))
    share = (plan.position_m - box[0]) / (box[1] - box[0])
    assert min(kstest(share[:, axis], "uniform").pvalue for axis in range(3)) > 0.01
    step = np.linalg.norm(np.diff(plan.position_m, axis=0), axis=1)
    assert np.median(step) > 0.5  # neighbours in the list are no neighbours in space


def test_random_plans_are_prefixes_and_repeatable_whatever_the_round(flat):
    longer = random_plan(flat, 500).position_m
    np.testing.assert_array_equal(random_plan(flat, 100).position_m, longer[:100])
    np.testing.assert_array_equal(random_plan(flat, 500, candidates=1).position_m, longer)
    assert not np.array_equal(random_plan(flat, 100, seed=1).position_m, longer[:100])


def test_nothing_admissible_ends_in_one_line(flat):
    scene = VIEWS.model_copy(update={"min_view_distance_m": 50.0})
    collection = CollectionConfig(mode="random", max_tries=50)
    with pytest.raises(InputError, match="min_view_distance_m"):
        plan_split(flat, ROOM, scene, collection, 10, np.random.default_rng(0))
