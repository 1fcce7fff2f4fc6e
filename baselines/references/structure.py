"""Structure-based localization: poses from matches with a map of 3D points.

As in Sattler et al. (PAMI 2017) and hloc (Sarlin et al., CVPR 2019): the training images that look
most alike are retrieved, features matched with theirs, and the camera pose found by P3P in
LO-RANSAC, then refined on the inliers (COLMAP's implementation). The map carries the errors of the
labels it is built from.
"""

from __future__ import annotations

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.references.correspondences import Correspondences
from baselines.references.evidence import Evidence
from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import inverse, pose_matrix

Array = NDArray[np.float64]

MAX_ERROR_PX = 4.0
# With noisy labels no share of inliers ends RANSAC early; more trials do not help then.
CONFIDENCE, MAX_TRIALS = 0.9999, 500
# Poses on fewer inliers than this are no better than guesses.
MIN_INLIERS = 8


def on_depth(evidence: Evidence) -> Array:
    """Poses (N, 4, 4) against features lifted by the training frames' depth; NaN where none."""
    places = lifted(evidence.correspondences, evidence.train)
    return localize(evidence.correspondences, places, evidence.camera, evidence.seed)


def lifted(matches: Correspondences, train: PoseTable) -> Array:
    """Where (C, 3) the depth of the training frames says matches lie in the world."""
    world_from_cam = train.world_from_cam[matches.train]
    with np.errstate(invalid="ignore"):  # no depth
        turned = np.einsum("cij,cj->ci", world_from_cam[:, :3, :3], matches.point_m)
    return np.asarray(turned + world_from_cam[:, :3, 3])


def localize(matches: Correspondences, point_m: Array, seen_by: CameraConfig, seed: int) -> Array:
    """Poses (N, 4, 4) of the test frames, NaN where none is found.

    Args:
        matches: of the test frames with the training frames.
        point_m: (C, 3) where the training feature of each match lies in the world; not finite where
            that is not known.
        seen_by: camera of the test frames.
        seed: of RANSAC.
    """
    camera = pinhole(seen_by)
    known = np.asarray(np.isfinite(point_m).all(axis=1))
    poses = np.full((len(matches), 4, 4), np.nan)
    for frame in range(len(matches)):
        usable = np.flatnonzero(known[matches.of(frame)]) + matches.start[frame]
        pixel = matches.slope[usable] * camera.params[:2]
        pose = absolute_pose(pixel, point_m[usable], camera, seed)
        if pose is not None:
            poses[frame] = pose
    return poses


def absolute_pose(
    pixel: Array,
    point_m: Array,
    camera: pycolmap.Camera,
    seed: int,
    max_error_px: float = MAX_ERROR_PX,
) -> Array | None:
    """``world_from_cam`` (4, 4) from points (n, 3) and where they are seen (n, 2), or None."""
    if len(pixel) < MIN_INLIERS:
        return None
    options = pycolmap.AbsolutePoseEstimationOptions()
    options.ransac.max_error = max_error_px
    options.ransac.confidence = CONFIDENCE
    options.ransac.max_num_trials = MAX_TRIALS
    options.ransac.random_seed = seed % 2**31
    found = pycolmap.estimate_and_refine_absolute_pose(pixel, point_m, camera, options)
    if found is None or found["num_inliers"] < MIN_INLIERS:
        return None
    cam_from_world = found["cam_from_world"].matrix()
    return inverse(pose_matrix(cam_from_world[:, :3], cam_from_world[:, 3]))


def pinhole(camera: CameraConfig) -> pycolmap.Camera:
    """A camera without distortion and with its principal point at (0, 0)."""
    fx, fy, _, _ = camera.intrinsics
    size = {"width": camera.width, "height": camera.height}
    return pycolmap.Camera(model="PINHOLE", params=[fx, fy, 0.0, 0.0], **size)
