"""A ROS 2 bag for each sequence: colour, depth, camera, odometry and transforms.

Sources: sensor_msgs and nav_msgs of ROS 2 Humble; REP 103 (optical frames are x right, y down, z
forward, as here); REP 118 (depth images ``16UC1`` in millimetres, 0 where there is none). Pixel
centres of ``CameraInfo`` are at whole numbers, as OpenCV's, so its principal point is half a pixel
less than ours.

Frames are 1/30 s apart by their numbers, and the first is at 1 s: a time of 0 means "the latest" to
ROS. The twist of the odometry is not known: it is 0, and so are all covariances.
"""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from synfeal.dataset.depth import MILLIMETRES, read_depth_m
from synfeal.dataset.images import read_rgb
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.errors import Argument, InputError
from synfeal.exporting.frames import ExportFrame, ExportSet, Place, need_perspective
from synfeal.geometry.poses import quat_wxyz_of

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

FRAMES_PER_S = 30
FIRST_NS = 10**9
WORLD, CAMERA = "world", "camera_color_optical_frame"
COLOR, DEPTH = "/camera/color", "/camera/depth"
SQLITE_DISK = {sqlite3.SQLITE_FULL: errno.ENOSPC, sqlite3.SQLITE_IOERR: errno.EIO}
Messages = Iterator[tuple[str, Any]]  # topic and message


def export_rosbag(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``seq-XX/{metadata.yaml,seq-XX.db3}`` and the files that list the splits.

    Raises:
        InputError: The package rosbags is not there, or the camera is a fisheye or a panorama.
    """
    need_perspective(data, "a bag's depth image (REP 118)")
    try:
        from rosbags.typesys import Stores, get_typestore
    except ModuleNotFoundError as error:
        raise InputError(
            Argument("to"),
            "rosbag needs the package rosbags, which is not there",
            "pip install 'synfeal[ros]'",
        ) from error
    store = get_typestore(Stores.ROS2_HUMBLE)
    for sequence, frames in groupby(data.frames, key=lambda frame: frame.sequence):
        _write_bag(out / sequence, data, store, frames, place)
    if data.has_splits:
        for name in SPLIT_FILES.values():
            shutil.copyfile(data.path / name, out / name)


def _write_bag(
    path: Path, data: ExportSet, store: Typestore, frames: Iterator[ExportFrame], place: Place
) -> None:
    from rosbags.rosbag2 import Writer

    with _disk_errors(path), Writer(path, version=9) as writer:
        connections: dict[str, Any] = {}
        for frame in frames:
            time_ns = FIRST_NS + frame.frame.number * 10**9 // FRAMES_PER_S
            for topic, message in _messages(data, store, frame, time_ns):
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                content = store.serialize_cdr(message, kind)
                writer.write(connections[topic], time_ns, content)
            place(frame.color, None)


@contextmanager
def _disk_errors(path: Path) -> Iterator[None]:
    """Raise what SQLite says of a full disk, or of one that fails, as ``OSError``."""
    try:
        yield
    except sqlite3.Error as error:
        code = getattr(error, "sqlite_errorcode", None)
        if code is None or code & 0xFF not in SQLITE_DISK:
            raise
        number = SQLITE_DISK[code & 0xFF]
        raise OSError(number, os.strerror(number), str(path)) from error


def _messages(data: ExportSet, store: Typestore, frame: ExportFrame, time_ns: int) -> Messages:
    """Return all messages of one frame."""
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    optical = types["std_msgs/msg/Header"](stamp=stamp, frame_id=CAMERA)
    in_world = types["std_msgs/msg/Header"](stamp=stamp, frame_id=WORLD)
    info = _camera_info(data, store, optical)
    yield f"{COLOR}/image_raw", _image(store, optical, read_rgb(frame.color), "rgb8")
    yield f"{COLOR}/camera_info", info
    if data.has_depth:
        yield f"{DEPTH}/image_raw", _depth_image(data, store, optical, frame)
        yield f"{DEPTH}/camera_info", info
    yield from _poses(store, frame, in_world)


def _depth_image(data: ExportSet, store: Typestore, header: Any, frame: ExportFrame) -> Any:
    """Build the depth image of a frame: millimetres, or metres where those would not hold it."""
    if data.camera.depth_units_per_m is not None:
        depth_m = read_depth_m(frame.depth, nothing=np.nan)
        return _image(store, header, depth_m, "32FC1")
    depth_m = read_depth_m(frame.depth, nothing=0.0)
    depth_mm = np.round(depth_m * np.float32(MILLIMETRES)).astype(np.uint16)
    return _image(store, header, depth_mm, "16UC1")


def _image(store: Typestore, header: Any, pixels: np.ndarray, encoding: str) -> Any:
    """Build a ``sensor_msgs/Image`` of pixels (H, W) or (H, W, 3)."""
    content = np.ascontiguousarray(pixels)
    height, width = content.shape[:2]
    return store.types["sensor_msgs/msg/Image"](
        header=header,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=content.nbytes // height,
        data=content.astype(content.dtype.newbyteorder("<"), copy=False).view(np.uint8).ravel(),
    )


def _camera_info(data: ExportSet, store: Typestore, header: Any) -> Any:
    """Build a ``sensor_msgs/CameraInfo``: OpenCV's camera, nothing cut out and not rectified."""
    camera = data.camera
    matrix = camera.intrinsics.matrix()
    matrix[:2, 2] -= 0.5
    region = store.types["sensor_msgs/msg/RegionOfInterest"](
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    return store.types["sensor_msgs/msg/CameraInfo"](
        header=header,
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=np.array(camera.distortion, np.float64),
        k=matrix.ravel(),
        r=np.eye(3).ravel(),
        p=np.hstack([matrix, np.zeros((3, 1))]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=region,
    )


def _poses(store: Typestore, frame: ExportFrame, header: Any) -> Messages:
    """Build ``nav_msgs/Odometry`` and ``tf2_msgs/TFMessage`` of ``world_from_cam``."""
    types = store.types
    x, y, z = frame.world_from_cam[:3, 3].tolist()
    qw, qx, qy, qz = quat_wxyz_of(frame.world_from_cam).tolist()
    rotation = types["geometry_msgs/msg/Quaternion"](x=qx, y=qy, z=qz, w=qw)
    vector = types["geometry_msgs/msg/Vector3"]
    none = vector(x=0.0, y=0.0, z=0.0)
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=x, y=y, z=z), orientation=rotation
    )
    yield (
        "/odom",
        types["nav_msgs/msg/Odometry"](
            header=header,
            child_frame_id=CAMERA,
            pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
            twist=types["geometry_msgs/msg/TwistWithCovariance"](
                twist=types["geometry_msgs/msg/Twist"](linear=none, angular=none),
                covariance=np.zeros(36),
            ),
        ),
    )
    transform = types["geometry_msgs/msg/TransformStamped"](
        header=header,
        child_frame_id=CAMERA,
        transform=types["geometry_msgs/msg/Transform"](
            translation=vector(x=x, y=y, z=z), rotation=rotation
        ),
    )
    yield "/tf", types["tf2_msgs/msg/TFMessage"](transforms=[transform])
