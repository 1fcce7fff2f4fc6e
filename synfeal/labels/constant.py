"""The localizer that has learnt nothing: it always answers the mean pose of its training labels."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.rotations import canonical_quat_wxyz


def constant_pose(train: PoseTable, frames: PoseTable) -> PoseTable:
    """The same pose for all of some frames: mean position and mean rotation of a label set.

    The mean rotation is the one with the least sum of squared chords (Markley et al., "Averaging
    Quaternions", JGCD 2007). Cameras that look all round have hardly a mean; then any rotation does
    about as well. The poses of the frames are not looked at.
    """
    mean = Rotation.from_quat(train.quat_wxyz, scalar_first=True).mean()
    quat_wxyz = canonical_quat_wxyz(mean.as_quat(scalar_first=True))
    position_m = np.tile(train.position_m.mean(axis=0), (len(frames), 1))
    return PoseTable(frames.frame, frames.path, position_m, np.tile(quat_wxyz, (len(frames), 1)))
