"""Coverage of a plan, against closed forms of boxes."""

import numpy as np
import pytest
import trimesh
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from synfeal.config.collection import Angles
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_matrix, quat_wxyz_of
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.triangles import Triangles
from synfeal.planning import coverage as seen
from synfeal.planning.coverage import (
    MAX_VOXELS,
    VOXEL_M,
    free_space_coverage,
    headings,
    plan_coverage,
    voxel_centres,
)
from synfeal.planning.path import poses_of
from synfeal.planning.space import ConnectedSpace
from tests.support import empty_room as room
from tests.support.property_support import directions, few, fewer, poses, seeds, table_of, vectors

pytestmark = pytest.mark.portable

CUBE = np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]])
SAMPLED = 4 * np.sqrt(0.25 / 20_000)  # four standard errors of a share of the points
ALL_AROUND = [(0.0, yaw) for yaw in (0.0, 90.0, 180.0, 270.0)] + [(90.0, 0.0), (-90.0, 0.0)]


def box(bounds):
    return trimesh.creation.box(bounds=bounds).subdivide().subdivide()


def joined(*meshes):
    mesh = trimesh.util.concatenate(list(meshes))
    return Triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def plan_of(position_m, views):
    """Cameras at one place; ``views`` are pitch and yaw in degrees."""
    rpy = np.deg2rad([(0.0, *view) for view in views])
    poses = pose_matrix(rotation_from_rpy(rpy), np.tile(position_m, (len(views), 1)))
    index = np.arange(len(poses))
    return PoseTable(index, index, poses[:, :3, 3], quat_wxyz_of(poses))


def cover(mesh, box_m, plan, camera=room.SQUARE):
    return plan_coverage(mesh, box_m, room.SCENE, plan, camera)


def test_a_camera_turning_in_the_middle_sees_everything_wherever_poses_are_sampled():
    found = cover(joined(box(CUBE)), CUBE, plan_of((0.1, 0.05, -0.1), ALL_AROUND))["surface"]
    assert found["visible_share"] == 1.0
    assert found["seen_share"] == 1.0
    # Nothing is in three frames but what lies on a border of several.
    assert found["seen_often_share"] < 0.01
    nowhere = np.array([[90.0, 90.0, 90.0], [91.0, 91.0, 91.0]])
    scene = room.SCENE.model_copy(update={"angles": Angles(yaw_deg=(0, 10))})
    found = plan_coverage(
        joined(box(CUBE)), nowhere, scene, plan_of((0, 0, 0), ALL_AROUND), room.SQUARE
    )
    assert found["surface"]["seen_share"] == 1.0


@pytest.mark.parametrize(("n", "share"), [(2, 0.0), (3, 1 / 6)])
def test_often_is_three_frames(n, share):
    found = cover(joined(box(CUBE)), CUBE, plan_of((0.0, 0.0, 0.0), [(0, 0)] * n))["surface"]
    assert found["seen_often_share"] == pytest.approx(share, abs=SAMPLED)


def test_of_a_divided_room_the_larger_part_is_the_scene():
    wall = box(np.array([[0.5, -2.0, -2.0], [0.6, 2.0, 2.0]]))
    found = cover(joined(box(CUBE), wall), CUBE, plan_of((-0.75, 0.0, 0.0), ALL_AROUND))
    # Seen: an end, four sides 2.5 m deep, the wall's near face. All: the cube, the wall's surface.
    visible, whole = 16 + 4 * 2.5 * 4 + 16, 6 * 16 + 2 * 16 + 4 * 0.1 * 4
    assert found["surface"]["visible_share"] == pytest.approx(visible / whole, abs=SAMPLED)
    # Rays end a little in front of the surface: a strip beyond the wall's foot passes for visible.
    assert found["surface"]["seen_share"] == pytest.approx(1.0, abs=5e-3)
    assert found["free_space"]["voxels"] == 10 * 16 * 16  # of 16 x 16 x 16


def test_voxels_near_a_camera_are_counted():
    corridor = np.array([[0.0, 0.0, 0.0], [5.0, 0.25, 0.25]])  # twenty voxels in a row
    shell = box(np.array([[-1.0, -1.0, -1.0], [6.0, 1.0, 1.0]]))
    camera = plan_of((1.125 + 0.1, 0.125, 0.125), [(0, 10), (0, 20), (0, 100)])
    found = cover(joined(shell), corridor, camera)["free_space"]
    assert found["voxels"] == 20
    assert found["positions_share"] == 4 / 20  # at 10, 15, 35 and 40 cm; the next is at 60
    assert found["headings_share"] == pytest.approx(4 * 2 / (20 * 8))  # 10 and 20 are one sector


def test_what_lies_beyond_the_fold_of_a_lens_is_not_in_the_image():
    camera = CameraConfig(horizontal_fov_deg=40.0, distortion=(-0.3, 0.0, 0.0, 0.0, 0.0))
    slope = np.array([[0.2, 0.0, 1.0], [1.7, 0.0, 1.0]])  # the second would land at 0.23
    assert seen.in_image(camera, np.eye(4), slope).tolist() == [True, False]


columns = st.floats(-10.0, 74.0)  # of an image of 64
YAW = np.array([0, 0, 0, 0, 0, 0.3])  # well within a sector of heading


@few
@given(vectors(20.0), st.tuples(*[st.floats(0.01, 60.0)] * 3))
@example(np.zeros(3), (0.01, 0.01, 0.01))
def test_voxels_are_equal_and_fill_the_box(corner, sides_m):
    box = np.stack([corner, corner + sides_m])
    centres, edge_m = voxel_centres(box)
    counts = [len(np.unique(axis.round(9))) for axis in centres.T]
    assert np.prod(counts) == len(centres)
    cell_m = np.array(sides_m) / counts
    np.testing.assert_allclose(centres.min(axis=0), box[0] + cell_m / 2, atol=1e-9)
    np.testing.assert_allclose(centres.max(axis=0), box[1] - cell_m / 2, atol=1e-9)
    np.testing.assert_allclose(centres.mean(axis=0), box.mean(axis=0), atol=1e-9)
    assert edge_m >= VOXEL_M
    wanted = np.maximum(np.array(sides_m) / edge_m, 1.0)
    assert (np.abs(counts - wanted) <= 0.5 + 1e-9).all()
    assert edge_m == VOXEL_M or np.isclose(edge_m**3 * MAX_VOXELS, np.prod(sides_m))


@few
@given(st.lists(room.pose_vectors, min_size=1, max_size=8))
def test_heading_is_the_eighth_of_the_circle_the_yaw_lies_in(listed):
    given_vectors = np.array(listed)
    sector = given_vectors[:, 5] / (np.pi / 4)
    clear = np.abs(sector - np.round(sector)) > 1e-6
    found = headings(table_of(poses_of(given_vectors)))
    assert ((found >= 0) & (found < 8)).all()
    np.testing.assert_array_equal(found[clear], np.floor(sector[clear]) % 8)


@fewer
@given(seeds, st.integers(1, 20), st.integers(1, 20))
def test_more_cameras_cover_more_of_the_free_space(seed, count, more):
    space = ConnectedSpace(room.EMPTY, np.array([[0.0, 0.0, 1.0]]))
    plan = table_of(poses_of(room.inside_poses(seed, count + more)))
    some, all_ = (free_space_coverage(space, room.ROOM, p) for p in (plan.first(count), plan))
    assert some["voxels"] == all_["voxels"] == 24 * 16 * 10
    assert (some["voxel_m"], some["within_m"]) == (0.25, 0.5)
    assert 0.0 < some["positions_share"] <= all_["positions_share"] <= 1.0
    assert some["headings_share"] <= all_["headings_share"] <= all_["positions_share"]
    alike = table_of(poses_of(room.inside_poses(seed, count) * [1, 1, 1, 1, 1, 0] + YAW))
    same_way = free_space_coverage(space, room.ROOM, alike)
    assert same_way["headings_share"] == pytest.approx(same_way["positions_share"] / 8)
    # No camera reaches more than the centres within a ball of radius 2 edges.
    assert all_["positions_share"] <= (count + more) * 1.4 * (4 / 3 * np.pi * 8) / all_["voxels"]


@settings(few, max_examples=3)
@given(seeds, st.integers(1, 5))
def test_in_an_empty_room_all_can_be_seen_and_more_frames_see_more(seed, count):
    plan = table_of(poses_of(room.inside_poses(seed, count + 3)))
    mesh, hubs = room.mesh_of(room.ROOM), np.array([[0.0, 0.0, 1.0]])
    few_, all_ = (
        seen.seen_surface(mesh, room.EMPTY, hubs, p, room.SQUARE) for p in (plan.first(count), plan)
    )
    assert few_.visible == all_.visible == seen.N_POINTS
    assert few_.seen_often <= few_.seen <= all_.seen <= seen.N_POINTS
    assert few_.seen_often <= all_.seen_often <= all_.seen
    found = plan_coverage(mesh, room.ROOM, room.SCENE, plan, room.SQUARE)
    assert found["frames"] == found["surface"]["frames_looked_at"] == count + 3
    assert found["surface"]["seen_share"] == all_.seen / seen.N_POINTS
    assert found["surface"]["seen_often_share"] == all_.seen_often / seen.N_POINTS


@few
@given(st.integers(1, 5000))
@example(seen.MAX_FRAMES)
@example(seen.MAX_FRAMES + 1)
def test_frames_shown_are_spread_evenly_from_first_to_last(count):
    found = seen.shown_frames(count)
    assert len(found) == min(count, seen.MAX_FRAMES)
    assert (found[0], found[-1]) == (0, count - 1) or count == 1
    gaps = np.diff(found)
    assert (gaps >= 1).all()
    assert len(set(gaps)) <= 2


@few
@given(seeds, room.walls)
def test_of_a_divided_room_each_part_sees_its_own_surface(seed, wall):
    rng, caster = np.random.default_rng(seed), room.divided(wall)
    floor = rng.uniform([-2.9, -1.9, 0.0], [2.9, 1.9, 0.0], (40, 3))
    floor = floor[np.abs(floor[:, 0] - wall - 0.05) > 0.2]
    places = np.array([[-2.0, 0.0, 1.0], [2.5, 0.0, 1.0]])
    near = floor[:, 0] < wall
    np.testing.assert_array_equal(seen.has_line(caster, places[0], floor), near)
    np.testing.assert_array_equal(seen.has_line(caster, places[1], floor), ~near)
    np.testing.assert_array_equal(seen.visible_points(caster, places[:1], floor), floor[near])
    np.testing.assert_array_equal(seen.visible_points(caster, places, floor), floor)
    assert len(seen.visible_points(caster, places[:0], floor)) == 0


@few
@given(poses, st.tuples(columns, columns), st.floats(0.06, 6.0), directions)
@example(np.eye(4), (32.0, 32.0), 4.9, np.array([0.0, 0.0, 1.0]))
@example(np.eye(4), (32.0, 32.0), 5.1, np.array([0.0, 0.0, 1.0]))
@example(np.eye(4), (32.0, 65.0), 1.0, np.array([0.0, 0.0, 1.0]))
@example(np.eye(4), (-1.0, 32.0), 1.0, np.array([0.0, 0.0, 1.0]))
def test_a_point_is_in_the_image_if_its_pixel_is_and_it_is_near_enough(pose, pixel, depth_m, way):
    slope = (np.array(pixel) - 32.0) / 32.0  # 64 pixels and a right angle: f = 32
    in_cam = depth_m * np.array([*slope, 1.0])
    distance_m = np.linalg.norm(in_cam)
    assume(abs(distance_m - seen.FARTHEST_M) > 1e-6)
    assume(min(abs(value - edge) for value in pixel for edge in (0, 64)) > 1e-6)
    expected = all(0 < value < 64 for value in pixel) and distance_m < seen.FARTHEST_M
    points = np.array([pose[:3, :3] @ p + pose[:3, 3] for p in (in_cam, -in_cam, 0.04 * way)])
    assert seen.in_image(room.SQUARE, pose, points).tolist() == [expected, False, False]


@few
@given(seeds, st.integers(1, 20), st.floats(0.5, 5.0))
def test_what_is_beyond_the_far_plane_is_empty(seed, count, far_m):
    vectors = room.inside_poses(seed, count)
    plan = table_of(poses_of(vectors))
    near = room.SQUARE.model_copy(update={"near_m": 0.01})  # nearer than any wall
    assert (seen.empty_shares(room.EMPTY, plan.world_from_cam, near) == 0.0).all()
    camera = near.model_copy(update={"far_m": far_m})
    x, y = np.meshgrid(
        (np.arange(seen.COLUMNS) + 0.5) / seen.COLUMNS, (np.arange(seen.ROWS) + 0.5) / seen.ROWS
    )
    ray = np.stack([2 * x - 1, 2 * y - 1, np.ones_like(x)], axis=-1).reshape(-1, 3)
    expected = []
    for pose in plan.world_from_cam:
        ways = ray @ pose[:3, :3].T
        depth_m = room.wall_distance_m(np.tile(pose[:3, 3], (len(ways), 1)), ways)
        expected.append(np.mean(depth_m > far_m))
    shares = seen.empty_shares(room.EMPTY, plan.world_from_cam, camera)
    np.testing.assert_allclose(shares, expected, atol=2.5 / (seen.COLUMNS * seen.ROWS))
    found = seen.empty_pixels(room.EMPTY, plan, camera)
    assert found.share == pytest.approx(shares.mean(), abs=1e-6)
    assert found.worst_frame_share == pytest.approx(shares.max(), abs=1e-6)
    assert found.mostly_empty_frames == pytest.approx(np.mean(shares > 0.5), abs=1e-6)
