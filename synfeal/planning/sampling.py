"""Random pose sampling: section 3.1 of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import Angles

# A pose as the paper writes it: (x, y, z, roll, pitch, yaw), metres and radians.
PoseVectors = NDArray[np.float64]


def pose_bounds(box_m: NDArray[np.float64], angles: Angles) -> NDArray[np.float64]:
    """Least and greatest value (2, 6) of each element of a pose vector; ``box_m`` is (2, 3)."""
    intervals = (angles.roll_deg, angles.pitch_deg, angles.yaw_deg)
    angle_bounds = np.deg2rad(np.array(intervals, dtype=np.float64).T)
    return np.hstack([np.asarray(box_m, dtype=np.float64), angle_bounds])


def sample_poses(bounds: NDArray[np.float64], count: int, rng: np.random.Generator) -> PoseVectors:
    """Pose vectors (count, 6), every element uniform and independent (Eq. 1)."""
    return rng.uniform(bounds[0], bounds[1], (count, 6))


def view_directions(poses: PoseVectors) -> NDArray[np.float64]:
    """Unit vectors (N, 3) along the optical axes of pose vectors (N, 6), in the world.

    The third column of :func:`synfeal.geometry.rotations.rotation_from_rpy`; roll turns about it.
    """
    pitch, yaw = poses[:, 4], poses[:, 5]
    level = np.cos(pitch)
    return np.stack([level * np.cos(yaw), level * np.sin(yaw), -np.sin(pitch)], axis=1)
