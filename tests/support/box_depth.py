"""Depth images of the inside of a box, in closed form, and cameras in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.config.dataset import CameraConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy

Array = NDArray[np.float64]
SIZE_M = np.array([5.0, 4.0, 2.6])
CAMERA = CameraConfig(width=80, height=60, fx=70.0, fy=70.0, cx=40.0, cy=30.0)


def world_from_cams(count: int, seed: int = 0) -> Array:
    """Poses (N, 4, 4) of upright cameras all over the box, that look all ways."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(0.25, 0.75, (count, 3)) * SIZE_M
    angles = rng.uniform([-0.1, -0.3, -np.pi], [0.1, 0.3, np.pi], (count, 3))
    return pose_matrix([rotation_from_rpy(angle) for angle in angles], place)


def depth_m(world_from_cam: Array) -> NDArray[np.float32]:
    """Depth (H, W) along the optical axis from inside the box, metres."""
    column, row = np.meshgrid(np.arange(CAMERA.width) + 0.5, np.arange(CAMERA.height) + 0.5)
    fx, fy, cx, cy = CAMERA.intrinsics
    rays = np.stack([(column - cx) / fx, (row - cy) / fy, np.ones_like(row)], axis=-1)
    ahead = rays @ world_from_cam[:3, :3].T
    start = world_from_cam[:3, 3]
    with np.errstate(divide="ignore"):
        along = np.maximum(-start / ahead, (SIZE_M - start) / ahead)
    return along.min(axis=-1).astype(np.float32)


def write_sequence(folder: Path, world_from_cam: Array, stored: Array, per_m: float = 1000) -> None:
    """Write frames as 7-Scenes does.

    Args:
        folder: Folder to create.
        world_from_cam: Poses (N, 4, 4) that the frames are seen from.
        stored: Poses (N, 4, 4) that are written.
        per_m: What a metre of depth is written as.
    """
    folder.mkdir(parents=True)
    rng = np.random.default_rng(0)
    size = (CAMERA.height, CAMERA.width, 3)
    for number, (pose, written) in enumerate(zip(world_from_cam, stored, strict=True)):
        name = f"frame-{number:06d}"
        grey = rng.integers(0, 255, size, dtype=np.uint8)
        Image.fromarray(grey).save(folder / f"{name}.color.png")
        units = np.round(depth_m(pose) * per_m).astype(np.uint16)
        Image.fromarray(units).save(folder / f"{name}.depth.png")
        np.savetxt(folder / f"{name}.pose.txt", written)
