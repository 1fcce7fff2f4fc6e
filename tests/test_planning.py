"""Planning: sampling, target selection and straight paths against closed forms and invariants."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from synfeal.config.models import Angles, CollectionConfig, SceneConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.errors import InputError
from synfeal.geometry.rotations import rotation_angle_rad
from synfeal.mesh.rays import RayCaster
from synfeal.planning.path import n_frames_of, path_poses, path_vectors, poses_of
from synfeal.planning.plan import plan_split, sampling_box_of
from synfeal.planning.sampling import pose_bounds, sample_poses, view_directions
from synfeal.planning.space import PoseSpace
from synfeal.planning.start import sample_start
from synfeal.planning.target import admissible, farthest_admissible, has_free_view

ROOM = np.array([[-3.0, -2.0, 0.0], [3.0, 2.0, 2.5]])


def caster_of(*meshes: trimesh.Trimesh) -> RayCaster:
    joined = trimesh.util.concatenate(list(meshes))
    return RayCaster(joined.vertices, joined.faces)


def room(bounds: NDArray[np.float64] = ROOM) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=bounds)


def scene_of(**values: object) -> SceneConfig:
    return SceneConfig.model_validate({"source": "mesh", "path": "scene.glb", **values})


def collection_of(**values: object) -> CollectionConfig:
    return CollectionConfig.model_validate({"max_tries": 300, **values})


def vector(*values: float) -> NDArray[np.float64]:
    return np.array([*values], dtype=np.float64)


def test_samples_are_uniform_within_their_bounds() -> None:
    bounds = pose_bounds(ROOM, Angles())
    poses = sample_poses(bounds, 20_000, np.random.default_rng(0))
    np.testing.assert_allclose(bounds[:, 5], [0.0, 2.0 * np.pi])
    share = (poses - bounds[0]) / (bounds[1] - bounds[0])
    assert share.min() >= 0.0
    assert share.max() <= 1.0
    for moment in (1, 2, 3):  # of a uniform variable: 1 / (k + 1)
        np.testing.assert_allclose((share**moment).mean(axis=0), 1 / (moment + 1), atol=0.01)
    np.testing.assert_allclose(np.corrcoef(share.T), np.eye(6), atol=0.03)


@pytest.mark.parametrize(
    ("roll_pitch_yaw_deg", "expected"),
    [
        ((0, 0, 0), (1, 0, 0)),
        ((25, 0, 0), (1, 0, 0)),  # rolling does not change where the camera looks
        ((0, 0, 90), (0, 1, 0)),
        ((0, 30, 0), (np.sqrt(3) / 2, 0, -0.5)),  # y is left: positive pitch looks down
    ],
)
def test_view_direction(roll_pitch_yaw_deg: tuple[float, ...], expected: tuple[float, ...]) -> None:
    pose = vector(0, 0, 0, *np.deg2rad(roll_pitch_yaw_deg))[None]
    np.testing.assert_allclose(view_directions(pose)[0], expected, atol=1e-12)


def test_free_view_needs_a_hit_beyond_the_least_distance() -> None:
    wall = trimesh.creation.box(bounds=[[2.0, -1, -1], [2.1, 1, 1]])
    poses = np.stack([vector(0, 0, 0, 0, 0, 0), vector(1, 0, 0, 0, 0, 0), vector(0, 0, 0, 0, 0, 3)])
    # two metres ahead; one metre ahead; looking away from it into the void
    assert has_free_view(caster_of(wall), poses, 1.5).tolist() == [True, False, False]


def test_admissible_is_reachable_and_free() -> None:
    wall = trimesh.creation.box(bounds=[[0.9, -2.0, 0.0], [1.0, 1.0, 2.5]])  # leaves a gap at y > 1
    start = vector(0, 0, 1, 0, 0, 0)
    poses = np.stack(
        [
            vector(2, 0, 1, 0, 0, np.pi / 2),  # behind the wall
            vector(-1, 0, 1, 0, 0, np.pi),  # reachable, the far wall is 2 m away
            vector(-2.5, 0, 1, 0, 0, np.pi),  # reachable, but half a metre from the wall
        ]
    )
    found = admissible(caster_of(room(), wall), start, poses, 1.2)
    assert found.tolist() == [False, True, False]


def test_target_is_the_farthest_admissible_candidate_of_the_first_round_with_one() -> None:
    caster, start = caster_of(room()), vector(-2, 0, 1, 0, 0, 0)
    rounds = np.stack([vector(x, 0, 1, 0, 0, 0) for x in (-1.5, 2, 0, 1, -1, 2.5)]).reshape(3, 2, 6)
    rounds[0, 1, 1] = 9.0  # outside
    has_view = np.ones((3, 2), np.bool_)
    assert farthest_admissible(caster, start, rounds, has_view, 0.0) == (0, 0)
    assert farthest_admissible(caster, start, rounds, has_view, 1.0) == (1, 1)
    has_view[1, 1] = False
    assert farthest_admissible(caster, start, rounds, has_view, 1.0) == (1, 0)
    assert farthest_admissible(caster, start, rounds, has_view, 9.0) is None
    assert farthest_admissible(caster, start, rounds, ~has_view & False, 0.0) is None


@pytest.mark.parametrize(("length", "n"), [(0.0, 1), (0.01, 1), (0.29, 3), (0.31, 3), (1.0, 10)])
def test_number_of_frames_is_the_nearest_integer(length: float, n: int) -> None:
    assert n_frames_of(np.zeros(6), vector(length, 0, 0, 0, 0, 0), 0.1) == n


def test_path_is_linear_and_ends_on_the_target() -> None:
    start, target = vector(0, 1, 2, 0.1, 0.2, 0.3), vector(3, 5, 2, -0.1, 0.0, 0.5)
    vectors = path_vectors(start, target, 4)
    np.testing.assert_allclose(vectors[-1], target, atol=1e-12)
    np.testing.assert_allclose(vectors[1], (start + target) / 2, atol=1e-12)
    np.testing.assert_allclose(np.diff(vectors, axis=0), np.tile((target - start) / 4, (3, 1)))


def test_angles_turn_the_short_way_round() -> None:
    start, target = vector(0, 0, 0, 0, 0, np.deg2rad(170)), vector(1, 0, 0, 0, 0, np.deg2rad(-170))
    vectors = path_vectors(start, target, 2)
    np.testing.assert_allclose(np.rad2deg(vectors[:, 5]), [180.0, 190.0])


angle = st.floats(-7.0, 7.0)
pitch = st.floats(-1.0, 1.0)


@pytest.mark.parametrize("interpolation", ["rpy", "slerp"])
@given(start=st.tuples(angle, pitch, angle), target=st.tuples(angle, pitch, angle))
def test_paths_end_at_the_target_pose_at_even_spacing(
    interpolation: str, start: tuple[float, ...], target: tuple[float, ...]
) -> None:
    a, b = vector(0, 0, 0, *start), vector(1.0, 2.0, -2.0, *target)
    poses = path_poses(a, b, 0.1, interpolation)  # type: ignore[arg-type]
    assert len(poses) == 30
    np.testing.assert_allclose(poses[-1], poses_of(b[None])[0], atol=1e-9)
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.1)


def test_slerp_turns_at_constant_speed() -> None:
    a, b = vector(0, 0, 0, 0, 0, 0), vector(1, 0, 0, 0.5, -0.4, 2.0)
    table = _table(path_poses(a, b, 0.1, "slerp"))
    turns = rotation_angle_rad(table.quat_wxyz[:-1], table.quat_wxyz[1:])
    np.testing.assert_allclose(turns, turns[0], rtol=1e-9)


def _table(poses: NDArray[np.float64]) -> PoseTable:
    index = np.arange(len(poses))
    return PoseTable(index, index, poses[:, :3, 3], np.zeros((len(poses), 4))).with_poses(poses)


@pytest.fixture(scope="module")
def furnished() -> RayCaster:
    table = trimesh.creation.box(bounds=[[-0.5, -0.5, 0.7], [0.5, 0.5, 0.8]])
    return caster_of(room(), table)


def test_plan_has_the_frames_asked_for_on_free_connected_paths(furnished: RayCaster) -> None:
    collection = collection_of(frame_spacing_m=0.1, min_path_m=1.0)
    table = plan_split(furnished, ROOM, scene_of(), collection, 500, np.random.default_rng(1))
    np.testing.assert_array_equal(table.frame, np.arange(500))
    assert set(np.diff(table.path)) == {0, 1}
    # Each path starts where the one before ended, so no step is longer than the spacing allows.
    steps = np.linalg.norm(np.diff(table.position_m, axis=0), axis=1)
    assert steps.max() < 0.1 * 1.05
    assert furnished.sees(table.position_m[:-1], table.position_m[1:]).all()
    assert (table.position_m > ROOM[0]).all()
    assert (table.position_m < ROOM[1]).all()
    for path in range(table.path.max()):  # the last path may be cut short
        inside = np.flatnonzero(table.path == path)
        np.testing.assert_allclose(np.ptp(steps[inside[:-1]]), 0.0, atol=1e-9)
        assert len(inside) >= 10
    upright = table.world_from_cam[:, 2, 1]  # world z of the camera's downward axis
    assert (upright < 0).all()


def test_targets_look_farther_than_the_least_distance(furnished: RayCaster) -> None:
    scene = scene_of(min_view_distance_m=2.0)
    table = plan_split(furnished, ROOM, scene, collection_of(), 2000, np.random.default_rng(2))
    last = np.flatnonzero(np.diff(table.path))
    assert len(last) > 10
    forward = table.world_from_cam[last, :3, 2]
    assert (furnished.first_hit_m(table.position_m[last], forward) > 2.0).all()


def test_plans_are_repeatable_and_prefixes_of_longer_ones(furnished: RayCaster) -> None:
    def plan(n: int, seed: int) -> NDArray[np.float64]:
        rng = np.random.default_rng(seed)
        return plan_split(furnished, ROOM, scene_of(), collection_of(), n, rng).position_m

    np.testing.assert_array_equal(plan(100, 3), plan(200, 3)[:100])
    assert not np.array_equal(plan(100, 3), plan(100, 4))


def test_start_is_in_the_room_and_not_in_the_cupboard() -> None:
    cupboard = trimesh.creation.box(bounds=[[1.0, -2.0, 0.0], [3.0, 2.0, 2.5]])  # a third of it
    caster = caster_of(room(), cupboard)
    bounds = pose_bounds(ROOM, Angles())
    for seed in range(10):
        start = sample_start(PoseSpace(caster, bounds, 0.5, np.random.default_rng(seed)), 100)
        assert start[0] < 1.0


def test_impossible_view_distance_says_what_to_relax() -> None:
    with pytest.raises(InputError, match="min_view_distance_m"):
        plan_split(
            caster_of(room()),
            ROOM,
            scene_of(min_view_distance_m=20.0),
            collection_of(),
            10,
            np.random.default_rng(0),
        )


def test_impossible_path_length_says_what_to_relax() -> None:
    with pytest.raises(InputError, match="min_path_m"):
        plan_split(
            caster_of(room()),
            ROOM,
            scene_of(),
            collection_of(min_path_m=50.0),
            10,
            np.random.default_rng(0),
        )


def test_no_frames_is_an_error() -> None:
    with pytest.raises(InputError, match="at least 1"):
        plan_split(
            caster_of(room()), ROOM, scene_of(), collection_of(), 0, np.random.default_rng(0)
        )


def test_sampling_box_defaults_to_the_mesh() -> None:
    np.testing.assert_array_equal(sampling_box_of(scene_of(), ROOM, "room"), ROOM)
    box = {"x": [0, 1], "y": [0, 2], "z": [1, 2]}
    found = sampling_box_of(scene_of(sampling_box=box), ROOM, "room")
    np.testing.assert_array_equal(found, [[0, 0, 1], [1, 2, 2]])
    with pytest.raises(InputError, match="unit_m"):
        sampling_box_of(scene_of(sampling_box=box), ROOM * 1000, "room")
