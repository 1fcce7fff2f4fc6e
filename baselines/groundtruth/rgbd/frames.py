"""Frames as dense odometry takes them: read, checked, and cut to the range of the depth sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.groundtruth.images import read_image
from baselines.groundtruth.rgbd.surface import Surfaces, surfaces_of
from synfeal.config.models import CameraConfig, DepthConfig
from synfeal.dataset.archive import FrameFile
from synfeal.errors import InputError
from synfeal.seeds import generator_of

# Depth images hold millimetres; 0 and 65535 mean that nothing was hit.
_INVALID_MM = (0, 65535)


@dataclass(frozen=True)
class RgbdFrame:
    """One frame."""

    color: NDArray[np.uint8]  # (H, W, 3) uint8
    depth_m: NDArray[np.float32]  # (H, W) along the optical axis, inf where nothing was measured
    camera: CameraConfig  # of both

    @cached_property
    def rgbd(self) -> o3d.t.geometry.RGBDImage:
        """Both images as Open3D takes them, depth 0 where nothing was measured."""
        return o3d.t.geometry.RGBDImage(open3d_image(self.color), open3d_depth(self.depth_m))

    @cached_property
    def surfaces(self) -> Surfaces:
        """What the depth shows, as the registration takes it."""
        return surfaces_of(self.depth_m, self.camera)


def read_frame(
    color_path: FrameFile, depth_path: FrameFile, camera: CameraConfig, cfg: DepthConfig, seed: int
) -> RgbdFrame:
    """Read a frame.

    Raises:
        InputError: an image cannot be read, has another size than the camera, or the depth is not
            16-bit.
    """
    color = read_image(color_path, camera, "RGB")
    depth_m = read_depth(depth_path, camera, cfg, seed)
    return RgbdFrame(color, depth_m, camera)


def read_depth(
    path: FrameFile, camera: CameraConfig, cfg: DepthConfig, seed: int
) -> NDArray[np.float32]:
    """Depth (H, W) in metres as the sensor of the configuration measures it, inf where nothing."""
    depth_mm = read_image(path, camera)
    if depth_mm.ndim != 2 or depth_mm.dtype not in (np.uint16, np.int32):
        raise InputError(f"{path}: is not a 16-bit depth image; collect the data set again")
    invalid = (depth_mm == _INVALID_MM[0]) | (depth_mm == _INVALID_MM[1])
    depth_m = np.where(invalid, np.float32(np.inf), depth_mm.astype(np.float32) / np.float32(1000))
    if cfg.sensor == "kinect":
        depth_m = kinect_depth(depth_m, frame_generator(seed, path))
    return np.where(depth_m > cfg.max_depth_m, np.float32(np.inf), depth_m)


def open3d_depth(depth_m: NDArray[np.float32]) -> o3d.t.geometry.Image:
    """Depth (H, W) for Open3D, which takes 0 where nothing was measured."""
    return open3d_image(np.where(np.isfinite(depth_m), depth_m, np.float32(0)))


def open3d_image(pixels: NDArray[Any]) -> o3d.t.geometry.Image:
    """An array (H, W) or (H, W, C) as an Open3D image."""
    return o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(np.ascontiguousarray(pixels)))


# One step of normalised disparity (1/m) and the standard deviation of the noise, in steps.
STEP_PER_M, NOISE_STEPS = 2.85e-3, 0.5
# Outside this range (metres) the sensor sees nothing.
RANGE_M = (0.5, 4.5)


def kinect_depth(depth_m: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """What a Kinect measures where the depth is ``depth_m`` (H, W); inf where it sees nothing.

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
    """Noise of one image: the same wherever it is read, for batches share a frame."""
    return generator_of(seed, "depth-sensor", path.parent.name, path.name)
