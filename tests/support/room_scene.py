"""Rooms of boxes, ray-cast in closed form: depth is exact, texture a random function of the place.

A room is the inside of one box with others standing in it, repeated along x if it has a period.
"""

from dataclasses import dataclass

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter, map_coordinates

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import quat_wxyz_from_matrix, rotation_from_rpy

CAMERA = CameraConfig(width=160, height=120, horizontal_fov_deg=60.0)
# Texture: random values every so many metres.
_CELL_M = 0.08
_LATTICE = np.random.default_rng(5).uniform(30, 255, (48, 48, 48))


@dataclass(frozen=True)
class Room:
    """Boxes as (lower, upper) corners in metres; the first is the room itself."""

    boxes: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]
    plain: bool = False
    period_m: float | None = None


FURNISHED = Room(
    (
        ((-3.0, -2.5, 0.0), (3.0, 2.5, 2.6)),
        ((1.6, -0.6, 0.0), (2.4, 0.1, 1.3)),
        ((0.9, 0.7, 0.0), (1.7, 1.6, 0.8)),
        ((-2.0, 1.5, 0.0), (-1.2, 2.2, 1.8)),
        ((-1.5, -1.9, 0.0), (-0.5, -1.2, 0.9)),
        ((2.2, -2.2, 0.0), (2.8, -1.2, 2.0)),
        ((1.0, -1.7, 1.6), (1.8, -1.0, 2.3)),
    )
)


# A wall and a floor, which cameras of :func:`straight_path` see.
PLANES = Room((((-9.0, -9.0, -1.2), (3.0, 9.0, 9.0)),))


def straight_path(n_frames, step_m, turn_deg):
    """Frames along world y, looking along world x, turning a little about the vertical."""
    centre = np.arange(n_frames) - (n_frames - 1) / 2
    yaw = np.radians(turn_deg) * centre
    rotation = rotation_from_rpy(np.column_stack([0 * yaw, 0 * yaw + 0.15, yaw]))
    position = np.column_stack([0.1 * step_m * centre, step_m * centre, 0.02 * centre])
    index = np.arange(n_frames)
    return PoseTable(index, 0 * index, position, quat_wxyz_from_matrix(rotation))


def pose_at(position_m, yaw_deg=0.0, pitch_deg=12.0):
    """``world_from_cam`` of a camera that looks along world x at yaw 0."""
    return pose_matrix(rotation_from_rpy(np.radians([0.0, pitch_deg, yaw_deg])), position_m)


def cast(world_from_cam, room, camera=CAMERA):
    """Depth (H, W) along the optical axis and the points (H, W, 3) hit."""
    fx, fy, cx, cy = camera.intrinsics
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    ray = np.stack([(column - cx) / fx, (row - cy) / fy, np.ones_like(row)], axis=-1)
    direction = ray @ world_from_cam[:3, :3].T
    origin = world_from_cam[:3, 3]
    (lower, upper), *inner = room.boxes
    depth = _slabs(origin, direction, lower, upper)[1]
    shifts = [0.0]
    if room.period_m is not None:
        shifts = [k * room.period_m for k in range(-1, 5)]  # as far as a test looks
    for low, high in inner:
        for shift in shifts:
            enter, leave = _slabs(origin - [shift, 0, 0], direction, low, high)
            depth = np.where((enter > 0) & (enter <= leave), np.minimum(depth, enter), depth)
    return depth, origin + depth[..., None] * direction


def finer(camera, factor):
    """The camera with as many times the pixels along each side."""
    fx, fy, cx, cy = (factor * value for value in camera.intrinsics)
    size = {"width": factor * camera.width, "height": factor * camera.height}
    return CameraConfig(**size, fx=fx, fy=fy, cx=cx, cy=cy)


def random_texture(rng):
    """Random grey values (700, 700) with detail at several scales, at 1 cm a texel."""
    image = np.zeros((700, 700))
    for sigma, weight in ((1.5, 25.0), (4.0, 30.0), (12.0, 30.0)):
        noise = gaussian_filter(rng.standard_normal(image.shape), sigma, mode="wrap")
        image += weight * noise / noise.std()
    return np.clip(128.0 + image, 0, 255)


def painted(textures, world_from_cam, size_m=(5.0, 6.0, 3.0), camera=CAMERA):
    """Antialiased image of a room with a texture on each of its six sides, repeated."""
    _, point = cast(world_from_cam, Room((((0.0, 0.0, 0.0), size_m),)), finer(camera, 2))
    off_m = np.abs(point[..., None] - np.transpose([np.zeros(3), size_m]))
    side = off_m.reshape(*point.shape[:2], 6).argmin(axis=-1)
    grey = np.zeros(side.shape)
    for number, texture in enumerate(textures):
        seen = side == number
        along = [100 * point[seen, k] for k in range(3) if k != number // 2]
        grey[seen] = map_coordinates(texture, along, order=1, mode="grid-wrap")
    coarse = grey.reshape(camera.height, 2, camera.width, 2).mean(axis=(1, 3))
    return Image.fromarray(np.round(coarse).astype(np.uint8)).convert("RGB")


def _slabs(origin, direction, lower, upper):
    """Depth at which rays enter and leave a box."""
    with np.errstate(divide="ignore"):
        at = (np.array([lower, upper])[:, None, None] - origin) / direction
    return at.min(axis=0).max(axis=-1), at.max(axis=0).min(axis=-1)


def color_of(point, room):
    """Colour (H, W, 3) uint8 of points (H, W, 3)."""
    if room.plain:
        return np.full(point.shape, 230, dtype=np.uint8)
    if room.period_m is not None:
        point = np.concatenate([np.mod(point[..., :1], room.period_m), point[..., 1:]], axis=-1)
    lattice = np.moveaxis(point, -1, 0) / _CELL_M
    grey = map_coordinates(_LATTICE, lattice, order=1, mode="grid-wrap")
    return np.repeat(np.round(grey).astype(np.uint8)[..., None], 3, axis=2)


def write_room(folder, poses, room=FURNISHED, camera=CAMERA, supersampling=1):
    """Write colour and depth images; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    color_paths, depth_paths = [], []
    for frame, pose in enumerate(poses):
        color_paths.append(folder / f"frame-{frame:06d}.color.png")
        depth_paths.append(folder / f"frame-{frame:06d}.depth.png")
        image = Image.fromarray(color_of(cast(pose, room, finer(camera, supersampling))[1], room))
        image.reduce(supersampling).save(color_paths[-1])
        depth_mm = np.round(1000 * cast(pose, room, camera)[0]).astype(np.uint16)
        Image.fromarray(depth_mm).save(depth_paths[-1])
    return color_paths, depth_paths


def write_planes(folder, truth, camera=CAMERA):
    return write_room(folder, truth.world_from_cam, PLANES, camera, supersampling=2)
