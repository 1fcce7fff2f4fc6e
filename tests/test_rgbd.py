import numpy as np
import pytest
from PIL import Image

from baselines.groundtruth.rgbd import dense, frames, rgbd_graph
from baselines.groundtruth.rgbd.dense import depth_agreement
from baselines.groundtruth.rgbd.frames import read_frame
from baselines.groundtruth.rgbd.tracks import FeatureOdometry, loop_candidates
from synfeal.config.models import RgbdConfig
from synfeal.geometry.poses import inverse, pose_error, pose_matrix, relative
from synfeal.geometry.rotations import rotation_from_rpy
from tests.planar_scene import CAMERA, depth_map, straight_path, write_frames
from tests.room_scene import CAMERA as ROOM_CAMERA
from tests.room_scene import pose_at, write_room

CFG = RgbdConfig(keyframe_every=3)
TRUTH = straight_path(10, step_m=0.06, turn_deg=2.0)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    return write_frames(tmp_path_factory.mktemp("planes"), TRUTH)


@pytest.fixture(scope="module")
def graph(paths):
    return rgbd_graph(*paths, CAMERA, CFG)[0]


def true_first_from_cam():
    poses = TRUTH.world_from_cam
    return relative(poses[0], poses)


def test_neighbours_and_loop_closures_are_measured(graph):
    pairs = [(edge.i, edge.j) for edge in graph.edges]
    assert pairs[:9] == [(k, k + 1) for k in range(9)]
    assert len(pairs) > 9
    assert all(i % 3 == 0 and j % 3 == 0 and j > i for i, j in pairs[9:])
    truth = true_first_from_cam()
    for edge in graph.edges:
        error_m, error_rad = pose_error(edge.i_from_j, relative(truth[edge.i], truth[edge.j]))
        assert error_m < 0.02
        assert np.degrees(error_rad) < 0.5


def test_odometry_drifts_by_less_than_a_percent_of_the_way(tmp_path):
    """Without closures, along 1.2 m before furniture; start and end of a bend included."""
    step = np.arange(41)
    poses = np.array(
        [
            pose_at([-1.8 + 0.03 * k, 0.1 * np.sin(k / 8), 1.4], yaw_deg=10 * np.sin(k / 10))
            for k in step
        ]
    )
    paths = write_room(tmp_path, poses)
    graph = rgbd_graph(*paths, ROOM_CAMERA, RgbdConfig(loops_per_keyframe=0))[0]
    way_m = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum()
    assert way_m > 1.2
    assert [(edge.i, edge.j) for edge in graph.edges] == [(k, k + 1) for k in step[:-1]]
    error_m, error_rad = pose_error(graph.first_from_cam, relative(poses[0], poses))
    assert error_m.max() < 0.01 * way_m
    assert np.degrees(error_rad.max()) < 0.5


def test_steps_of_one_scale_end_where_open3ds_own_loop_ends(tmp_path, monkeypatch):
    poses = np.array([pose_at([-1.8, 0.0, 1.4]), pose_at([-1.78, 0.01, 1.4], yaw_deg=0.3)])
    colors, depths = write_room(tmp_path, poses)
    i, j = (read_frame(*pair, ROOM_CAMERA, CFG, 0) for pair in zip(colors, depths, strict=True))
    stage = frames.Stage(stride=1, max_steps=8, huber_m=0.05, rest_m=0.0, rest_deg=0.0)
    monkeypatch.setattr(frames, "STAGES", (stage,))
    monkeypatch.setattr(dense, "_PASSES", (((8,), 0.05),))
    theirs = dense.register(i.rgbd, j.rgbd, np.eye(4), ROOM_CAMERA, CFG)
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


def test_features_find_a_large_turn(tmp_path):
    """Twelve degrees between two frames, more than direct odometry bears."""
    truth = straight_path(2, step_m=0.1, turn_deg=12.0)
    color_paths, depth_paths = write_frames(tmp_path, truth)
    odometry = FeatureOdometry(CAMERA)
    features = [
        odometry.features(
            np.asarray(Image.open(color).convert("L")),
            np.asarray(Image.open(depth)).astype(np.float32) / 1000,
        )
        for color, depth in zip(color_paths, depth_paths, strict=True)
    ]
    found = odometry.motion(*features)
    assert found is not None
    poses = truth.world_from_cam
    error_m, error_rad = pose_error(found[0], relative(poses[0], poses[1]))
    assert error_m < 0.03
    assert np.degrees(error_rad) < 1.0
    assert found[1] >= 12


def test_depth_agreement_tells_right_from_wrong_motions():
    poses = straight_path(2, step_m=0.1, turn_deg=3.0).world_from_cam
    depth_i, depth_j = (depth_map(pose, CAMERA)[0].astype(np.float32) for pose in poses)
    true = relative(poses[0], poses[1])
    fitness, rmse_m = depth_agreement(depth_i, depth_j, true, CAMERA, 0.05)
    assert fitness > 0.8
    assert rmse_m < 0.02
    ahead = pose_matrix(np.eye(3), [0, 0, 0.5]) @ true
    assert depth_agreement(depth_i, depth_j, ahead, CAMERA, 0.05)[0] < 0.2
    behind = (
        pose_matrix(rotation_from_rpy([0, 0, np.pi]) @ rotation_from_rpy([0, 0, 0]).T, 0) @ true
    )
    assert depth_agreement(depth_i, depth_j, behind, CAMERA, 0.05)[0] < 0.2
    nothing = np.full_like(depth_i, np.inf)
    assert depth_agreement(nothing, depth_j, true, CAMERA, 0.05) == (0.0, np.inf)
    assert depth_agreement(depth_i, nothing, true, CAMERA, 0.05) == (0.0, np.inf)


def test_loop_candidates_are_keyframes_that_look_the_same_way():
    turned = pose_matrix(rotation_from_rpy([[0, 0, a] for a in (0, 0.3, np.pi, 0.1)]), np.zeros(3))
    poses = inverse(turned[0]) @ turned[[0, 0, 1, 1, 2, 2, 3, 3]]
    assert loop_candidates(poses, 2) == [(0, 2), (0, 6), (2, 6)]
    poses[6, :3, 3] = [5.0, 0, 0]
    assert loop_candidates(poses, 2) == [(0, 2)]
