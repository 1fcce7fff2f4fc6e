"""All data of 3d Scanner App: a photograph, a depth image and a description for each frame."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from synfeal.captures.capture import (
    GL_FROM_CAM,
    Capture,
    CapturedFrame,
    calibration,
    partial_read,
    resized,
    rigid_pose,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, existing, read_photograph
from synfeal.dataset.images import image_size
from synfeal.errors import InputError, read_as
from synfeal.records.files import read_json

MILLIMETRES = 1000.0
DESCRIPTION = re.compile(r"frame_(\d+)\.json")


def _is_at(path: Path) -> bool:
    return path.is_dir() and next(path.glob("frame_*.json"), None) is not None


def _read(path: Path) -> Capture:
    found = [(match[1], file) for file in path.iterdir() if (match := _matched(file))]
    found.sort(key=lambda item: int(item[0]))
    frames, missing = [], []
    for number, file in found:
        photograph = path / f"frame_{number}.jpg"
        if photograph.is_file():
            frames.append(_frame(path, number, file, photograph))
        else:
            missing.append(photograph.name)
    if not frames:
        raise InputError(path, "no frame_00000.json has its frame_00000.jpg", "export all data")
    notes: tuple[str, ...] = ()
    if missing:
        # The app describes every frame of its depth camera and keeps a photograph of some.
        notes = (f"{len(missing)} of {len(found)} frames have no photograph",)
    return Capture(path, FORMAT.name, tuple(frames), up=(0.0, 1.0, 0.0), notes=notes)


def _matched(file: Path) -> re.Match[str] | None:
    return DESCRIPTION.fullmatch(file.name)


def _frame(path: Path, number: str, file: Path, photograph: Path) -> CapturedFrame:
    with read_as(file, "a description of a frame"):
        values = read_json(file)
    with read_as(file, "a description of a frame", KeyError, TypeError, ValueError):
        matrix = np.array(values["cameraPoseARFrame"], np.float64).reshape(4, 4)
        intrinsics = np.array(values["intrinsics"], np.float64).reshape(3, 3)
        time_s = None if values.get("time") is None else float(values["time"])
    size = image_size(photograph)
    pinhole = intrinsics[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    camera = calibration(*size, pinhole, file)
    depth = existing(path / f"depth_{number}.png")
    confidence = path / f"conf_{number}.png"
    return CapturedFrame(
        name=photograph.name,
        read_color=partial_read(read_photograph, photograph, *size),
        camera=camera,
        world_from_cam=rigid_pose(matrix, file) @ GL_FROM_CAM,
        read_depth_m=depth_reader(depth, MILLIMETRES, existing(confidence)),
        depth_camera=resized(camera, *image_size(depth)) if depth else None,
        time_s=time_s,
        color_file=photograph,
    )


FORMAT = CaptureFormat(
    name="3d-scanner-app",
    title="3d Scanner App, all data",
    marks="frame_00000.json with frame_00000.jpg",
    source="3d Scanner App's help, Export all data; ARKit, ARCamera.transform",
    is_at=_is_at,
    read=_read,
)
