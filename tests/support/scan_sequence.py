"""A posed RGB-D sequence of a stand-in room: two cameras, and a world that leans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.render.choose import open_renderer
from tests.support.small_room import SIZE_M, furnished_room

Array = NDArray[np.float64]
WIDTH, HEIGHT = 320, 240
COLOR_PX, DEPTH_PX = 240.0, 270.0
N_FRAMES = 48
# The room leans by 35 degrees in the world of the sequence, and lies elsewhere.
SEQUENCE_FROM_ROOM = pose_matrix(
    Rotation.from_euler("ZYX", [130.0, 15.0, 32.0], degrees=True).as_matrix(), [2.0, -7.0, 0.5]
)


def pinhole(focal_px: float) -> CameraConfig:
    """The principal point in the middle."""
    values = {"fx": focal_px, "fy": focal_px, "cx": WIDTH / 2.0, "cy": HEIGHT / 2.0}
    return CameraConfig.model_validate({"width": WIDTH, "height": HEIGHT, **values})


def room_from_cam() -> Array:
    """Poses (N, 4, 4): once round the room, up and down, never quite upright."""
    rng = np.random.default_rng(3)
    poses = []
    for yaw in np.arange(N_FRAMES) * 2.0 * np.pi / N_FRAMES:
        place = SIZE_M * [0.5, 0.45, 0.6] + rng.uniform(-0.5, 0.5, 3) * [1.0, 0.8, 0.5]
        roll, pitch = rng.uniform([-0.2, -0.2], [0.2, 0.5])
        poses.append(pose_matrix(rotation_from_rpy([roll, pitch, yaw]), place))
    return np.stack(poses)


def write_sequence(folder: Path) -> None:
    """Frames as 7-Scenes stores them, depth in millimetres by a camera of its own."""
    folder.mkdir(parents=True)
    room = furnished_room((4.0, 12.0, 40.0))
    render = RenderConfig()
    poses = room_from_cam()
    with open_renderer(room, pinhole(COLOR_PX), render) as renderer:
        for number, pose in enumerate(poses):
            rgb = renderer.render(pose)
            Image.fromarray(rgb).save(folder / f"frame-{number:06d}.color.png")
    with open_renderer(room, pinhole(DEPTH_PX), render) as renderer:
        for number, pose in enumerate(poses):
            depth_m = renderer.render_rgbd(pose)[1]
            depth_mm = np.where(np.isfinite(depth_m), np.round(1000.0 * depth_m), 65535)
            image = Image.fromarray(depth_mm.astype(np.uint16))
            image.save(folder / f"frame-{number:06d}.depth.png")
    for number, pose in enumerate(poses):
        np.savetxt(folder / f"frame-{number:06d}.pose.txt", SEQUENCE_FROM_ROOM @ pose)
