"""Points of a surface that a frame sees, and the colours of its photograph there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.distortion import distort
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import Depth
from synfeal.geometry.poses import inverse

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

NEAR_M = 0.1
# A point is seen where depth agrees with it: within this, or this share of the distance squared,
# for the noise of structured light grows so.
AGREE_M, AGREE_PER_M2 = 0.02, 0.005
# Surfaces seen at more than 75 degrees from their normal show little, and that is smeared.
MIN_COSINE = 0.26
MARGIN_PX = 4.0  # depth at the border of the image is poor


@dataclass(frozen=True)
class SeenPoints:
    """Points that one frame sees.

    Attributes:
        index: (M,) which of the points.
        in_depth_cam_m: (M, 3) where they are in its depth camera, metres.
        cosine: (M,) of the angle between the surface's normal and the direction it is seen from.
    """

    index: NDArray[np.int64]
    in_depth_cam_m: Floats
    cosine: Floats


def seen_points(
    points_m: Floats,
    normals: Floats,
    depth_m: Depth,
    depth_camera: CameraConfig,
    world_from_depth: Array,
) -> SeenPoints:
    """Find the points that a depth image confirms.

    Args:
        points_m: (V, 3) in the world of the pose.
        normals: (V, 3), unit length.
        depth_m: (H, W), 0 where nothing was measured.
        depth_camera: The camera of the depth image.
        world_from_depth: Its pose (4, 4).
    """
    depth_from_world = inverse(world_from_depth).astype(np.float32)
    local = points_m @ depth_from_world[:3, :3].T + depth_from_world[:3, 3]
    index = np.flatnonzero(local[:, 2] > NEAR_M)
    local = local[index]
    pixel = project(local, depth_camera)
    height, width = depth_m.shape
    inside = within(pixel, width, height, MARGIN_PX)
    index, local, pixel = index[inside], local[inside], pixel[inside]
    measured = depth_m[pixel[:, 1].astype(np.int64), pixel[:, 0].astype(np.int64)]
    tolerance = np.maximum(AGREE_M, AGREE_PER_M2 * measured**2)
    agrees = np.abs(measured - local[:, 2]) < tolerance
    index, local = index[agrees], local[agrees]
    towards = normals[index] @ depth_from_world[:3, :3].T
    cosine = -np.einsum("ni,ni->n", towards, local) / np.linalg.norm(local, axis=1)
    faces_us = cosine > MIN_COSINE
    return SeenPoints(index[faces_us], local[faces_us], cosine[faces_us])


def project(local_m: Floats, camera: CameraConfig) -> Floats:
    """Project points in front of a perspective camera.

    Args:
        local_m: Points (M, 3) in the frame of the camera, metres.
        camera: The camera.

    Returns:
        Pixels (M, 2), column and row, inside the image or not.
    """
    fx, fy, cx, cy = (np.float32(value) for value in camera.intrinsics)
    normalised = local_m[:, :2] / local_m[:, 2:]
    if any(camera.distortion):
        normalised = distort(normalised.astype(np.float64), camera.distortion).astype(np.float32)
    pixel: Floats = normalised * np.array([fx, fy]) + np.array([cx, cy])
    return pixel


def within(pixel: Floats, width: int, height: int, margin_px: float) -> NDArray[np.bool_]:
    """Mark pixels (M, 2) in an image and ``margin_px`` from its border: (M,); NaN is not."""
    x, y = pixel[:, 0], pixel[:, 1]
    return (x >= margin_px) & (x < width - margin_px) & (y >= margin_px) & (y < height - margin_px)


def sampled(image: NDArray[np.uint8] | Floats, pixel: Floats) -> Floats:
    """Read an image (H, W, C) between its pixels, bilinearly: (M, C) at pixels (M, 2).

    The centre of the first pixel is at (0.5, 0.5); pixels are at least one from the border.
    """
    x, y = pixel[:, 0] - np.float32(0.5), pixel[:, 1] - np.float32(0.5)
    column, row = x.astype(np.int64), y.astype(np.int64)
    right, below = (x - column)[:, None], (y - row)[:, None]
    width = image.shape[1]
    flat = image.reshape(-1, image.shape[2])
    first = row * width + column
    upper = flat[first] * (1 - right) + flat[first + 1] * right
    lower = flat[first + width] * (1 - right) + flat[first + width + 1] * right
    result: Floats = upper * (1 - below) + lower * below
    return result
