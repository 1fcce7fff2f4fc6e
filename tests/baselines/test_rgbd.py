import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from baselines.config.labels import KinectFusionConfig, RgbdConfig
from baselines.labels.kinect_fusion import kinect_fusion_batch
from baselines.labels.posegraph.levenberg_marquardt import optimise_lm
from baselines.labels.rgbd import dense, frames, rgbd_graph
from baselines.labels.rgbd.dense import depth_agreement
from baselines.labels.rgbd.frames import read_frame
from baselines.labels.rgbd.tracks import loop_candidates
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_error, pose_matrix, relative
from synfeal.geometry.rotations import rotation_from_rpy
from tests.support.room_scene import (
    CAMERA,
    FURNISHED,
    PLANES,
    Room,
    cast,
    pose_at,
    straight_path,
    write_planes,
    write_room,
)

CFG = RgbdConfig(keyframe_every=3)
TRUTH = straight_path(10, step_m=0.06, turn_deg=2.0)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    return write_planes(tmp_path_factory.mktemp("planes"), TRUTH)


@pytest.fixture(scope="module")
def graph(paths):
    return rgbd_graph(*paths, CAMERA, CFG)[0]


def test_neighbours_and_loop_closures_are_measured(graph):
    pairs = [(edge.i, edge.j) for edge in graph.edges]
    assert pairs[:9] == [(k, k + 1) for k in range(9)]
    assert len(pairs) > 9
    assert all(i % 3 == 0 and j % 3 == 0 and j > i for i, j in pairs[9:])
    truth = TRUTH.world_from_cam
    for edge in graph.edges:
        error_m, error_rad = pose_error(edge.i_from_j, relative(truth[edge.i], truth[edge.j]))
        assert error_m < 0.02
        assert np.degrees(error_rad) < 0.5


def test_odometry_drifts_by_less_than_a_percent_of_the_way(tmp_path):
    """Without closures, along 1.2 m before furniture; start and end of a bend included."""
    step = np.arange(41)
    place = np.column_stack([-1.8 + 0.03 * step, 0.1 * np.sin(step / 8), 1.4 + 0 * step])
    poses = np.array([pose_at(m, 10 * np.sin(k / 10)) for k, m in zip(step, place, strict=True)])
    paths = write_room(tmp_path, poses)
    graph = rgbd_graph(*paths, CAMERA, RgbdConfig(loops_per_keyframe=0))[0]
    way_m = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum()
    assert way_m > 1.2
    assert [(edge.i, edge.j) for edge in graph.edges] == [(k, k + 1) for k in step[:-1]]
    error_m, error_rad = pose_error(graph.first_from_cam, relative(poses[0], poses))
    assert error_m.max() < 0.01 * way_m
    assert np.degrees(error_rad.max()) < 0.5


def test_steps_of_one_scale_end_where_open3ds_own_loop_ends(tmp_path, monkeypatch):
    poses = np.array([pose_at([-1.8, 0.0, 1.4]), pose_at([-1.78, 0.01, 1.4], yaw_deg=0.3)])
    colors, depths = write_room(tmp_path, poses)
    i, j = (read_frame(*pair, CAMERA, CFG, 0) for pair in zip(colors, depths, strict=True))
    stage = frames.Stage(stride=1, max_steps=8, huber_m=0.05, rest_m=0.0, rest_deg=0.0)
    monkeypatch.setattr(frames, "STAGES", (stage,))
    monkeypatch.setattr(dense, "_PASSES", (((8,), 0.05),))
    theirs = dense.register(i.rgbd, j.rgbd, np.eye(4), CAMERA, CFG)
    ours = frames.align(i.surfaces, j.surfaces, np.eye(4), 2 * CFG.max_rmse_m)
    assert np.abs(ours - theirs).max() < 1e-6
    assert np.abs(ours - np.eye(4)).max() > 1e-2


def test_what_is_unmeasurable_or_too_far_away_keeps_a_weak_edge(paths, tmp_path):
    """Two empty frames in the middle: the graph stays connected, by guesses of low weight."""
    color_paths, depth_paths = list(paths[0][:6]), list(paths[1][:6])
    color_paths[3], depth_paths[3] = tmp_path / "color.png", tmp_path / "depth.png"
    Image.new("RGB", (CAMERA.width, CAMERA.height)).save(color_paths[3])
    empty = np.full((CAMERA.height, CAMERA.width), 65535, dtype=np.uint16)
    Image.fromarray(empty).save(depth_paths[3])
    graph = rgbd_graph(color_paths, depth_paths, CAMERA, RgbdConfig(keyframe_every=4))[0]
    weights = [edge.information[0, 0] for edge in graph.edges[:5]]
    assert max(weights[2:4]) < 0.01 * min(weights[0], weights[1], weights[4])
    np.testing.assert_array_equal(graph.edges[2].i_from_j, graph.edges[1].i_from_j)
    with_limit = rgbd_graph(paths[0][:2], paths[1][:2], CAMERA, RgbdConfig(max_depth_m=0.5))[0]
    assert with_limit.edges[0].information[0, 0] < 1e3


def test_depth_agreement_tells_right_from_wrong_motions():
    poses = straight_path(2, step_m=0.1, turn_deg=3.0).world_from_cam
    depth_i, depth_j = (cast(pose, PLANES)[0].astype(np.float32) for pose in poses)
    true = relative(poses[0], poses[1])
    fitness, rmse_m = depth_agreement(depth_i, depth_j, true, CAMERA, 0.05)
    assert fitness > 0.8
    assert rmse_m < 0.02
    ahead = pose_matrix(np.eye(3), [0, 0, 0.5]) @ true
    assert depth_agreement(depth_i, depth_j, ahead, CAMERA, 0.05)[0] < 0.2
    upside_down = pose_matrix(rotation_from_rpy([0, 0, np.pi]), 0) @ true
    assert depth_agreement(depth_i, depth_j, upside_down, CAMERA, 0.05)[0] < 0.4
    nothing = np.full_like(depth_i, np.inf)
    assert depth_agreement(nothing, depth_j, true, CAMERA, 0.05) == (0.0, np.inf)
    assert depth_agreement(depth_i, nothing, true, CAMERA, 0.05) == (0.0, np.inf)


def test_loop_candidates_are_keyframes_that_look_the_same_way():
    turned = pose_matrix(rotation_from_rpy([[0, 0, a] for a in (0, 0.3, np.pi, 0.1)]), np.zeros(3))
    poses = inverse(turned[0]) @ turned[[0, 0, 1, 1, 2, 2, 3, 3]]
    assert loop_candidates(poses, 2) == [(0, 2), (0, 6), (2, 6)]
    poses[6, :3, 3] = [5.0, 0, 0]
    assert loop_candidates(poses, 2) == [(0, 2)]


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
def test_a_damaged_image_is_named(method, kind, tmp_path):
    paths = write_room(tmp_path, [pose_at([-1.0, 0, 1.4])] * 3)
    bad = paths[kind][1]
    bad.write_bytes(bad.read_bytes()[:60] + bytes(200))
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


def test_only_a_motion_that_nothing_constrains_is_none(monkeypatch):
    """Open3D reports each of its errors as a RuntimeError."""

    def fail(**given):
        raise RuntimeError("[Open3D Error] out of memory")

    shape = (30, 40, 3)
    flat = frames.ScaledPoints(
        points=o3d.core.Tensor(np.full(shape, np.nan, np.float32)),
        normals=o3d.core.Tensor(np.full(shape, np.nan, np.float32)),
        intrinsics=o3d.core.Tensor(np.diag([50.0, 50.0, 1.0])),
    )
    surfaces = {stage.stride: flat for stage in frames.STAGES}
    assert frames.align(surfaces, surfaces, np.eye(4), 0.1) is None
    monkeypatch.setattr(o3d.t.pipelines.odometry, "compute_odometry_result_point_to_plane", fail)
    with pytest.raises(RuntimeError, match="out of memory"):
        frames.align(surfaces, surfaces, np.eye(4), 0.1)
