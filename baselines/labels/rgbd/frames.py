"""RGB-D frames as the sensor measures them, and point-to-plane registration of their depth.

Open3D's own loop over scales prepares both images anew for every call, which takes as long as its
steps. Here a frame is prepared once, for all the pairs it is part of, and steps end when they no
longer move the camera; the steps themselves are Open3D's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.config.labels import DepthConfig
from baselines.labels.batches import COLLECT_AGAIN, read_image
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.geometry.poses import pose_error
from synfeal.records.provenance import generator_of

Array = NDArray[np.float64]


class Stage(NamedTuple):
    """Stage of the registration: resolution, residuals, stopping rule.

    Attributes:
        stride: Pixels from one compared pixel to the next.
        max_steps: Steps at the most.
        huber_m: Depth difference beyond which a point counts by its distance, not its square.
        rest_m: Steps end with one that moves the camera by no more, metres.
        rest_deg: The same of its rotation, degrees.
    """

    stride: int
    max_steps: int
    huber_m: float
    rest_m: float
    rest_deg: float


# The first stages find a motion, but pull those that depth hardly tells by 0.1 degrees; the last
# comes to rest where edges, and what only one image shows, weigh little.
STAGES = (
    Stage(4, 15, 0.05, 0.0005, 0.02),
    Stage(1, 20, 0.05, 0.0002, 0.01),
    Stage(1, 20, 0.002, 0.00005, 0.002),
)
# A refined motion may not leave its starting point by more.
MAX_CHANGE_M, MAX_CHANGE_DEG = 0.25, 10.0
# Open3D's own smoothing of depth before it takes normals: pixels, deviations in metres and pixels.
_SMOOTHING = (5, 5.0, 10.0)


@dataclass(frozen=True)
class ScaledPoints:
    """Points and normals (h, w, 3) of a depth image at one scale, nan where there is none."""

    points: o3d.core.Tensor
    normals: o3d.core.Tensor
    intrinsics: o3d.core.Tensor


# By stride.
PointsByStride = dict[int, ScaledPoints]


def near(a: Array, b: Array, max_m: float = MAX_CHANGE_M, max_deg: float = MAX_CHANGE_DEG) -> bool:
    """Check that a motion stays near its starting point.

    Args:
        a: Motion (4, 4).
        b: Motion (4, 4) it started from.
        max_m: Largest difference of position, metres.
        max_deg: Largest difference of orientation, degrees.
    """
    change_m, change_rad = pose_error(a, b)
    return bool(change_m <= max_m and np.degrees(change_rad) <= max_deg)


def _surface(depth_m: NDArray[np.float32], matrix: Array, stride: int) -> ScaledPoints:
    """Build one scale; pixel (0, 0) stays where it is, so focal lengths and centre shrink alike."""
    pixels = np.ascontiguousarray(depth_m[::stride, ::stride])
    image = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(pixels))
    intrinsics = o3d.core.Tensor.from_numpy(np.diag([1 / stride, 1 / stride, 1]) @ matrix)
    smooth = image.filter_bilateral(*_SMOOTHING).create_vertex_map(intrinsics, np.nan)
    return ScaledPoints(
        image.create_vertex_map(intrinsics, np.nan).as_tensor(),
        smooth.create_normal_map(np.nan).as_tensor(),
        intrinsics,
    )


# What Open3D says where nothing in view constrains the motion.
SINGULAR = "Singular 6x6 linear system"


def align(
    i: PointsByStride, j: PointsByStride, start: Array, max_difference_m: float
) -> Array | None:
    """Register frame j to frame i by point-to-plane distances.

    Args:
        i: Surfaces whose planes points move towards.
        j: Surfaces whose points move.
        start: Motion ``i_from_j`` (4, 4) to start from.
        max_difference_m: Points whose depth differs by more do not count, metres.

    Returns:
        Motion ``i_from_j`` (4, 4), or None where nothing in view constrains it.
    """
    return motion_or_none(lambda: _aligned(i, j, start, max_difference_m))


def _aligned(
    i: PointsByStride, j: PointsByStride, start: Array, max_difference_m: float
) -> o3d.core.Tensor:
    """Register as :func:`align` does; raise what Open3D raises."""
    i_from_j = o3d.core.Tensor.from_numpy(np.ascontiguousarray(start))
    for stage in STAGES:
        target, source = i[stage.stride], j[stage.stride]
        for _ in range(stage.max_steps):
            step = o3d.t.pipelines.odometry.compute_odometry_result_point_to_plane(
                source_vertex_map=source.points,
                target_vertex_map=target.points,
                target_normal_map=target.normals,
                intrinsics=target.intrinsics,
                init_source_to_target=i_from_j,
                depth_outlier_trunc=max_difference_m,
                depth_huber_delta=stage.huber_m,
            ).transformation
            i_from_j = step @ i_from_j
            if near(step.numpy(), np.eye(4), stage.rest_m, stage.rest_deg):
                break
    return i_from_j


def motion_or_none(estimate: Callable[[], o3d.core.Tensor]) -> Array | None:
    """Return the motion (4, 4) that Open3D estimates; None where it finds none.

    Args:
        estimate: Asks Open3D for a motion.

    Raises:
        RuntimeError: Open3D fails for another reason than that nothing constrains the motion.
    """
    try:
        motion = estimate()
    except RuntimeError as error:
        if SINGULAR not in str(error):
            raise
        return None
    found = np.asarray(motion.numpy(), dtype=np.float64)
    return found if np.isfinite(found).all() else None


# Depth images hold millimetres; 0 and 65535 mean that nothing was hit.


@dataclass(frozen=True)
class RgbdFrame:
    """One frame.

    Attributes:
        color: Image (H, W, 3) uint8.
        depth_m: Depth (H, W) along the optical axis, inf where nothing was measured.
        camera: Camera of both images.
    """

    color: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    camera: CameraConfig

    @cached_property
    def rgbd(self) -> o3d.t.geometry.RGBDImage:
        """Both images as Open3D takes them, depth 0 where nothing was measured."""
        return o3d.t.geometry.RGBDImage(open3d_image(self.color), open3d_depth(self.depth_m))

    @cached_property
    def surfaces(self) -> PointsByStride:
        """Points seen in the depth image, by stride of the registration's stages."""
        measured = np.where(np.isfinite(self.depth_m), self.depth_m, np.float32(np.nan))
        matrix = self.camera.intrinsics.matrix(centre_shift_px=-0.5)
        strides = {stage.stride for stage in STAGES}
        return {stride: _surface(measured, matrix, stride) for stride in strides}


def read_frame(
    color_path: FrameFile, depth_path: FrameFile, camera: CameraConfig, cfg: DepthConfig, seed: int
) -> RgbdFrame:
    """Read a colour and a depth image, the latter as the configured sensor would measure it.

    Args:
        color_path: Colour image.
        depth_path: 16-bit depth image in millimetres, 0 or 65535 where nothing was measured.
        camera: Camera of both.
        cfg: Sensor, and the depth beyond which it measures nothing.
        seed: Seed of the sensor's noise; unused by the ideal one.

    Raises:
        InputError: an image cannot be read, has another size than the camera, or the depth is not
            16-bit.
    """
    color = read_image(color_path, camera, "RGB")
    depth_m = read_depth_m(depth_path, size=(camera.width, camera.height), remedy=COLLECT_AGAIN)
    if cfg.sensor == "kinect":
        depth_m = kinect_depth(depth_m, frame_generator(seed, depth_path))
    depth_m = np.where(depth_m > cfg.max_depth_m, np.float32(np.inf), depth_m)
    return RgbdFrame(color, depth_m, camera)


def open3d_depth(depth_m: NDArray[np.float32]) -> o3d.t.geometry.Image:
    """Return the depth (H, W) for Open3D, which takes 0 where nothing was measured."""
    return open3d_image(np.where(np.isfinite(depth_m), depth_m, np.float32(0)))


def open3d_image(pixels: NDArray[Any]) -> o3d.t.geometry.Image:
    """Return an array (H, W) or (H, W, C) as an Open3D image."""
    return o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(np.ascontiguousarray(pixels)))


# One step of normalised disparity (1/m) and the standard deviation of the noise, in steps.
STEP_PER_M, NOISE_STEPS = 2.85e-3, 0.5
# Outside this range (metres) the sensor sees nothing.
RANGE_M = (0.5, 4.5)


def kinect_depth(depth_m: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """Simulate the depth (H, W) in metres that a Kinect measures; inf where it sees nothing.

    It measures disparity: inverse depth in steps of fixed size, with noise of about half a step
    that grows with the square of the depth once it is converted (Khoshelham and Elberink, Sensors
    12(2), 2012). Noise is independent from pixel to pixel; the wrong depth that real sensors show
    along edges is not modelled.
    """
    near_m, far_m = RANGE_M
    steps = 1 / (depth_m.astype(np.float64) * STEP_PER_M)
    steps = np.maximum(np.round(steps + rng.normal(0, NOISE_STEPS, depth_m.shape)), 1)
    seen = (depth_m >= near_m) & (depth_m <= far_m)
    return np.where(seen, 1 / (steps * STEP_PER_M), np.inf).astype(np.float32)


def frame_generator(seed: int, path: FrameFile) -> np.random.Generator:
    """Seed the noise of one image: the same wherever it is read, for batches share a frame."""
    return generator_of(seed, "depth-sensor", path.parent.name, path.name)
