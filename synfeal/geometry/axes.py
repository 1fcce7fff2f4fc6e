"""Axes of the camera in other programs, and poses brought to ours.

A pose says how a camera stands only once one knows what its axes are. Ours, as OpenCV's and
COLMAP's, are x right, y down, z forward.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import BODY_FROM_CAM, Array

CameraAxes = Literal["opencv", "opengl", "ros"]

THEIRS_FROM_OURS: Mapping[CameraAxes, Array] = {
    "opencv": np.eye(3),
    "opengl": np.diag([1.0, -1.0, -1.0]),
    "ros": BODY_FROM_CAM,
}
DESCRIPTIONS: Mapping[CameraAxes, str] = {
    "opencv": "x right, y down, z forward",
    "opengl": "x right, y up, z backward, as in OpenGL, Blender and nerfstudio",
    "ros": "x forward, y left, z up, as of bodies in ROS",
}


def with_our_axes(world_from_cam: ArrayLike, axes: CameraAxes) -> Array:
    """Return poses (..., 4, 4) of the same cameras in our axes.

    Args:
        world_from_cam: Poses (..., 4, 4) of cameras with other axes.
        axes: Which those are.
    """
    return np.asarray(world_from_cam) @ pose_matrix(THEIRS_FROM_OURS[axes], np.zeros(3))


PosesAre = Literal["world_from_cam", "cam_from_world", "opengl"]


def meant_poses(given: ArrayLike, poses_are: PosesAre) -> Array:
    """Return ``world_from_cam`` (..., 4, 4) in our axes of poses in another convention.

    Args:
        given: Poses (..., 4, 4) as they are written.
        poses_are: Their direction; ``opengl`` is ``world_from_cam`` of cameras with OpenGL's axes.
    """
    poses = np.asarray(given, dtype=np.float64)
    if poses_are == "opengl":
        return with_our_axes(poses, "opengl")
    return poses if poses_are == "world_from_cam" else inverse(poses)
