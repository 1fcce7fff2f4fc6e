"""What a plan covers, against closed forms of boxes."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from synfeal.config.models import Angles, CameraConfig, SceneConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_matrix, quat_wxyz_of
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.triangles import Triangles
from synfeal.planning.coverage import plan_coverage, voxel_centres
from synfeal.planning.seen_surface import FARTHEST_M, in_image

Array = NDArray[np.float64]

SCENE = SceneConfig.model_validate({"source": "mesh", "path": "scene.glb"})
SQUARE = CameraConfig(width=64, height=64, horizontal_fov_deg=90.0)  # six of them see all around
CUBE = np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]])
SAMPLED = 4 * np.sqrt(0.25 / 20_000)  # four standard errors of a share of the points
ALL_AROUND = [(0.0, yaw) for yaw in (0.0, 90.0, 180.0, 270.0)] + [(90.0, 0.0), (-90.0, 0.0)]


def box(bounds: Array) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=bounds).subdivide().subdivide()


def joined(*meshes: trimesh.Trimesh) -> Triangles:
    mesh = trimesh.util.concatenate(list(meshes))
    return Triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def plan_of(position_m: tuple[float, ...], views: list[tuple[float, float]]) -> PoseTable:
    """Cameras at one place; ``views`` are pitch and yaw in degrees."""
    rpy = np.deg2rad([(0.0, *view) for view in views])
    poses = pose_matrix(rotation_from_rpy(rpy), np.tile(position_m, (len(views), 1)))
    index = np.arange(len(poses))
    return PoseTable(index, index, poses[:, :3, 3], quat_wxyz_of(poses))


def cover(mesh: Triangles, box_m: Array, plan: PoseTable, camera: CameraConfig = SQUARE) -> dict:  # type: ignore[type-arg]
    return plan_coverage(mesh, box_m, SCENE, plan, camera)


def test_a_camera_turning_in_the_middle_of_a_room_sees_everything() -> None:
    found = cover(joined(box(CUBE)), CUBE, plan_of((0.1, 0.05, -0.1), ALL_AROUND))["surface"]
    assert found["visible_share"] == 1.0
    assert found["seen_share"] == 1.0
    # Nothing is in three frames but what lies on a border of several.
    assert found["seen_often_share"] < 0.01


def test_a_view_of_a_right_angle_sees_a_sixth_of_a_cube() -> None:
    found = cover(joined(box(CUBE)), CUBE, plan_of((0.0, 0.0, 0.0), [(0, 0)]))["surface"]
    assert found["seen_share"] == pytest.approx(1 / 6, abs=SAMPLED)


@pytest.mark.parametrize(("n", "share"), [(2, 0.0), (3, 1 / 6), (5, 1 / 6)])
def test_often_is_three_frames(n: int, share: float) -> None:
    found = cover(joined(box(CUBE)), CUBE, plan_of((0.0, 0.0, 0.0), [(0, 0)] * n))["surface"]
    assert found["seen_often_share"] == pytest.approx(share, abs=SAMPLED)


def test_of_a_divided_room_the_larger_part_is_the_scene() -> None:
    wall = box(np.array([[0.5, -2.0, -2.0], [0.6, 2.0, 2.0]]))
    found = cover(joined(box(CUBE), wall), CUBE, plan_of((-0.75, 0.0, 0.0), ALL_AROUND))
    # Seen: an end, four sides 2.5 m deep, the wall's near face. All: the cube, the wall's surface.
    visible, whole = 16 + 4 * 2.5 * 4 + 16, 6 * 16 + 2 * 16 + 4 * 0.1 * 4
    assert found["surface"]["visible_share"] == pytest.approx(visible / whole, abs=SAMPLED)
    # Rays end a little in front of the surface: a strip beyond the wall's foot passes for visible.
    assert found["surface"]["seen_share"] == pytest.approx(1.0, abs=5e-3)
    assert found["free_space"]["voxels"] == 10 * 16 * 16  # of 16 x 16 x 16


def test_half_a_room_behind_a_screen_is_not_seen() -> None:
    screen = box(np.array([[0.0, -1.9, -2.0], [0.05, 2.0, 2.0]]))  # a gap of 10 cm
    found = cover(joined(box(CUBE), screen), CUBE, plan_of((-1.0, 1.0, 0.0), ALL_AROUND))
    assert found["surface"]["seen_share"] == pytest.approx(0.5, abs=0.03)


def test_what_is_too_far_is_not_seen() -> None:
    hall = np.array([[0.0, -0.5, -0.5], [2 * FARTHEST_M, 0.5, 0.5]])
    found = cover(joined(box(hall)), hall, plan_of((0.1, 0.0, 0.0), ALL_AROUND))["surface"]
    near = 1 + 4 * 5.1  # the end wall and the sides as far as 5 m from the camera
    whole = 2 + 4 * 10
    assert found["seen_share"] == pytest.approx(near / whole, abs=SAMPLED + 0.03 * near / whole)


def test_voxels_near_a_camera_are_counted() -> None:
    corridor = np.array([[0.0, 0.0, 0.0], [5.0, 0.25, 0.25]])  # twenty voxels in a row
    shell = box(np.array([[-1.0, -1.0, -1.0], [6.0, 1.0, 1.0]]))
    camera = plan_of((1.125 + 0.1, 0.125, 0.125), [(0, 10), (0, 20), (0, 100)])
    found = cover(joined(shell), corridor, camera)["free_space"]
    assert found["voxels"] == 20
    assert found["positions_share"] == 4 / 20  # at 10, 15, 35 and 40 cm; the next is at 60
    assert found["headings_share"] == pytest.approx(4 * 2 / (20 * 8))  # 10 and 20 are one sector


@pytest.mark.parametrize("yaw_deg", [-170, -85, -1, 1, 44, 46, 100, 179])
def test_each_heading_is_one_of_eight(yaw_deg: int) -> None:
    views = [(0.0, float(yaw_deg) + turn) for turn in range(0, 360, 45)]
    found = cover(joined(box(CUBE)), CUBE / 16, plan_of((0.0, 0.0, 0.0), views))["free_space"]
    assert found["headings_share"] == 1.0
    found = cover(joined(box(CUBE)), CUBE / 16, plan_of((0.0, 0.0, 0.0), views[:3]))["free_space"]
    assert found["headings_share"] == 3 / 8


def test_large_boxes_have_larger_voxels() -> None:
    centres, edge_m = voxel_centres(np.array([[0.0, 0.0, 0.0], [100.0, 50.0, 10.0]]))
    assert edge_m**3 == pytest.approx(100 * 50 * 10 / 20_000)
    assert len(centres) == pytest.approx(20_000, rel=0.05)
    np.testing.assert_allclose(centres.mean(axis=0), [50, 25, 5])


def test_poses_where_none_can_be_sampled_are_measured_too() -> None:
    nowhere = np.array([[90.0, 90.0, 90.0], [91.0, 91.0, 91.0]])
    scene = SCENE.model_copy(update={"angles": Angles(yaw_deg=(0, 10))})
    found = plan_coverage(joined(box(CUBE)), nowhere, scene, plan_of((0, 0, 0), ALL_AROUND), SQUARE)
    assert found["surface"]["seen_share"] == 1.0  # type: ignore[index]


def test_points_in_the_image_are_those_the_camera_projects_there() -> None:
    half = {"width": 64, "height": 64, "fx": 64.0, "fy": 64.0, "cx": 0.0, "cy": 32.0}
    camera = CameraConfig.model_validate(half)  # sees slopes of x in [0, 1], of y in [-1/2, 1/2]
    points = np.array([[0.5, 0.2, 1.0], [-0.5, 0.2, 1.0], [0.5, 0.6, 1.0], [1.1, 0, 1.0]])
    assert in_image(camera, np.eye(4), points).tolist() == [True, False, False, False]
    assert not in_image(camera, np.eye(4), -points).any()
    moved = pose_matrix(np.eye(3), [0.0, 0.5, 0.0])
    assert in_image(camera, moved, points).tolist() == [True, False, True, False]


def test_what_lies_beyond_the_fold_of_a_lens_is_not_in_the_image() -> None:
    camera = CameraConfig(horizontal_fov_deg=40.0, distortion=(-0.3, 0.0, 0.0, 0.0, 0.0))
    slope = np.array([[0.2, 0.0, 1.0], [1.7, 0.0, 1.0]])  # the second would land at 0.23
    assert in_image(camera, np.eye(4), slope).tolist() == [True, False]
