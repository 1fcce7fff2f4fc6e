"""Captures of a stand-in room in every format, written by the formats' public descriptions.

The truth is the room and the poses that it was drawn from; nothing here reads what it writes.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
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
WIDTH, HEIGHT = 240, 180
DEPTH_WIDTH, DEPTH_HEIGHT = 120, 90
FOCAL_PX, CX, CY = 180.0, 118.0, 92.5
N_FRAMES = 40
# Of ARKit: y up. Applied to points of the room, whose z is up.
Y_UP_FROM_ROOM = pose_matrix([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]], [0.3, -1.1, 2.0])
# Of programs that know no vertical: turned and moved anyhow.
LEANING_FROM_ROOM = pose_matrix(
    Rotation.from_euler("ZYX", [130.0, 15.0, 32.0], degrees=True).as_matrix(), [2.0, -7.0, 0.5]
)
Z_UP_FROM_ROOM = pose_matrix(Rotation.from_euler("Z", 40.0, degrees=True).as_matrix(), [1, 2, 0])
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # between OpenCV's and OpenGL's camera


def camera(width: int, height: int, focal_change: float = 1.0) -> CameraConfig:
    """The camera of the photographs, or the same view in fewer pixels."""
    x, y = width / WIDTH, height / HEIGHT
    return CameraConfig(
        width=width,
        height=height,
        fx=FOCAL_PX * x * focal_change,
        fy=FOCAL_PX * y * focal_change,
        cx=CX * x,
        cy=CY * y,
    )


@dataclass(frozen=True)
class Shots:
    """A capture: photographs (N, H, W, 3), depth (N, h, w) in metres, 0 for none, poses."""

    rgb: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    small_depth_m: NDArray[np.float32]
    room_from_cam: Array


@cache
def shots() -> Shots:
    """Once round the room, up and down, never quite upright."""
    rng = np.random.default_rng(3)
    poses = []
    for yaw in np.arange(N_FRAMES) * 2.0 * np.pi / N_FRAMES:
        place = SIZE_M * [0.5, 0.45, 0.6] + rng.uniform(-0.5, 0.5, 3) * [1.0, 0.8, 0.5]
        roll, pitch = rng.uniform([-0.2, -0.2], [0.2, 0.5])
        poses.append(pose_matrix(rotation_from_rpy([roll, pitch, yaw]), place))
    room = furnished_room((4.0, 12.0, 40.0))
    rgb, depth_m, small_m = [], [], []
    with open_renderer(room, camera(WIDTH, HEIGHT), RenderConfig()) as renderer:
        for pose in poses:
            image, far_m = renderer.render_rgbd(pose)
            rgb.append(image)
            depth_m.append(far_m)
    with open_renderer(room, camera(DEPTH_WIDTH, DEPTH_HEIGHT), RenderConfig()) as renderer:
        small_m = [renderer.render_rgbd(pose)[1] for pose in poses]
    return Shots(np.array(rgb), _finite(depth_m), _finite(small_m), np.array(poses))


def _finite(depth_m: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    stacked = np.array(depth_m, np.float32)
    return np.where(np.isfinite(stacked), stacked, np.float32(0.0))


def _png(path: Path, pixels: NDArray[np.generic]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path)


def _jpeg(path: Path, pixels: NDArray[np.generic]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path, quality=95)


def _mm(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    return np.round(depth_m * 1000.0).astype(np.uint16)


def _text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _rows(matrix: Array) -> str:
    return "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in matrix)


def _opencv_matrix(width: int, height: int) -> Array:
    """The camera matrix (4, 4) where the first pixel's centre is at 0."""
    one = camera(width, height)
    matrix = np.eye(4)
    matrix[:3, :3] = one.intrinsics.matrix(-0.5)
    return matrix


def seven_scenes(folder: Path) -> Array:
    """Without a calibration the Kinect's is taken, so this is a data set with its manifest."""
    seen = shots()
    for number, pose in enumerate(seen.room_from_cam):
        stem = f"frame-{number:06d}"
        _png(folder / f"{stem}.color.png", seen.rgb[number])
        _png(folder / f"{stem}.depth.png", _mm(seen.depth_m[number]))
        _text(folder / f"{stem}.pose.txt", _rows(LEANING_FROM_ROOM @ pose))
    _text(folder / "manifest.json", json.dumps({"camera": camera(WIDTH, HEIGHT).record}))
    return LEANING_FROM_ROOM


def twelve_scenes(folder: Path) -> Array:
    seen = shots()
    for number, pose in enumerate(seen.room_from_cam):
        stem = f"frame-{number:06d}"
        _jpeg(folder / "data" / f"{stem}.color.jpg", seen.rgb[number])
        _png(folder / "data" / f"{stem}.depth.png", _mm(seen.small_depth_m[number]))
        _text(folder / "data" / f"{stem}.pose.txt", _rows(LEANING_FROM_ROOM @ pose))
    color, depth = _opencv_matrix(WIDTH, HEIGHT), _opencv_matrix(DEPTH_WIDTH, DEPTH_HEIGHT)
    lines = {
        "m_versionNumber": 4,
        "m_sensorName": "StructureSensor",
        "m_colorWidth": WIDTH,
        "m_colorHeight": HEIGHT,
        "m_depthWidth": DEPTH_WIDTH,
        "m_depthHeight": DEPTH_HEIGHT,
        "m_depthShift": 1000,
        "m_calibrationColorIntrinsic": " ".join(map(str, color.ravel())),
        "m_calibrationColorExtrinsic": " ".join(map(str, np.eye(4).ravel())),
        "m_calibrationDepthIntrinsic": " ".join(map(str, depth.ravel())),
        "m_calibrationDepthExtrinsic": " ".join(map(str, np.eye(4).ravel())),
        "m_frames.size": len(seen.rgb),
    }
    _text(folder / "info.txt", "".join(f"{key} = {value}\n" for key, value in lines.items()))
    return LEANING_FROM_ROOM


def scannet(folder: Path) -> Array:
    """Frames that are numbered without zeros; where tracking was lost poses are -inf."""
    seen = shots()
    for number, pose in enumerate(seen.room_from_cam):
        _jpeg(folder / "color" / f"{number}.jpg", seen.rgb[number])
        _png(folder / "depth" / f"{number}.png", _mm(seen.small_depth_m[number]))
        _text(folder / "pose" / f"{number}.txt", _rows(Z_UP_FROM_ROOM @ pose))
    _jpeg(folder / "color" / f"{len(seen.rgb)}.jpg", seen.rgb[0])
    _png(folder / "depth" / f"{len(seen.rgb)}.png", _mm(seen.small_depth_m[0]))
    _text(folder / "pose" / f"{len(seen.rgb)}.txt", _rows(np.full((4, 4), -np.inf)))
    for kind, size in (("color", (WIDTH, HEIGHT)), ("depth", (DEPTH_WIDTH, DEPTH_HEIGHT))):
        _text(folder / "intrinsic" / f"intrinsic_{kind}.txt", _rows(_opencv_matrix(*size)))
        _text(folder / "intrinsic" / f"extrinsic_{kind}.txt", _rows(np.eye(4)))
    return Z_UP_FROM_ROOM


def transforms(folder: Path) -> Array:
    """Write as nerfstudio: OpenGL's camera, its own depth units, an entry overridden by a frame."""
    seen = shots()
    one = camera(WIDTH, HEIGHT)
    frames = []
    for number, pose in enumerate(seen.room_from_cam):
        _png(folder / "images" / f"frame_{number:05d}.png", seen.rgb[number])
        _png(folder / "depth" / f"frame_{number:05d}.png", _mm(seen.depth_m[number]))
        frames.append(
            {
                "file_path": f"images/frame_{number:05d}.png",
                "depth_file_path": f"depth/frame_{number:05d}.png",
                "transform_matrix": (Z_UP_FROM_ROOM @ pose @ FLIP).tolist(),
                "fl_x": FOCAL_PX,
                "fl_y": FOCAL_PX,
            }
        )
    values = {"camera_model": "OPENCV", "w": WIDTH, "h": HEIGHT, "fl_x": 1.0, "fl_y": 1.0}
    values |= {"cx": one.cx, "cy": one.cy, "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}
    values |= {"frames": frames[::-1]}
    _text(folder / "transforms.json", json.dumps(values))
    return Z_UP_FROM_ROOM


def record3d(path: Path) -> Array:
    """One zip: quaternion first in its poses, x y z w; the matrix column by column."""
    import lzfse

    seen = shots()
    poses = Y_UP_FROM_ROOM @ seen.room_from_cam @ FLIP
    quat_xyzw = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    matrix = camera(WIDTH, HEIGHT).intrinsics.matrix()
    metadata = {
        "w": WIDTH,
        "h": HEIGHT,
        "dw": DEPTH_WIDTH,
        "dh": DEPTH_HEIGHT,
        "fps": 30,
        "K": matrix.T.ravel().tolist(),
        "poses": np.concatenate([quat_xyzw, poses[:, :3, 3]], axis=1).tolist(),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("metadata", json.dumps(metadata))
        for number, rgb in enumerate(seen.rgb):
            image = io.BytesIO()
            Image.fromarray(rgb).save(image, "JPEG", quality=95)
            packed.writestr(f"rgbd/{number}.jpg", image.getvalue())
            depth_m = np.where(seen.small_depth_m[number] > 0, seen.small_depth_m[number], np.nan)
            packed.writestr(f"rgbd/{number}.depth", lzfse.compress(depth_m.tobytes()))
            sure = np.full(depth_m.shape, 2, np.uint8)
            packed.writestr(f"rgbd/{number}.conf", lzfse.compress(sure.tobytes()))
    return Y_UP_FROM_ROOM


def stray_scanner(folder: Path) -> Array:
    import cv2

    seen = shots()
    folder.mkdir(parents=True)
    code = cv2.VideoWriter.fourcc(*"mp4v")
    video = cv2.VideoWriter(str(folder / "rgb.mp4"), code, 60.0, (WIDTH, HEIGHT))
    poses = Y_UP_FROM_ROOM @ seen.room_from_cam
    quat_xyzw = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    for number, rgb in enumerate(seen.rgb):
        video.write(np.ascontiguousarray(rgb[..., ::-1]))
        _png(folder / "depth" / f"{number:06d}.png", _mm(seen.small_depth_m[number]))
        sure = np.full((DEPTH_HEIGHT, DEPTH_WIDTH), 2, np.uint8)
        _png(folder / "confidence" / f"{number:06d}.png", sure)
        values = [*poses[number, :3, 3], *quat_xyzw[number]]
        numbers = ", ".join(f"{value:.9f}" for value in values)
        lines.append(f"{1000.0 + number / 60.0:.6f}, {number:06d}, {numbers}")
    video.release()
    _text(folder / "odometry.csv", "\n".join(lines) + "\n")
    matrix = camera(WIDTH, HEIGHT).intrinsics.matrix()
    _text(folder / "camera_matrix.csv", "".join(", ".join(map(str, r)) + "\n" for r in matrix))
    return Y_UP_FROM_ROOM


def polycam(folder: Path) -> Array:
    """Raw data: ARKit's pose row by row, a calibration for each photograph."""
    seen = shots()
    keyframes = folder / "keyframes"
    for number, pose in enumerate(seen.room_from_cam):
        name = f"{1_700_000_000_000_000 + 33_333 * number}"
        _jpeg(keyframes / "corrected_images" / f"{name}.jpg", seen.rgb[number])
        _jpeg(keyframes / "images" / f"{name}.jpg", seen.rgb[number])
        _png(keyframes / "depth" / f"{name}.png", _mm(seen.small_depth_m[number]))
        sure = np.full((DEPTH_HEIGHT, DEPTH_WIDTH), 255, np.uint8)
        _png(keyframes / "confidence" / f"{name}.png", sure)
        matrix = Y_UP_FROM_ROOM @ pose @ FLIP
        values = {
            f"t_{row}{column}": matrix[row, column] for row in range(3) for column in range(4)
        }
        values |= {"fx": FOCAL_PX, "fy": FOCAL_PX, "cx": CX, "cy": CY}
        values |= {"width": WIDTH, "height": HEIGHT, "blur_score": 90.0}
        _text(keyframes / "corrected_cameras" / f"{name}.json", json.dumps(values))
    return Y_UP_FROM_ROOM


def scanner_app(folder: Path) -> Array:
    """All data of 3d Scanner App; every third frame of the depth camera has a photograph."""
    seen = shots()
    for number, pose in enumerate(seen.room_from_cam):
        name = f"{3 * number:05d}"
        _jpeg(folder / f"frame_{name}.jpg", seen.rgb[number])
        _png(folder / f"depth_{name}.png", _mm(seen.small_depth_m[number]))
        _png(folder / f"conf_{name}.png", np.full((DEPTH_HEIGHT, DEPTH_WIDTH), 2, np.uint8))
        values = {
            "cameraPoseARFrame": (Y_UP_FROM_ROOM @ pose @ FLIP).ravel().tolist(),
            "intrinsics": camera(WIDTH, HEIGHT).intrinsics.matrix().ravel().tolist(),
            "time": 5000.0 + 0.1 * number,
        }
        _text(folder / f"frame_{name}.json", json.dumps(values))
        _text(folder / f"frame_{3 * number + 1:05d}.json", json.dumps(values))
    return Y_UP_FROM_ROOM


def arkitscenes(folder: Path) -> Array:
    """Photographs between the poses of the trajectory, which lead from the world to the camera."""
    seen = shots()
    cam_from_world = np.linalg.inv(Z_UP_FROM_ROOM @ seen.room_from_cam)
    rotvec = Rotation.from_matrix(cam_from_world[:, :3, :3]).as_rotvec()
    lines = []
    for number, rgb in enumerate(seen.rgb):
        stamp = f"{100.0 + 0.1 * number:.3f}"
        name = f"40753679_{stamp}"
        _png(folder / "lowres_wide" / f"{name}.png", rgb)
        _png(folder / "lowres_depth" / f"{name}.png", _mm(seen.depth_m[number]))
        _png(folder / "confidence" / f"{name}.png", np.full((HEIGHT, WIDTH), 2, np.uint8))
        text = f"{WIDTH} {HEIGHT} {FOCAL_PX} {FOCAL_PX} {CX} {CY}"
        _text(folder / "lowres_wide_intrinsics" / f"{name}.pincam", text)
        values = [*rotvec[number], *cam_from_world[number, :3, 3]]
        lines.append(stamp + " " + " ".join(f"{value:.12f}" for value in values))
    _text(folder / "lowres_wide.traj", "\n".join(lines) + "\n")
    return Z_UP_FROM_ROOM


def _quat_wxyz(matrix: Array) -> Array:
    return Rotation.from_matrix(matrix[:3, :3]).as_quat()[[3, 0, 1, 2]]


def colmap(folder: Path) -> Array:
    """A model as text in sparse/0, names with blanks, depth maps beside."""
    seen = shots()
    lines = []
    for number, pose in enumerate(seen.room_from_cam):
        name = f"hall/my photo {number:03d}.png"
        _png(folder / "images" / name, seen.rgb[number])
        _png(folder / "depth" / name, _mm(seen.depth_m[number]))
        cam_from_world = np.linalg.inv(LEANING_FROM_ROOM @ pose)
        values = [*_quat_wxyz(cam_from_world), *cam_from_world[:3, 3]]
        numbers = " ".join(f"{value:.12f}" for value in values)
        lines += [f"{number + 1} {numbers} 1 {name}", ""]
    _text(folder / "sparse/0/images.txt", "\n".join(lines) + "\n")
    model = f"1 PINHOLE {WIDTH} {HEIGHT} {FOCAL_PX} {FOCAL_PX} {CX} {CY}\n"
    _text(folder / "sparse/0/cameras.txt", model)
    _text(folder / "sparse/0/points3D.txt", "")
    return LEANING_FROM_ROOM


def colmap_binary(folder: Path) -> Array:
    """The same, as COLMAP itself writes it in binary."""
    import pycolmap

    world_from_room = colmap(folder)
    text = folder / "sparse/0/images.txt"
    text.write_text(text.read_text().replace("my photo ", "photo"))
    for file in sorted((folder / "images/hall").iterdir()):
        new = file.name.replace("my photo ", "photo")
        file.rename(file.with_name(new))
        (folder / "depth/hall" / file.name).rename(folder / "depth/hall" / new)
    model = pycolmap.Reconstruction(folder / "sparse/0")
    for kind in ("cameras", "images", "points3D"):
        (folder / f"sparse/0/{kind}.txt").unlink()
    model.write_binary(folder / "sparse/0")
    return world_from_room


def tum(folder: Path, count: int = 12) -> Array:
    """A few frames of the benchmark's layout, whose Kinect is not calibrated.

    Depth is taken a little after the photographs; poses come at a hundred a second, one of them at
    the time of each photograph.
    """
    room = furnished_room((4.0, 12.0, 40.0))
    kinect = CameraConfig(width=640, height=480, fx=525.0, fy=525.0, cx=320.0, cy=240.0)
    rgb_lines, depth_lines, pose_lines = ["# colour"], ["# depth"], ["# ground truth"]
    with open_renderer(room, kinect, RenderConfig()) as renderer:
        for number, pose in enumerate(shots().room_from_cam[:count]):
            image, depth_m = renderer.render_rgbd(pose)
            time_s = 1305031229.5 + 0.1 * number
            stamp, later = f"{time_s:.6f}", f"{time_s + 0.004:.6f}"
            _png(folder / f"rgb/{stamp}.png", image)
            stored = np.where(np.isfinite(depth_m), depth_m, 0.0) * 5000.0
            _png(folder / f"depth/{later}.png", np.round(stored).astype(np.uint16))
            rgb_lines.append(f"{stamp} rgb/{stamp}.png")
            depth_lines.append(f"{later} depth/{later}.png")
            matrix = LEANING_FROM_ROOM @ pose
            quat_xyzw = Rotation.from_matrix(matrix[:3, :3]).as_quat()
            for offset_s in (0.0, 0.01):  # the sensor rests for a moment
                values = " ".join(f"{v:.9f}" for v in (*matrix[:3, 3], *quat_xyzw))
                pose_lines.append(f"{time_s + offset_s:.6f} {values}")
    for name, lines in (("rgb", rgb_lines), ("depth", depth_lines), ("groundtruth", pose_lines)):
        _text(folder / f"{name}.txt", "\n".join(lines) + "\n")
    return LEANING_FROM_ROOM


WRITERS: dict[str, Callable[[Path], Array]] = {
    "7scenes": seven_scenes,
    "12scenes": twelve_scenes,
    "scannet": scannet,
    "transforms": transforms,
    "record3d": record3d,
    "stray-scanner": stray_scanner,
    "polycam": polycam,
    "3d-scanner-app": scanner_app,
    "arkitscenes": arkitscenes,
    "colmap": colmap,
    "colmap-binary": colmap_binary,
}
