"""Motion between two RGB-D frames from image features, robust to large rotations.

SIFT features of one frame are lifted to 3D with its depth and found again in the other; the pose
follows from perspective-n-point with RANSAC. This is how RTAB-Map starts its odometry too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pycolmap
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig
from synfeal.geometry.poses import inverse, pose_matrix

Array = NDArray[np.float64]

_MAX_FEATURES = 500
_MAX_ERROR_PX = 2.0
_MIN_MATCHES = 6


@dataclass(frozen=True)
class FrameFeatures:
    """Features of one frame."""

    keypoints: pycolmap.FeatureKeypoints  # as pycolmap's matcher takes them
    descriptors: pycolmap.FeatureDescriptors  # likewise
    pixel: Array  # (k, 2) positions in the image
    point_m: Array  # (k, 3) in camera coordinates; not finite where there is no depth


class FeatureOdometry:
    """Finds features and the motion between frames; holds the extractor and the matcher."""

    def __init__(self, camera: CameraConfig) -> None:
        pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
        extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
        extraction.sift.max_num_features = _MAX_FEATURES
        matching = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
        self._extractor = pycolmap.FeatureExtractor.create(extraction, pycolmap.Device.cpu)
        self._matcher = pycolmap.FeatureMatcher.create(matching, pycolmap.Device.cpu)
        fx, fy, cx, cy = camera.intrinsics
        self._focal_px, self._centre_px = np.array([fx, fy]), np.array([cx, cy])
        self._camera = pycolmap.Camera(
            model="PINHOLE",
            width=camera.width,
            height=camera.height,
            params=[fx, fy, cx, cy],
        )
        self._estimation = pycolmap.AbsolutePoseEstimationOptions()
        self._estimation.ransac.max_error = _MAX_ERROR_PX
        self._estimation.ransac.random_seed = 0

    def features(self, grey: NDArray[np.uint8], depth_m: NDArray[np.float32]) -> FrameFeatures:
        """Features of a grey image (H, W) with depth (H, W) along the optical axis, inf = none."""
        keypoints, descriptors = self._extractor.extract_from_uint8_array(grey)
        pixel = pycolmap.keypoints_to_matrix(keypoints)[:, :2].astype(np.float64).reshape(-1, 2)
        column, row = np.floor(pixel).astype(int).T
        height, width = depth_m.shape
        z = depth_m[row.clip(0, height - 1), column.clip(0, width - 1)].astype(np.float64)
        ray = np.column_stack([(pixel - self._centre_px) / self._focal_px, np.ones(len(pixel))])
        with np.errstate(invalid="ignore"):  # 0 * inf on the optical axis of an empty pixel
            point_m = ray * z[:, None]
        return FrameFeatures(keypoints, descriptors, pixel, point_m)

    def motion(self, i: FrameFeatures, j: FrameFeatures) -> tuple[Array, int] | None:
        """``i_from_j`` (4, 4) and its inliers, or None when no pose is found."""
        if min(len(i.pixel), len(j.pixel)) < _MIN_MATCHES:
            return None
        found = self._matcher.match(i.keypoints, i.descriptors, j.keypoints, j.descriptors)
        matches = np.asarray(found, dtype=np.int64).reshape(-1, 2)
        matches = matches[np.isfinite(i.point_m[matches[:, 0]]).all(axis=1)]
        if len(matches) < _MIN_MATCHES:
            return None
        result = pycolmap.estimate_and_refine_absolute_pose(
            j.pixel[matches[:, 1]], i.point_m[matches[:, 0]], self._camera, self._estimation
        )
        if result is None:
            return None
        j_from_i = result["cam_from_world"].matrix()
        return inverse(pose_matrix(j_from_i[:, :3], j_from_i[:, 3])), int(result["num_inliers"])
