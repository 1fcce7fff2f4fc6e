"""Batches that are hard for RGB-D odometry and for KinectFusion, each with what is right for it."""

import numpy as np
import pytest
from PIL import Image

from baselines.groundtruth.kinect_fusion import kinect_fusion_batch
from baselines.groundtruth.posegraph.optimise import optimise_lm
from baselines.groundtruth.rgbd import rgbd_graph
from synfeal.config.models import CameraConfig, KinectFusionConfig, RgbdConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, relative
from tests.room_scene import CAMERA, FURNISHED, Room, pose_at, write_room


def rgbd(paths, camera=CAMERA):
    """Poses, which of them follow measured motions, and the graph."""
    graph, facts = rgbd_graph(*paths, camera, RgbdConfig(keyframe_every=3))
    guessed = np.array([edge.information[0, 0] < 1e3 for edge in graph.edges[: facts["pairs"]]])
    assert facts["pairs_accepted"] == facts["pairs"] - guessed.sum()
    return optimise_lm(graph, 20), np.concatenate([[True], ~guessed]), graph


def fusion(paths, camera=CAMERA):
    trajectory = kinect_fusion_batch(*paths, camera, KinectFusionConfig(voxel_m=0.02))
    return trajectory.first_from_cam, trajectory.registered, None


METHODS = pytest.mark.parametrize("method", [rgbd, fusion])


@pytest.fixture(scope="module")
def written():
    return {}


@pytest.fixture
def write_once(request, written, tmp_path_factory):
    """Writes the frames of a test once for both methods, unless it changes the files."""

    def write(poses, room=FURNISHED, camera=CAMERA):
        name = (request.node.originalname, len(poses))
        if name not in written:
            written[name] = write_room(tmp_path_factory.mktemp("room"), poses, room, camera)
        return written[name]

    return write


def errors(first_from_cam, poses):
    """Position errors in metres and orientation errors in degrees."""
    truth = relative(np.array(poses)[0], np.array(poses))
    error_m, error_rad = pose_error(first_from_cam, truth)
    return error_m, np.degrees(error_rad)


def assert_right(result, poses, max_m=0.02, max_deg=0.5):
    """RGB-D finds every pose; KinectFusion may lose frames, but what it gives is right."""
    first_from_cam, known, graph = result
    assert known[0]
    if graph is None:
        max_m, max_deg = max(max_m, 0.05), max(max_deg, 1.5)
    else:
        assert known.all()
    error_m, error_deg = (error[known] for error in errors(first_from_cam, poses))
    assert error_m.max() < max_m
    assert error_deg.max() < max_deg


@METHODS
def test_no_motion_before_a_white_wall_is_claimed_to_be_measured(method, write_once):
    wall = Room((((-3.0, -40.0, -40.0), (3.0, 40.0, 40.0)),), plain=True)
    poses = [pose_at([1.0, 0.03 * k, 1.5], pitch_deg=0) for k in range(40)]
    first_from_cam, known, _ = method(write_once(poses, wall))
    assert known[0]
    assert not known[1:].any()
    assert np.isfinite(first_from_cam).all()


@METHODS
def test_pure_rotation_is_recovered(method, write_once):
    poses = [pose_at([-1.0, 0, 1.4], yaw_deg=25 + 2.5 * k) for k in range(12)]
    assert_right(method(write_once(poses)), poses)


@METHODS
def test_identical_rooms_are_not_taken_for_one(method, write_once):
    """Every 3 m along the way the view repeats; no closure may join two repetitions."""
    row = Room((((-20.0, -2.5, 0.0), (30.0, 2.5, 2.6)), *FURNISHED.boxes[1:4]), period_m=3.0)
    poses = [pose_at([0.15 * k - 1, -1.5, 1.4], yaw_deg=60) for k in range(28)]
    result = method(write_once(poses, row))
    assert_right(result, poses, max_m=0.1, max_deg=1.0)
    for edge in result[2].edges if result[2] else ():
        error_m = pose_error(edge.i_from_j, relative(poses[edge.i], poses[edge.j]))[0]
        assert error_m < 0.05


@METHODS
def test_a_right_angle_in_five_frames_is_recovered_or_lost(method, write_once):
    """18 degrees a frame: features find them; KinectFusion has none and says that it is lost."""
    yaw_deg = np.concatenate([np.zeros(4), np.linspace(0, 90, 6)[1:], np.full(4, 90)])
    poses = [pose_at([-1.0 + 0.03 * k, 0, 1.4], yaw_deg=a) for k, a in enumerate(yaw_deg)]
    first_from_cam, known, _ = method(write_once(poses))
    error_m, error_deg = errors(first_from_cam, poses)
    assert error_m[known].max() < 0.05
    assert error_deg[known].max() < 1.0
    assert known.all() == (method is rgbd)


@METHODS
def test_without_depth_nothing_is_known_but_the_first_pose(method, tmp_path):
    poses = [pose_at([-1.0 + 0.03 * k, 0, 1.4]) for k in range(5)]
    color, depth = write_room(tmp_path, poses)
    for path in depth:
        Image.fromarray(np.full((CAMERA.height, CAMERA.width), 65535, np.uint16)).save(path)
    first_from_cam, known, _ = method((color, depth))
    assert known.tolist() == [True, False, False, False, False]
    np.testing.assert_array_equal(first_from_cam, np.tile(np.eye(4), (5, 1, 1)))


@METHODS
@pytest.mark.parametrize("kind", [0, 1], ids=["colour", "depth"])
@pytest.mark.parametrize("damage", ["cut", "overwritten", "empty"])
def test_a_damaged_image_is_named(method, kind, damage, tmp_path):
    paths = write_room(tmp_path, [pose_at([-1.0, 0, 1.4])] * 3)
    bad = paths[kind][1]
    whole = bad.read_bytes()
    bad.write_bytes(
        {
            "cut": whole[: len(whole) // 2],
            "overwritten": whole[:60] + bytes(200) + whole[260:],
            "empty": b"",
        }[damage]
    )
    with pytest.raises(InputError, match=f"{bad.name}: cannot be read as an image") as caught:
        method(paths)
    assert "\n" not in str(caught.value)


@METHODS
def test_a_principal_point_off_the_centre_costs_nothing_only_when_it_is_known(method, write_once):
    fx, fy, cx, cy = CAMERA.intrinsics
    off = CameraConfig(width=CAMERA.width, height=CAMERA.height, fx=fx, fy=fy, cx=cx + 20, cy=cy)
    poses = [pose_at([-1.0 + 0.02 * k, 0.01 * k, 1.4], yaw_deg=30 + k) for k in range(12)]
    paths = write_once(poses, camera=off)
    assert_right(method(paths, off), poses)
    wrong, known, _ = method(paths, CAMERA)
    assert np.isfinite(wrong).all()
    right_m = errors(method(paths, off)[0], poses)[0]
    assert not known.all() or errors(wrong, poses)[0].max() > 2 * right_m.max()
