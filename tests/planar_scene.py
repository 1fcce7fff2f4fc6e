"""A slanted and a fronto-parallel textured plane, ray-cast in closed form with NumPy.

Depth is exact, and no renderer has to share the process with Open3D.
"""

import numpy as np
from PIL import Image
from scipy.ndimage import map_coordinates

from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.rotations import quat_wxyz_from_matrix, rotation_from_rpy
from tests.painted_room import random_texture

CAMERA = CameraConfig(width=160, height=120, horizontal_fov_deg=60.0)
TEXELS_PER_M = 100
SUPERSAMPLING = 2

# Points p of a plane have normal @ p = offset: a wall at x = 3 m and a slope that rises towards it.
PLANES = [
    (np.array([1.0, 0.0, 0.0]), 3.0, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])),
    (np.array([0.5, 0.0, -1.0]), 1.7, np.array([1.0, 0.0, 0.5]), np.array([0.0, 1.0, 0.0])),
]


def straight_path(n_frames, step_m, turn_deg):
    """Frames along world y, looking along world x, turning a little about the vertical."""
    centre = np.arange(n_frames) - (n_frames - 1) / 2
    yaw = np.radians(turn_deg) * centre
    rotation = rotation_from_rpy(np.column_stack([0 * yaw, 0 * yaw + 0.15, yaw]))
    position = np.column_stack([0.1 * step_m * centre, step_m * centre, 0.02 * centre])
    index = np.arange(n_frames)
    return PoseTable(index, 0 * index, position, quat_wxyz_from_matrix(rotation))


def depth_map(world_from_cam, camera, factor=1):
    """Depth (H, W) along the optical axis, the plane seen (H, W) and the points (H, W, 3)."""
    width, height = camera.width * factor, camera.height * factor
    focal = width / 2 / np.tan(np.radians(camera.horizontal_fov_deg) / 2)
    column, row = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    ray = np.stack(
        [(column - width / 2) / focal, (row - height / 2) / focal, np.ones_like(row)], axis=-1
    )
    direction = ray @ world_from_cam[:3, :3].T
    depths = []
    for normal, offset, _, _ in PLANES:
        with np.errstate(divide="ignore"):
            depth = (offset - normal @ world_from_cam[:3, 3]) / (direction @ normal)
        depths.append(np.where(depth > 0, depth, np.inf))
    seen = np.argmin(depths, axis=0)
    depth = np.min(depths, axis=0)
    return depth, seen, world_from_cam[:3, 3] + depth[..., None] * direction


def render(world_from_cam, camera, textures):
    """Colour image (H, W, 3) uint8, antialiased."""
    _, seen, point = depth_map(world_from_cam, camera, SUPERSAMPLING)
    grey = np.zeros(seen.shape)
    for plane, (_, _, u, v) in enumerate(PLANES):
        mask = seen == plane
        texel = [point[mask] @ axis * TEXELS_PER_M + 350 for axis in (v, u)]
        grey[mask] = map_coordinates(textures[plane], texel, order=1, mode="grid-wrap")
    fine = grey.reshape(camera.height, SUPERSAMPLING, camera.width, SUPERSAMPLING)
    coarse = np.round(fine.mean(axis=(1, 3))).astype(np.uint8)
    return np.repeat(coarse[..., None], 3, axis=2)


def write_frames(folder, truth, camera=CAMERA):
    """Write colour and depth images; returns their paths."""
    textures = [random_texture(np.random.default_rng(seed)) for seed in range(len(PLANES))]
    color_paths, depth_paths = [], []
    for frame, pose in enumerate(truth.world_from_cam):
        color_paths.append(folder / f"frame-{frame:06d}.color.png")
        depth_paths.append(folder / f"frame-{frame:06d}.depth.png")
        Image.fromarray(render(pose, camera, textures)).save(color_paths[-1])
        depth_mm = np.round(1000 * depth_map(pose, camera)[0]).clip(0, 65535)
        Image.fromarray(depth_mm.astype(np.uint16)).save(depth_paths[-1])
    return color_paths, depth_paths
