"""Recalls, means and reprojection errors with known answers, and beside second implementations."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.evaluation.metrics import BOUNDS, joint_error, summary, within
from synfeal.evaluation.reprojection import (
    CELLS,
    cell_centres_px,
    cell_depth_m,
    dcre,
    dcre_summary,
    read_cell_depth,
    write_cell_depth,
)
from synfeal.geometry.poses import pose_matrix
from synfeal.mesh.rays import RayCaster
from tests.support.property_support import table_of

CAMERA = CameraConfig(width=128, height=96, horizontal_fov_deg=60.0)
LENS = CAMERA.model_copy(update={"distortion": (0.1, -0.05, 0.001, -0.002, 0.01)})


# By hand: metres, degrees, and which of the bounds they are within. An error that meets its bound
# exactly is outside, as in hloc's and ACE's evaluation.
FRAMES = (
    (0.0, 0.0, "1 1 1 1 1 1"),
    (0.049, 4.9, "1 1 0 1 1 1"),
    (0.05, 1.0, "0 1 1 1 1 1"),
    (0.01, 5.0, "0 0 0 0 1 1"),
    (0.2499, 1.9, "0 0 1 1 1 1"),
    (0.4, 4.0, "0 0 0 1 1 1"),
    (0.4, 14.9, "0 0 0 0 1 0"),
    (4.9, 9.9, "0 0 0 0 0 1"),
    (5.0, 9.0, "0 0 0 0 0 0"),
    (np.inf, np.inf, "0 0 0 0 0 0"),
)


def test_recalls_of_known_frames_and_their_limits():
    position_m, orientation_deg, bounds = zip(*FRAMES, strict=True)
    errors = {"position_m": np.array(position_m), "orientation_deg": np.array(orientation_deg)}
    expected = np.array([line.split() for line in bounds]).astype(int)
    for column, bound in enumerate(BOUNDS):
        np.testing.assert_array_equal(within(errors, bound), expected[:, column])
    found = summary(errors, np.arange(len(FRAMES)))
    for column, bound in enumerate(BOUNDS):
        assert found[bound.name] == pytest.approx(expected[:, column].mean())
    assert found["position_m"] == pytest.approx((0.2499 + 0.4) / 2)
    assert found["position_m_mean"] is None  # one frame has no pose
    np.testing.assert_allclose(joint_error(errors)[[0, 1, 7]], [0.0, 4.9, 490.0])
    # Of 400 independent frames: the normal approximation to the binomial.
    inside = np.arange(400) < 120
    errors = {"position_m": np.where(inside, 0.0, 9.0), "orientation_deg": np.zeros(400)}
    found = summary(errors, np.arange(400))
    half = 1.96 * np.sqrt(0.3 * 0.7 / 400)
    assert found["recall_5cm_5deg_low"] == pytest.approx(0.3 - half, abs=0.01)
    assert found["recall_5cm_5deg_high"] == pytest.approx(0.3 + half, abs=0.01)
    lumped = summary(errors, np.arange(400) // 20)  # twenty paths of like frames say less
    assert lumped["recall_5cm_5deg_low"] < 0.3 - 2 * half


def random_poses(count, spread_m, angle_deg, seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(np.radians(angle_deg) * rng.normal(size=(count, 3)))
    return pose_matrix(turn.as_matrix(), spread_m * rng.normal(size=(count, 3)))


def by_opencv(predicted, reference, depth_m, camera):
    """DCRE of one frame, point by point; OpenCV lifts and projects."""
    matrix = camera.intrinsics.matrix()
    lens = np.array(camera.distortion)
    errors = []
    for pixel, z_m in zip(cell_centres_px(camera, *CELLS).reshape(-1, 2), depth_m, strict=True):
        if not np.isfinite(z_m):
            continue
        criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-14)
        x, y = cv2.undistortPoints(pixel[None], matrix, lens, criteria=criteria).ravel()
        world = reference @ [x * z_m, y * z_m, z_m, 1.0]
        cam_from_world = np.linalg.inv(predicted)
        if (cam_from_world @ world)[2] <= 0:
            errors.append(1.0)
            continue
        rotation = cv2.Rodrigues(cam_from_world[:3, :3])[0]
        moved = cv2.projectPoints(world[None, :3], rotation, cam_from_world[:3, 3], matrix, lens)[0]
        distance = np.linalg.norm(moved.ravel() - pixel) / np.hypot(camera.width, camera.height)
        errors.append(min(distance, 1.0))
    return float(np.mean(errors))


@pytest.mark.parametrize("camera", [CAMERA, LENS], ids=["pinhole", "lens"])
@pytest.mark.parametrize(("error_m", "error_deg"), [(0.01, 0.3), (0.3, 5.0), (1.0, 40.0)])
def test_dcre_is_that_of_opencv(camera, error_m, error_deg):
    reference = random_poses(12, 2.0, 180.0, seed=1)
    predicted = reference @ random_poses(12, error_m, error_deg, seed=2)
    rng = np.random.default_rng(3)
    depth_m = rng.uniform(0.5, 6.0, (12, CELLS[0] * CELLS[1]))
    depth_m[rng.random(depth_m.shape) < 0.2] = np.inf
    found = dcre(table_of(predicted), table_of(reference), depth_m, camera)
    frames = zip(predicted, reference, depth_m, strict=True)
    expected = [by_opencv(*frame, camera) for frame in frames]
    # Far outside of the image a lens may fold over: there both saturate, at slightly other points.
    tolerance = 1e-9 if camera is CAMERA else 2e-2
    np.testing.assert_allclose(found, expected, atol=tolerance)


def test_cell_depth_of_a_wall_and_of_nothing(tmp_path):
    """A wall 3 m ahead is 3 m deep in every cell; turned away there is nothing."""
    wall = np.array([[-50, -50, 3], [50, -50, 3], [50, 50, 3], [-50, 50, 3]], float)
    caster = RayCaster(wall, [[0, 1, 2], [0, 2, 3]])
    away = np.diag([-1.0, 1.0, -1.0, 1.0])
    depth_m = cell_depth_m(caster, CAMERA, np.stack([np.eye(4), away]))
    np.testing.assert_allclose(depth_m[0], 3.0, rtol=1e-5)
    assert np.isinf(depth_m[1]).all()
    path = tmp_path / "depth.npy"
    write_cell_depth(path, depth_m)
    np.testing.assert_array_equal(read_cell_depth(path, 2), np.round(depth_m, 3))
    with pytest.raises(InputError, match="holds 2 frames, 3 are needed"):
        read_cell_depth(path, 3)
    path.write_bytes(b"junk")
    with pytest.raises(InputError, match="cannot be read as depths"):
        read_cell_depth(path, 1)


def test_dcre_summary_leaves_out_frames_that_show_nothing():
    errors = np.array([0.01, 0.04, 0.05, 0.2, np.inf, np.nan])
    found = dcre_summary(errors, np.arange(6), "_true")
    assert found["dcre_true"] == 0.05
    assert found["dcre_below_0.05_true"] == pytest.approx(2 / 5)
    assert found["dcre_below_0.15_true"] == pytest.approx(3 / 5)
    assert dcre_summary(np.full(3, np.nan), np.arange(3)) == {}
