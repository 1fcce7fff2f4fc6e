"""The answer of a method that has learnt nothing of images: always the same pose."""

from __future__ import annotations

import numpy as np

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.rotations import mean_quat_wxyz


def constant_pose(train: PoseTable, frames: PoseTable) -> PoseTable:
    """Answer every frame with one pose: mean position and mean rotation of a label set.

    Cameras that look all round have hardly a mean rotation; then any does about as well. The poses
    of the frames are not looked at.
    """
    quat_wxyz = mean_quat_wxyz(train.quat_wxyz)
    position_m = np.tile(train.position_m.mean(axis=0), (len(frames), 1))
    return PoseTable(frames.frame, frames.path, position_m, np.tile(quat_wxyz, (len(frames), 1)))
