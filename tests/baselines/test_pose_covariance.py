"""Covariance of poses: derivatives by finite differences, spreads by drawing noise many times."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.references.pose_covariance import pose_covariance, projected, spread_of
from baselines.references.structure import pinhole, supported_pose
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import pose_error, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy

CAMERA = CameraConfig(width=320, height=240, fx=290.0, fy=280.0, cx=160.0, cy=120.0)
FOCAL_PX = np.array([290.0, 280.0])
POSE = pose_matrix(rotation_from_rpy([0.2, -0.3, 1.1]), [1.0, -2.0, 1.5])


def points(count, seed=0):
    """Points (count, 3) before the camera, in the world."""
    rng = np.random.default_rng(seed)
    depth_m = rng.uniform(1.5, 5.0, (count, 1))
    slope = rng.uniform([-0.5, -0.4], [0.5, 0.4], (count, 2))
    in_cam = np.concatenate([slope, np.ones((count, 1))], axis=1) * depth_m
    return in_cam @ POSE[:3, :3].T + POSE[:3, 3]


def moved(motion):
    """The pose after a shift and a turn along the axes of the world."""
    pose = POSE.copy()
    pose[:3, :3] = Rotation.from_rotvec(motion[3:]).as_matrix() @ POSE[:3, :3]
    pose[:3, 3] += motion[:3]
    return pose


def test_derivatives_are_those_of_finite_differences():
    point_m, step = points(30), 1e-6
    _, found = projected(point_m, POSE, FOCAL_PX)
    for axis in range(6):
        ahead, behind = (
            projected(point_m, moved(sign * step * np.eye(6)[axis]), FOCAL_PX)[0]
            for sign in (1, -1)
        )
        np.testing.assert_allclose(found[:, :, axis], (ahead - behind) / (2 * step), atol=1e-4)


def drawn(noise, n_points, times, seed):
    """Spreads stated and errors made, each (times, 2), of poses found from disturbed pixels."""
    rng = np.random.default_rng(seed)
    point_m = points(n_points)
    true_px, _ = projected(point_m, POSE, FOCAL_PX)
    own = np.arange(n_points)
    stated, errors = [], []
    for _ in range(times):
        pixel, place_m, cluster = noise(rng, true_px, point_m, own)
        found = supported_pose(pixel, place_m, pinhole(CAMERA), seed=1, max_error_px=6.0)
        good = found.inlier
        covariance = pose_covariance(
            pixel[good], place_m[good], found.world_from_cam, FOCAL_PX, cluster[good]
        )
        stated.append(spread_of(covariance))
        error_m, error_rad = pose_error(found.world_from_cam, POSE)
        errors.append((float(error_m), float(np.degrees(error_rad))))
    return np.array(stated), np.array(errors)


def independent(rng, true_px, point_m, own):
    """Independent noise of a third of a pixel."""
    return true_px + 0.33 * rng.normal(size=true_px.shape), point_m, own


def repeated(rng, true_px, point_m, own):
    """The same, but every feature is matched nine times from one place."""
    pixel, _, _ = independent(rng, true_px, point_m, own)
    return (np.repeat(each, 9, axis=0) for each in (pixel, point_m, own))


def with_outliers(rng, true_px, point_m, own):
    """A third of the matches are wrong."""
    pixel, _, _ = independent(rng, true_px, point_m, own)
    wrong = rng.permutation(len(pixel))[: len(pixel) // 3]
    pixel[wrong] = rng.uniform([-160, -120], [160, 120], (len(wrong), 2))
    return pixel, point_m, own


@pytest.mark.parametrize("noise", [independent, repeated, with_outliers])
def test_spreads_are_those_of_errors_under_known_noise(noise):
    stated, errors = drawn(noise, 60, 150, 3)
    ratio = np.sqrt((errors**2).mean(axis=0) / (stated**2).mean(axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.2)


def test_repeated_matches_are_no_more_evidence():
    """Taken for independent, nine times the matches would look three times as exact."""
    rng = np.random.default_rng(4)
    point_m, own = points(60), np.arange(60)
    pixel, _, _ = independent(rng, projected(point_m, POSE, FOCAL_PX)[0], point_m, own)
    once = pose_covariance(pixel, point_m, POSE, FOCAL_PX, own)
    nine = [np.repeat(each, 9, axis=0) for each in (pixel, point_m)]
    freedom = (2 * 60 - 6) / (2 * 540 - 6) * 9
    clustered = pose_covariance(*nine, POSE, FOCAL_PX, np.repeat(own, 9))
    alone = pose_covariance(*nine, POSE, FOCAL_PX, np.arange(540))
    np.testing.assert_allclose(clustered, once * freedom, rtol=1e-6)
    np.testing.assert_allclose(alone, once * freedom / 9, rtol=1e-6)


def test_a_motion_that_matches_leave_free_has_no_bound():
    """Points in one place say nothing of most motions."""
    point_m = np.repeat(points(1), 12, axis=0)
    pixel, _ = projected(point_m, POSE, FOCAL_PX)
    spread = spread_of(pose_covariance(pixel + 0.1, point_m, POSE, FOCAL_PX, np.arange(12)))
    assert spread.position_m == np.inf
    assert spread.orientation_deg == np.inf
