"""Rooms with painted walls, photographed and mapped: depth and poses are exact."""

import cv2
import numpy as np
from PIL import Image

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import encode_depth
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.sevenscenes import pose_text
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.records.files import write_json
from tests.support.room_scene import Room, cast, painted, random_texture

SIZE_M = (5.0, 6.0, 3.0)
FRAME = CameraConfig(width=176, height=132, horizontal_fov_deg=62.0)
# Another lens, other sides, and the principal point beside the middle.
PHOTO = CameraConfig(width=270, height=180, fx=248.0, fy=248.0, cx=128.0, cy=95.0)
ROOM = Room((((0.0, 0.0, 0.0), SIZE_M),))


def textures(seed):
    """Six of them (6), one for each side of a room."""
    rng = np.random.default_rng(seed)
    return [random_texture(rng) for _ in range(6)]


def looking_about(count, seed):
    """Poses (N, 4, 4) near the middle of the room that look along x, give or take."""
    rng = np.random.default_rng(seed)
    return np.stack(
        [
            pose_matrix(
                rotation_from_rpy(rng.uniform([-0.1, -0.1, -0.7], [0.1, 0.3, 0.7])),
                rng.uniform([1.2, 2.3, 1.2], [2.0, 3.7, 1.8]),
            )
            for _ in range(count)
        ]
    )


def write_frames(folder, paint, poses, camera=FRAME, depth_camera=None, depth_from_color=None):
    """Frames of 7-Scenes, depth as a camera beside sees it where one is given."""
    folder.mkdir(parents=True)
    beside = np.eye(4) if depth_from_color is None else np.linalg.inv(depth_from_color)
    for number, pose in enumerate(poses):
        stem = folder / f"frame-{number:06d}"
        image = np.asarray(painted(paint, pose, SIZE_M, camera))
        stem.with_suffix(".color.png").write_bytes(encode_png(image))
        depth_m = cast(pose @ beside, ROOM, depth_camera or camera)[0]
        stem.with_suffix(".depth.png").write_bytes(encode_depth(depth_m))
        stem.with_suffix(".pose.txt").write_text(pose_text(pose))


def write_dataset(folder, paint, poses, camera=FRAME):
    """A data set of collect, as far as maps read it."""
    write_frames(folder / "seq-01", paint, poses, camera)
    (folder / "TrainSplit.txt").write_text("sequence1\n")
    (folder / "TestSplit.txt").write_text("")
    write_json(folder / "manifest.json", {"camera": camera.record})


def write_photographs(folder, paint, poses, camera=PHOTO, lens=None):
    """Photographs, through a lens of OpenCV's coefficients where they are given."""
    folder.mkdir(parents=True)
    for number, pose in enumerate(poses):
        image = np.asarray(painted(paint, pose, SIZE_M, camera))
        if lens is not None:
            image = bent(image, camera, lens)
        Image.fromarray(image).save(folder / f"photo-{number:02d}.png")


def bent(image, camera, lens):
    """Distort a pinhole image as a lens does; OpenCV puts the first pixel's centre at (0, 0)."""
    matrix = camera.intrinsics.matrix(-0.5)
    column, row = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    pixel = np.stack([column, row], axis=-1).reshape(-1, 1, 2).astype(np.float64)
    straight = cv2.undistortPoints(pixel, matrix, np.array(lens), P=matrix)
    where = straight.reshape(camera.height, camera.width, 2).astype(np.float32)
    return cv2.remap(image, where[..., 0], where[..., 1], cv2.INTER_CUBIC)


def write_calibration(path, camera, lens=(0.0, 0.0, 0.0, 0.0, 0.0)):
    """An OpenCV file of a camera."""
    values = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_matrix": camera.intrinsics.matrix(-0.5).tolist(),
        "distortion_coefficients": list(lens),
    }
    write_json(path, values)
    return path
