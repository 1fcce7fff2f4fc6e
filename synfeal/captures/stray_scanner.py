"""Recordings of Stray Scanner: a video, odometry, depth images and their confidence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from synfeal.captures.capture import (
    Capture,
    CapturedFrame,
    calibration,
    partial_read,
    quat_pose,
    resized,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, existing
from synfeal.captures.video import Video
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.images import image_size
from synfeal.errors import InputError, read_as

POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"]
PINHOLE = ["fx", "fy", "cx", "cy"]


def _is_at(path: Path) -> bool:
    return (path / "rgb.mp4").is_file() and (path / "odometry.csv").is_file()


def _read(path: Path) -> Capture:
    file = path / "odometry.csv"
    with read_as(file, "a table of odometry", OSError, ValueError):
        table = pd.read_csv(file, skipinitialspace=True)
    table.columns = table.columns.str.strip()
    for name in ("timestamp", "frame", *POSE):
        if name not in table.columns:
            raise InputError(file, f"has no column '{name}'", "record the scene again")
    with read_as(file, "a table of numbers", ValueError, TypeError):
        values = table.astype(np.float64)
    if not len(values):
        raise InputError(file, "holds no pose")
    video = Video(path / "rgb.mp4")
    shared = _matrix(path / "camera_matrix.csv")
    frames, lost = [], 0
    for row, entry in enumerate(values.to_dict("records")):
        number = int(entry["frame"])
        if number >= len(video):
            lost += 1
            continue
        place = f"{file}: line {row + 2}"
        pinhole = [entry[name] for name in PINHOLE] if "fx" in entry else shared
        camera = calibration(video.width, video.height, pinhole, place)
        frames.append(_frame(path, video, number, entry, camera, place))
    if not frames:
        raise InputError(path / "rgb.mp4", f"has no frame that {file.name} has a pose of")
    notes = (f"{lost} of {len(values)} poses have no frame in the video",) if lost else ()
    return Capture(path, FORMAT.name, tuple(frames), up=(0.0, 1.0, 0.0), notes=notes)


def _matrix(path: Path) -> list[float]:
    """Read fx, fy, cx, cy from a matrix of three rows."""
    with read_as(path, "a camera matrix", OSError, ValueError):
        matrix = np.loadtxt(path, delimiter=",", dtype=np.float64)
    if matrix.shape != (3, 3):
        raise InputError(path, "must hold three rows of three numbers")
    return [float(matrix[0, 0]), float(matrix[1, 1]), float(matrix[0, 2]), float(matrix[1, 2])]


def _frame(
    path: Path, video: Video, number: int, entry: dict[Any, float], camera: Any, place: str
) -> CapturedFrame:
    depth = existing(path / "depth" / f"{number:06d}.png")
    confidence = path / "confidence" / f"{number:06d}.png"
    return CapturedFrame(
        name=f"{number:06d}",
        read_color=partial_read(video.read, number),
        camera=camera,
        # The app turns ARKit's camera to x right, y down, z forward before it writes it.
        world_from_cam=quat_pose(
            [entry[name] for name in POSE[:3]], [entry[name] for name in POSE[3:]], place
        ),
        read_depth_m=depth_reader(depth, MILLIMETRES, existing(confidence)),
        depth_camera=resized(camera, *image_size(depth)) if depth else None,
        time_s=entry["timestamp"],
    )


FORMAT = CaptureFormat(
    name="stray-scanner",
    title="Stray Scanner",
    marks="rgb.mp4 with odometry.csv",
    source="Format of the data, in the documentation of Stray Scanner",
    is_at=_is_at,
    read=_read,
)
