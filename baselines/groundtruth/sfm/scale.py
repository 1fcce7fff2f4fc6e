"""From a model without scale or place to metres and the first true pose.

An SfM model has no scale and no place in the world, so two things are taken from the true poses of
the batch, as the published code does: the metric scale, from distances to the first frame, and the
pose of the first registered camera. Its full pose is used, and not a similarity fitted to the
camera centres, because the centres of a straight path leave the rotation about its line free.
Where that camera is not the batch's first, the chain counts the batch as assisted.

A wrong scale over the first frames and a first camera that few others share points with grow with
the distance, so the placed error of a long path is larger than that after a similarity fit
(``results/benchmarks/sfm_settings.csv``). The rule is kept because it is the assistance that the
published labels had; what bent models, and their first cameras with them, is removed before
(``refine.py``).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from baselines.groundtruth.trajectory import BatchTrajectory, failed_trajectory
from synfeal.geometry.poses import relative

Array = NDArray[np.float64]

# The published code's rule for the scale: the first 44 frames, none nearer than 5 cm to the first.
_SCALE_FRAMES = 44
_SCALE_MIN_M = 0.05


def metric_scale(true_position_m: Array, position: Array) -> float:
    """Metres per unit of the model, from camera centres (n, 3) of the same frames.

    The published code takes the mean ratio of true to estimated distances from the first frame over
    its first 44 frames, leaving out those under 5 cm; the median is as simple and bears a wrong
    pose. NaN when no frame is left.
    """
    true_m = np.linalg.norm(true_position_m[:_SCALE_FRAMES] - true_position_m[0], axis=1)
    distance = np.linalg.norm(position[:_SCALE_FRAMES] - position[0], axis=1)
    usable = (true_m >= _SCALE_MIN_M) & (distance > 0)
    return float(np.median(true_m[usable] / distance[usable])) if usable.any() else math.nan


def metric_trajectory(
    frames: NDArray[np.int64], model_from_cam: Array, true_world_from_cam: Array
) -> BatchTrajectory:
    """Scale a model of some ``frames`` (m,), poses (m, 4, 4), and place its first camera.

    No frame is registered where there are fewer than two, or none to read a scale from.
    """
    trajectory = failed_trajectory(len(true_world_from_cam))
    if len(frames) < 2:
        return trajectory
    true = true_world_from_cam[frames]
    scale = metric_scale(true[:, :3, 3], model_from_cam[:, :3, 3])
    if not math.isfinite(scale):
        return trajectory
    motion = relative(model_from_cam[0], model_from_cam)
    motion[:, :3, 3] *= scale
    trajectory.first_from_cam[frames] = relative(true_world_from_cam[0], true[0]) @ motion
    trajectory.registered[frames] = True
    return trajectory
