"""Point-to-plane registration of depth images whose surfaces are prepared once.

Open3D's own loop over scales prepares both images anew for every call, which takes as long as its
steps. Here a frame is prepared once, for all the pairs it is part of, and steps end when they no
longer move the camera; the steps themselves are Open3D's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig
from synfeal.geometry.poses import pose_error

Array = NDArray[np.float64]


class Stage(NamedTuple):
    """How images are compared, and for how long."""

    stride: int  # every how many pixels are compared
    max_steps: int  # steps at the most
    huber_m: float  # depth difference beyond which a point counts by its distance, not its square
    rest_m: float  # a step that moves the camera by no more is the last
    rest_deg: float  # a step that moves the camera by no more is the last


# The first stages find a motion, but pull those that depth hardly tells by 0.1 degrees; the last
# comes to rest where edges, and what only one image shows, weigh little.
STAGES = (
    Stage(4, 15, 0.05, 0.0005, 0.02),
    Stage(1, 20, 0.05, 0.0002, 0.01),
    Stage(1, 20, 0.002, 0.00005, 0.002),
)
# Open3D's own smoothing of depth before it takes normals: pixels, deviations in metres and pixels.
_SMOOTHING = (5, 5.0, 10.0)


@dataclass(frozen=True)
class Surface:
    """Points and normals (h, w, 3) of a depth image at one scale, nan where there is none."""

    points: o3d.core.Tensor
    normals: o3d.core.Tensor
    intrinsics: o3d.core.Tensor


# By stride.
Surfaces = dict[int, Surface]


def surfaces_of(depth_m: NDArray[np.float32], camera: CameraConfig) -> Surfaces:
    """A depth image (H, W), not finite where nothing was measured, as all stages take it."""
    measured = np.where(np.isfinite(depth_m), depth_m, np.float32(np.nan))
    matrix = camera.intrinsics.matrix(centre_shift_px=-0.5)
    strides = {stage.stride for stage in STAGES}
    return {stride: _surface(measured, matrix, stride) for stride in strides}


def _surface(depth_m: NDArray[np.float32], matrix: Array, stride: int) -> Surface:
    """One scale; pixel (0, 0) stays where it is, so focal lengths and centre shrink alike."""
    pixels = np.ascontiguousarray(depth_m[::stride, ::stride])
    image = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(pixels))
    intrinsics = o3d.core.Tensor.from_numpy(np.diag([1 / stride, 1 / stride, 1]) @ matrix)
    smooth = image.filter_bilateral(*_SMOOTHING).create_vertex_map(intrinsics, np.nan)
    return Surface(
        image.create_vertex_map(intrinsics, np.nan).as_tensor(),
        smooth.create_normal_map(np.nan).as_tensor(),
        intrinsics,
    )


def align(i: Surfaces, j: Surfaces, start: Array, max_difference_m: float) -> Array | None:
    """Motion ``i_from_j`` (4, 4) near a starting point (4, 4), or None where there is none.

    Args:
        i: the surfaces whose planes count.
        j: those whose points are moved.
        start: of the search.
        max_difference_m: points whose depth differs by more do not count.
    """
    i_from_j = o3d.core.Tensor.from_numpy(np.ascontiguousarray(start))
    try:
        for stage in STAGES:
            surfaces = i[stage.stride], j[stage.stride]
            i_from_j = _descend(stage, *surfaces, i_from_j, max_difference_m)
    except RuntimeError:  # a singular system: nothing in view constrains the motion
        return None
    found = np.asarray(i_from_j.numpy(), dtype=np.float64)
    return found if np.isfinite(found).all() else None


def _descend(
    stage: Stage,
    target: Surface,
    source: Surface,
    target_from_source: o3d.core.Tensor,
    max_difference_m: float,
) -> o3d.core.Tensor:
    """A motion (4, 4) after the steps of one stage."""
    for _ in range(stage.max_steps):
        step = o3d.t.pipelines.odometry.compute_odometry_result_point_to_plane(
            source.points,
            target.points,
            target.normals,
            target.intrinsics,
            target_from_source,
            max_difference_m,
            stage.huber_m,
        ).transformation
        target_from_source = step @ target_from_source
        moved_m, moved_rad = pose_error(step.numpy(), np.eye(4))
        if moved_m <= stage.rest_m and np.degrees(moved_rad) <= stage.rest_deg:
            break
    return target_from_source
