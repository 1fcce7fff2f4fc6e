"""Settings of a scan that follow from the capture: range, stride, voxel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synfeal.dataset.images import read_image
from synfeal.dataset.posed_sequence import PosedFrames

# More frames than this add minutes and little surface; below the other number none can be spared.
MOST_FUSED, FEWEST_SPARED = 400, 200
# Depth beyond is noise on the sensors of phones and of Kinects.
NEAREST_RANGE_M, FARTHEST_RANGE_M = 3.0, 6.0
RANGE_PERCENTILE = 98.0
N_SAMPLED = 24
# A centimetre shows the letters of a poster at two metres; a corridor of it is too many triangles.
FINE_M, COARSE_M, LARGE_EXTENT_M = 0.01, 0.02, 12.0


@dataclass(frozen=True)
class ScanChoice:
    """Settings of the scan of a capture.

    Attributes:
        stride: Every so many frames are fused.
        max_depth_m: Depth beyond is left out.
        voxel_m: Edge of a voxel.
        extent_m: Longest side of the box that the cameras of the capture were in.
    """

    stride: int
    max_depth_m: float
    voxel_m: float
    extent_m: float


def stride_of(count: int) -> int:
    """Return that every so many of ``count`` frames are fused."""
    stride = math.ceil(count / MOST_FUSED)
    return stride if count < FEWEST_SPARED else max(2, stride)


def choose(frames: PosedFrames, depth_focal_px: float, units_per_m: float = 1000.0) -> ScanChoice:
    """Choose how a capture is scanned.

    The voxel is what a pixel of depth covers at the median depth, within bounds.

    Args:
        frames: Frames of the capture, with depth images.
        depth_focal_px: Focal length of the depth camera.
        units_per_m: Stored value of a depth of one metre.
    """
    sampled = np.unique(np.linspace(0, len(frames) - 1, N_SAMPLED).astype(np.int64))
    files = [frames.depth[index] for index in sampled]
    images = [np.asarray(read_image(file), np.float64) for file in files if file is not None]
    depth_m = np.concatenate([image[(image > 0) & (image < 65535)] for image in images])
    depth_m /= units_per_m
    middle_m, reach_m = np.percentile(depth_m, [50.0, RANGE_PERCENTILE]) if len(depth_m) else (0, 0)
    extent_m = float(np.ptp(frames.world_from_cam[:, :3, 3], axis=0).max())
    least_m = FINE_M if extent_m <= LARGE_EXTENT_M else COARSE_M
    return ScanChoice(
        stride=stride_of(len(frames)),
        max_depth_m=round(float(np.clip(reach_m, NEAREST_RANGE_M, FARTHEST_RANGE_M)), 2),
        voxel_m=round(float(np.clip(middle_m / depth_focal_px, least_m, COARSE_M)), 3),
        extent_m=round(extent_m, 2),
    )
