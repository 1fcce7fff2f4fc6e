"""Errors of labels after they are aligned with the true poses as a whole.

``rigid`` turns and shifts a trajectory, ``similarity`` scales it as well, as evo's ``--align`` and
``--correct_scale`` do. There the rotation is that of the camera centres (Umeyama). The centres of a
straight path leave the rotation about it free, and those of any path say little about small angles,
so here it is the mean rotation of the cameras; scale and shift follow from the centres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from baselines.labels.sfm.gauge import Similarity, mean_rotation
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]
Alignment = Literal["rigid", "similarity"]
ALIGNMENTS: tuple[Alignment, ...] = ("rigid", "similarity")


def fit(labels: Array, truth: Array, alignment: Alignment) -> Similarity:
    """Fit the motion of a whole trajectory onto the true one.

    Args:
        labels: ``world_from_cam`` (N, 4, 4) to be moved.
        truth: ``world_from_cam`` (N, 4, 4) of the same frames.
        alignment: Motions allowed, with or without scale. Labels that do not move keep their scale.

    Returns:
        The map of the labels' world to the true one.
    """
    rotation = mean_rotation(labels[:, :3, :3], truth[:, :3, :3])
    turned_m, true_m = labels[:, :3, 3] @ rotation.T, truth[:, :3, 3]
    mean_m, true_mean_m = turned_m.mean(axis=0), true_m.mean(axis=0)
    scale, square = 1.0, float(((turned_m - mean_m) ** 2).sum())
    if alignment == "similarity" and square > 0:
        shared = float(((turned_m - mean_m) * (true_m - true_mean_m)).sum())
        scale = max(shared / square, 0.0)  # a negative one would be a reflection
    return Similarity(scale, rotation, true_mean_m - scale * mean_m)


def aligned_errors(
    pairs: Sequence[tuple[PoseTable, PoseTable]], alignment: Alignment
) -> tuple[Array, Array]:
    """Measure labels against the truth, each sequence aligned on its own.

    Args:
        pairs: Labels and true poses of each sequence.
        alignment: Motions of the labels that are allowed.

    Returns:
        Position errors in metres (N,) and orientation errors in degrees (N,) of all frames.
    """
    position_m, orientation_deg = [], []
    for labels, truth in pairs:
        poses, true = labels.world_from_cam, truth.world_from_cam
        found_m, found_rad = pose_error(fit(poses, true, alignment).place(poses), true)
        position_m.append(found_m)
        orientation_deg.append(np.degrees(found_rad))
    return np.concatenate(position_m), np.concatenate(orientation_deg)
