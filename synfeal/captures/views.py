"""Images of one camera drawn as those of another at the same place."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from PIL import Image
from scipy.ndimage import map_coordinates

from synfeal.camera.calibration import PINHOLE, Calibration
from synfeal.camera.projection import pixels_of_points, rays_of_pixels
from synfeal.captures.capture import Array, Colors, Depth
from synfeal.config.dataset import CameraConfig


def has_lens(camera: Calibration) -> bool:
    """Tell whether a camera is anything but a pinhole."""
    return camera.projection is not None or any(camera.distortion)


def pixel_map(source: Calibration, target: Calibration) -> Array:
    """Return where each pixel's centre of the target is seen in the source.

    Args:
        source: Camera that took an image.
        target: Pinhole camera at the same place.

    Returns:
        Pixels (H, W, 2) of the source, x first, (0.5, 0.5) the centre of its first; NaN where its
        lens does not reach.

    Raises:
        ValueError: The target is no pinhole camera.
    """
    column, row = np.meshgrid(np.arange(target.width), np.arange(target.height))
    pixel = np.stack([column, row], axis=-1).astype(np.float64) + 0.5
    if has_lens(target):
        raise ValueError("the target must be a pinhole camera")
    if not has_lens(source):
        scale = np.array([source.fx / target.fx, source.fy / target.fy])
        shift = np.array([source.cx, source.cy]) - scale * [target.cx, target.cy]
        return np.asarray(pixel * scale + shift)
    rays = rays_of_pixels(_config(target), pixel.reshape(-1, 2))
    seen = pixels_of_points(_config(source), rays)
    return np.asarray(seen).reshape(pixel.shape)


def largest_offset_px(source: Calibration, target: Calibration) -> float:
    """Return how far apart two pinholes of one size show a point at most, pixels."""
    scale = np.array([source.fx / target.fx, source.fy / target.fy])
    shift = np.array([source.cx, source.cy]) - scale * [target.cx, target.cy]
    corners = np.array([[x, y] for x in (0.0, target.width) for y in (0.0, target.height)])
    return float(np.linalg.norm(corners * scale + shift - corners, axis=1).max())


def redrawn_color(image: Colors, source: Calibration, target: Calibration) -> Colors:
    """Draw a photograph (H, W, 3) as a pinhole camera sees it, black where nothing was seen."""
    if not has_lens(source):
        sx, sy = source.fx / target.fx, source.fy / target.fy
        affine = (sx, 0.0, source.cx - sx * target.cx, 0.0, sy, source.cy - sy * target.cy)
        size = (target.width, target.height)
        drawn = Image.fromarray(image).transform(
            size, Image.Transform.AFFINE, affine, Image.Resampling.BICUBIC
        )
        redrawn: Colors = np.asarray(drawn)
        return redrawn
    at = np.moveaxis(pixel_map(source, target) - 0.5, -1, 0)[::-1]  # rows first, centres whole
    at = np.nan_to_num(at, nan=-9.0)
    channels = [
        map_coordinates(image[..., channel].astype(np.float32), at, order=1, mode="constant")
        for channel in range(3)
    ]
    drawn_anew: Colors = np.rint(np.stack(channels, axis=-1)).clip(0, 255).astype(np.uint8)
    return drawn_anew


def redrawn_depth(depth_m: Depth, source: Calibration, target: Calibration) -> Depth:
    """Draw a depth image (H, W) by nearest pixels, for edges are sharp; 0 where nothing was seen.

    Depth along the optical axis is the same for both cameras, a fisheye's included if its images
    hold that.
    """
    seen = np.floor(np.nan_to_num(pixel_map(source, target), nan=-1.0)).astype(np.int64)
    x, y = seen[..., 0], seen[..., 1]
    inside = (x >= 0) & (x < source.width) & (y >= 0) & (y < source.height)
    flat = depth_m.reshape(-1)
    index = np.where(inside, y * source.width + x, 0)
    return np.where(inside, flat[index], np.float32(0.0)).astype(np.float32)


def common_camera(cameras: list[Calibration]) -> Calibration:
    """Return the camera that images of one size are drawn as: the median of their pinholes.

    A lens that all share stays as it is, for nothing needs to be drawn anew then.
    """
    first = cameras[0]
    if all(camera == first for camera in cameras) and first.projection is None:
        return first
    pinholes = np.array([[c.fx, c.fy, c.cx, c.cy] for c in cameras])
    fx, fy, cx, cy = (float(value) for value in np.median(pinholes, axis=0))
    return Calibration(first.width, first.height, fx, fy, cx, cy, PINHOLE)


def _config(camera: Calibration) -> CameraConfig:
    return CameraConfig(**asdict(camera))
