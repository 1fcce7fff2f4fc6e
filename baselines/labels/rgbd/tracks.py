"""Motions between neighbouring frames, and between keyframes that view the same place.

Where depth does not tell them, SIFT features of one frame are lifted to 3D with its depth and found
again in the other; the pose follows from perspective-n-point with RANSAC. This is how RTAB-Map
starts its odometry too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pycolmap
from numpy.typing import NDArray
from PIL import Image

from baselines.labels.rgbd.dense import SURE_AGREEMENT, DenseOdometry, Motion
from baselines.labels.rgbd.frames import RgbdFrame
from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import inverse, pose_matrix

Array = NDArray[np.float64]

_MAX_FEATURES = 500
_MAX_ERROR_PX = 2.0
_MIN_MATCHES = 6


@dataclass(frozen=True)
class FrameFeatures:
    """Features of one frame.

    Attributes:
        keypoints: Keypoints as pycolmap's matcher takes them.
        descriptors: Their descriptors.
        pixel: Positions (k, 2) in the image.
        point_m: Positions (k, 3) in camera coordinates; not finite where there is no depth.
    """

    keypoints: pycolmap.FeatureKeypoints
    descriptors: pycolmap.FeatureDescriptors
    pixel: Array
    point_m: Array


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
            model="PINHOLE", width=camera.width, height=camera.height, params=[fx, fy, cx, cy]
        )
        self._estimation = pycolmap.AbsolutePoseEstimationOptions()
        self._estimation.ransac.max_error = _MAX_ERROR_PX
        self._estimation.ransac.random_seed = 0

    def features(self, grey: NDArray[np.uint8], depth_m: NDArray[np.float32]) -> FrameFeatures:
        """Extract features of a grey image (H, W) with depth (H, W) in metres, inf for none."""
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
        """Find ``i_from_j`` (4, 4) and its inliers, or None when no pose is found."""
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


# Inliers below which features are no starting point for a neighbour, and for a loop closure.
_MIN_INLIERS, _MIN_LOOP_INLIERS = 8, 12


@dataclass(frozen=True)
class TrackedFrame:
    """A frame and what is found out about it once, when it is needed."""

    frame: RgbdFrame
    dense: DenseOdometry
    by_features: FeatureOdometry

    @cached_property
    def features(self) -> FrameFeatures:
        """Extract features of the colour image."""
        grey = np.asarray(Image.fromarray(self.frame.color).convert("L"))
        return self.by_features.features(grey, self.frame.depth_m)

    @cached_property
    def constrained(self) -> bool:
        """Check that dense odometry can tell every motion from this view."""
        return self.dense.constrained(self.frame)

    def from_features(self, other: TrackedFrame, min_inliers: int) -> Array | None:
        """Find the motion ``self_from_other`` (4, 4) by features alone, or None."""
        found = self.by_features.motion(self.features, other.features)
        return found[0] if found and found[1] >= min_inliers else None


def neighbour(i: TrackedFrame, j: TrackedFrame, previous: Array) -> tuple[Array, bool]:
    """Find the motion between neighbours by depth or, where that cannot tell it, by features.

    Args:
        i: The earlier frame.
        j: The frame after it.
        previous: Motion (4, 4) of the pair before, a starting point if the settings say so.

    Returns:
        ``i_from_j`` (4, 4), and whether it was accepted. One that was not is only a guess: the
        motion by features, or ``previous``.
    """
    if not (i.constrained and j.constrained):
        return _by_features(i, j, previous)
    best: Motion | None = None
    if i.dense.cfg.start != "features":
        start = previous if i.dense.cfg.start == "motion" else np.eye(4)
        best = i.dense.refine(i.frame, j.frame, start)
    if best is not None and best.agreement >= SURE_AGREEMENT:
        return best.i_from_j, True
    by_features = i.from_features(j, _MIN_INLIERS)
    start = previous if by_features is None else by_features
    found = i.dense.refine(i.frame, j.frame, start)
    candidates = [motion for motion in (best, found) if motion is not None]
    if not candidates:
        return start, False
    return max(candidates, key=lambda motion: motion.agreement).i_from_j, True


def _by_features(i: TrackedFrame, j: TrackedFrame, previous: Array) -> tuple[Array, bool]:
    """Estimate a motion by features alone in front of a surface that depth slides along.

    Open3D compares colours at whole pixels and would move it away again.
    """
    found = i.from_features(j, _MIN_INLIERS)
    if found is None:
        return previous, False
    return found, i.dense.overlap(i.frame, j.frame, found) > 0


def closure(i: TrackedFrame, j: TrackedFrame, predicted: Array | None) -> Array | None:
    """Find the motion between two keyframes that may view the same place.

    Args:
        i: The earlier keyframe.
        j: The later one.
        predicted: Motion ``i_from_j`` (4, 4) by odometry, from which depth is registered; None
            where odometry was interrupted between the two, so that features have to give one.

    Returns:
        ``i_from_j`` (4, 4); None where no motion is accepted.
    """
    if not (i.constrained and j.constrained):
        found = i.from_features(j, _MIN_LOOP_INLIERS)
        return found if found is not None and i.dense.overlap(i.frame, j.frame, found) else None
    start = i.from_features(j, _MIN_LOOP_INLIERS) if predicted is None else predicted
    if start is None:
        return None
    motion = i.dense.refine(i.frame, j.frame, start)
    return None if motion is None else motion.i_from_j


# Keyframes are compared when their optical axes and positions are at most this far apart.
_LOOP_MAX_DEG, _LOOP_MAX_M = 45.0, 2.0


def loop_candidates(first_from_cam: Array, keyframe_every: int) -> list[tuple[int, int]]:
    """List pairs of keyframes, i < j - 1, whose views may overlap by their poses (n, 4, 4)."""
    keyframes = np.arange(0, len(first_from_cam), keyframe_every)
    position_m, axis = first_from_cam[keyframes, :3, 3], first_from_cam[keyframes, :3, 2]
    distance_m = np.linalg.norm(position_m[:, None] - position_m, axis=-1)
    near = (distance_m <= _LOOP_MAX_M) & (axis @ axis.T >= np.cos(np.radians(_LOOP_MAX_DEG)))
    i, j = keyframes[np.array(np.nonzero(np.triu(near, 1)))]
    return [(int(a), int(b)) for a, b in zip(i, j, strict=True) if b - a > 1]


def most_telling(
    candidates: Sequence[tuple[int, int]], overlap: Callable[[int, int], float], per_keyframe: int
) -> list[tuple[int, int]]:
    """Keep for each later keyframe its earliest partners: they take away the most drift.

    Args:
        candidates: Pairs (i, j) of keyframes, i < j, ordered by i.
        overlap: Returns for a pair the share of image j that image i shows, 0 where it is not worth
            trying.
        per_keyframe: Most partners of one later keyframe.

    Returns:
        The pairs kept, in the order of ``candidates``.
    """
    chosen: dict[int, int] = {}
    kept = []
    for i, j in candidates:
        if chosen.get(j, 0) < per_keyframe and overlap(i, j) > 0:
            chosen[j] = chosen.get(j, 0) + 1
            kept.append((i, j))
    return kept
