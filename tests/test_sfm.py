import numpy as np
import pytest

from baselines.groundtruth.sfm import metric_scale, sfm_batch
from synfeal.config.models import SfmConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, relative
from tests.planar_scene import CAMERA, straight_path, write_frames

CFG = SfmConfig(max_features=400, peak_threshold=0.002)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    truth = straight_path(8, step_m=0.08, turn_deg=2.0).world_from_cam
    return write_frames(tmp_path_factory.mktemp("planes"), straight_path(8, 0.08, 2.0))[0], truth


@pytest.fixture(scope="module")
def estimate(frames, tmp_path_factory):
    return sfm_batch(*_arguments(frames), CFG, 0)[0]


def _arguments(frames):
    return frames[0], CAMERA, frames[1]


def test_every_frame_is_found_in_metres(frames, estimate):
    truth = frames[1]
    assert estimate.registered.all()
    position_m, orientation_rad = pose_error(estimate.first_from_cam, relative(truth[0], truth))
    assert position_m.max() < 0.01
    assert np.degrees(orientation_rad.max()) < 0.3


def test_missing_image_is_named(frames, tmp_path):
    missing = tmp_path / "frame-000000.color.png"
    with pytest.raises(InputError, match=r"frame-000000\.color\.png: no such image"):
        sfm_batch([missing], CAMERA, frames[1][:1], CFG, 0)


def test_scale_bears_wrong_poses_and_leaves_out_near_and_late_frames():
    true = np.column_stack([0.04 * np.arange(60), np.zeros(60), np.zeros(60)])
    model = true / 3
    model[1] = [9, 9, 9]  # 4 cm from the first frame
    model[44:] *= 5  # beyond the first 44 frames
    model[10:15] *= 7  # wrong, but a minority
    assert metric_scale(true, model) == pytest.approx(3.0)


def test_no_scale_without_motion():
    assert np.isnan(metric_scale(np.zeros((5, 3)), np.ones((5, 3))))
    assert np.isnan(metric_scale(np.eye(3), np.zeros((3, 3))))
