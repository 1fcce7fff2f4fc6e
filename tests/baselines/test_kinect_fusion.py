"""KinectFusion on rooms whose depth is known in closed form, and its sensor beside its noise."""

from pathlib import Path

import numpy as np
import pytest

from baselines.config.labels import KinectFusionConfig
from baselines.labels.kinect_fusion import MIN_CONSTRAINT, kinect_fusion_batch
from baselines.labels.projective_icp import pyramid_of, register
from baselines.labels.rgbd.frames import NOISE_STEPS, STEP_PER_M, frame_generator, kinect_depth
from synfeal.geometry.poses import pose_error, relative
from tests.support.room_scene import CAMERA, FURNISHED, Room, cast, pose_at, write_room

# Pixels of these small frames are 2 cm apart on a wall 3 m away: smaller voxels would have holes.
CFG = KinectFusionConfig(voxel_m=0.02)
EASY = np.array([pose_at([-1.2 + 0.02 * k, 0.01 * k, 1.4], yaw_deg=10 + k) for k in range(12)])


@pytest.fixture(scope="module")
def easy(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("easy"), EASY)


def test_a_slow_camera_before_furniture_is_tracked(easy):
    """To within one and a half voxels, 3 cm."""
    trajectory = kinect_fusion_batch(*easy, CAMERA, CFG)
    assert trajectory.registered.all()
    error_m, error_rad = pose_error(trajectory.first_from_cam, relative(EASY[0], EASY))
    assert error_m.max() < 1.5 * CFG.voxel_m
    assert np.degrees(error_rad.max()) < 0.5


def lined_room():
    """Boxes along all walls, on the floor or at eye height, so that every view has sides to see."""
    rng = np.random.default_rng(0)
    along_x = [(x, y) for x in np.arange(-2.9, 2.5) for y in (-2.5, 2.5)]
    along_y = [(x, y) for y in np.arange(-1.8, 1.3) for x in (-3.0, 3.0)]
    boxes = [FURNISHED.boxes[0]]
    for x, y in along_x + along_y:
        width, depth = rng.uniform([0.3, 0.6], [0.6, 1.0])[:: 1 if abs(y) == 2.5 else -1]
        low = np.array([min(x, 3.0 - width), min(y, 2.5 - depth), rng.choice([0.0, 1.1])])
        boxes.append((tuple(low), tuple(low + np.array([width, depth, rng.uniform(0.5, 1.1)]))))
    return Room(tuple(boxes), plain=True)


@pytest.mark.slow
def test_a_batch_as_long_as_the_papers_is_tracked_to_its_end(tmp_path):
    """250 frames 3 cm apart that look once all around: 7.5 m, within one and a half voxels."""
    turn = np.linspace(0, 2 * np.pi, 251)
    around = np.stack([np.cos(turn), np.sin(turn), 0.1 * np.sin(2 * turn)], axis=1)
    position_m = [0.0, 0.0, 1.3] + 1.19 * around
    poses = zip(position_m, 180 + np.degrees(turn), strict=True)
    true = np.array([pose_at(position, yaw_deg) for position, yaw_deg in poses])
    assert np.linalg.norm(np.diff(position_m, axis=0), axis=1).mean() == pytest.approx(
        0.03, abs=3e-4
    )
    trajectory = kinect_fusion_batch(*write_room(tmp_path, true, lined_room()), CAMERA, CFG)
    assert trajectory.registered.all()
    error_m, error_rad = pose_error(trajectory.first_from_cam, relative(true[0], true))
    assert error_m.max() < 1.5 * CFG.voxel_m
    assert np.degrees(error_rad.max()) < 1.0


def test_a_camera_that_jumps_is_lost_and_stays_lost(easy, tmp_path):
    """Half a turn between two frames: what is seen then has nothing to do with the model."""
    away = np.array([pose_at([0.02 * k, 0.0, 1.4], yaw_deg=200 + k) for k in range(7)])
    far = write_room(tmp_path, away)
    paths = [[*before[:4], *after] for before, after in zip(easy, far, strict=True)]
    trajectory = kinect_fusion_batch(*paths, CAMERA, CFG)
    assert trajectory.registered.tolist() == [True] * 4 + [False] * 7
    np.testing.assert_array_equal(trajectory.first_from_cam[4:], np.tile(np.eye(4), (7, 1, 1)))


@pytest.mark.parametrize("room", [FURNISHED, lined_room()], ids=["furnished", "lined"])
def test_registration_is_exact_where_it_says_that_surfaces_constrain_it(room):
    """All around: to a millimetre, or sliding along a wall, and then known to be free to."""
    known = 0
    for yaw_deg in range(0, 360, 45):
        still = pose_at([-1.2, 0, 1.4], yaw_deg)
        moved = pose_at([-1.172, 0.015, 1.4], yaw_deg + 1.5)
        depths_m = (cast(pose, room)[0].astype(np.float32) for pose in (still, moved))
        motion, constraint = register(*(pyramid_of(d, CAMERA) for d in depths_m), CAMERA)
        error_m, error_rad = pose_error(motion, relative(still, moved))
        if constraint >= MIN_CONSTRAINT:
            known += 1
            assert error_m < 0.001
            assert np.degrees(error_rad) < 0.02
    assert 4 <= known < 8


def measured(depth_m):
    depth = np.full((400, 500), depth_m, dtype=np.float32)
    return kinect_depth(depth, np.random.default_rng(0))


@pytest.mark.parametrize("depth_m", [0.6, 1.0, 2.0, 3.3, 4.4])
def test_deviation_grows_with_the_square_of_the_depth(depth_m):
    """Noise of half a step and rounding, of variance 1/12 step, over the slope of 1/z."""
    expected_m = depth_m**2 * STEP_PER_M * np.sqrt(NOISE_STEPS**2 + 1 / 12)
    z = measured(depth_m)
    assert z.std() == pytest.approx(expected_m, rel=0.05)
    assert z.mean() == pytest.approx(depth_m, abs=0.02 * expected_m + expected_m**2 / depth_m * 2)


def test_disparity_is_whole_steps():
    steps = 1 / (measured(2.0).astype(np.float64) * STEP_PER_M)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-4)
    assert len(np.unique(np.round(steps))) > 1


@pytest.mark.parametrize("depth_m", [0.4, 0.49, 4.6, 20.0, np.inf])
def test_nothing_is_seen_out_of_range(depth_m):
    assert np.isinf(measured(depth_m)).all()


def test_noise_belongs_to_the_frame_and_the_seed():
    depth = np.full((8, 9), 3.0, dtype=np.float32)

    def noise(seed, path):
        return kinect_depth(depth, frame_generator(seed, Path(path)))

    first = noise(1, "a/seq-01/frame-000000.depth.png")
    np.testing.assert_array_equal(first, noise(1, "b/seq-01/frame-000000.depth.png"))
    assert (first != noise(1, "a/seq-01/frame-000001.depth.png")).any()
    assert (first != noise(2, "a/seq-01/frame-000000.depth.png")).any()
