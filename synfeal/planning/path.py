"""The frames of one straight path: section 3.3 of the paper."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.geometry.poses import interpolate, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.planning.sampling import PoseVectors

Array = NDArray[np.float64]


def n_frames_of(start: Array, target: Array, frame_spacing_m: float) -> int:
    """Frames between two pose vectors (6,): the distance over the spacing, a whole number >= 1."""
    distance = float(np.linalg.norm(target[:3] - start[:3]))
    return max(1, round(distance / frame_spacing_m))


def step_of(start: Array, target: Array, n_frames: int) -> Array:
    """Change of every element (6,) per frame; each angle turns the short way round."""
    change = target - start
    change[3:] = (change[3:] + np.pi) % (2.0 * np.pi) - np.pi
    return change / n_frames


def path_vectors(start: Array, target: Array, n_frames: int) -> PoseVectors:
    """Pose vectors (n, 6) of frames 1 to n: ``v_j = v_i + j * step``.

    Erratum: the paper prints ``v_j = v_(j-1) + j * step``, which grows quadratically and overshoots
    the target; the movement it describes is this linear one.
    """
    frame = np.arange(1, n_frames + 1)[:, None]
    return start + frame * step_of(start, target, n_frames)


def path_poses(
    start: Array, target: Array, frame_spacing_m: float, interpolation: Literal["rpy", "slerp"]
) -> Array:
    """``world_from_cam`` (n, 4, 4) of the frames after ``start`` up to and including ``target``.

    ``rpy`` moves roll, pitch and yaw as the paper does; ``slerp`` turns about one axis at constant
    speed.
    """
    n_frames = n_frames_of(start, target, frame_spacing_m)
    if interpolation == "rpy":
        return poses_of(path_vectors(start, target, n_frames))
    ends = poses_of(np.stack([start, target]))
    return interpolate(ends[0], ends[1], np.arange(1, n_frames + 1) / n_frames)


def poses_of(vectors: PoseVectors) -> Array:
    """``world_from_cam`` (N, 4, 4) of pose vectors (N, 6)."""
    return pose_matrix(rotation_from_rpy(vectors[:, 3:]), vectors[:, :3])
