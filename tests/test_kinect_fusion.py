"""KinectFusion on rooms whose depth is known in closed form."""

import numpy as np
import pytest

from baselines.groundtruth.kinect_fusion import kinect_fusion_batch
from synfeal.config.models import KinectFusionConfig
from synfeal.geometry.poses import pose_error, relative
from tests.room_scene import CAMERA, pose_at, write_room

CFG = KinectFusionConfig()
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


def test_a_camera_that_jumps_is_lost_and_stays_lost(easy, tmp_path):
    """Half a turn between two frames: what is seen then has nothing to do with the model."""
    away = np.array([pose_at([0.02 * k, 0.0, 1.4], yaw_deg=200 + k) for k in range(7)])
    far = write_room(tmp_path, away)
    paths = [[*before[:4], *after] for before, after in zip(easy, far, strict=True)]
    trajectory = kinect_fusion_batch(*paths, CAMERA, CFG)
    assert trajectory.registered.tolist() == [True] * 4 + [False] * 7
    np.testing.assert_array_equal(trajectory.first_from_cam[4:], np.tile(np.eye(4), (7, 1, 1)))


@pytest.mark.parametrize("sensor", ["ideal", "kinect"])
def test_the_same_frames_give_the_same_bytes(easy, sensor):
    cfg = CFG.model_copy(update={"sensor": sensor})
    paths = [kind[:6] for kind in easy]
    first, again = (kinect_fusion_batch(*paths, CAMERA, cfg, seed=3) for _ in range(2))
    assert first.first_from_cam.tobytes() == again.first_from_cam.tobytes()
    assert first.registered.tobytes() == again.registered.tobytes()
