"""Raw data of Polycam ("keyframes"): images, cameras, depth and confidence by time stamp."""

from __future__ import annotations

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
LEAST_CONFIDENCE = 1  # of 0 to 255
ENTRIES = [f"t_{row}{column}" for row in range(3) for column in range(4)]


def _keyframes(path: Path) -> Path:
    return path / "keyframes" if (path / "keyframes").is_dir() else path


def _is_at(path: Path) -> bool:
    folder = _keyframes(path)
    return (folder / "images").is_dir() and any(
        (folder / name).is_dir() for name in ("cameras", "corrected_cameras")
    )


def _read(path: Path) -> Capture:
    folder = _keyframes(path)
    # After loop closure the app writes all anew, poses and undistorted images alike.
    corrected = (folder / "corrected_cameras").is_dir() and (folder / "corrected_images").is_dir()
    prefix = "corrected_" if corrected else ""
    files = sorted((folder / f"{prefix}cameras").glob("*.json"), key=lambda file: file.stem)
    frames, missing = [], []
    for file in files:
        photograph = folder / f"{prefix}images" / f"{file.stem}.jpg"
        if not photograph.is_file():
            missing.append(photograph.name)
            continue
        frames.append(_frame(folder, file, photograph))
    if not frames:
        raise InputError(folder / f"{prefix}cameras", "no camera has an image of its name")
    notes = [] if corrected else ["poses are those of the device, without loop closure"]
    if missing:
        notes.append(f"{len(missing)} cameras have no image ({missing[0]}, ...)")
    return Capture(path, FORMAT.name, tuple(frames), up=(0.0, 1.0, 0.0), notes=tuple(notes))


def _frame(folder: Path, file: Path, photograph: Path) -> CapturedFrame:
    with read_as(file, "a camera"):
        values = read_json(file)
    with read_as(file, "a camera", KeyError, TypeError, ValueError):
        matrix = np.array([float(values[name]) for name in ENTRIES]).reshape(3, 4)
        pinhole = [float(values[name]) for name in ("fx", "fy", "cx", "cy")]
        camera = calibration(int(values["width"]), int(values["height"]), pinhole, file)
    depth = existing(folder / "depth" / f"{file.stem}.png")
    confidence = folder / "confidence" / f"{file.stem}.png"
    size = image_size(photograph)
    if size != (camera.width, camera.height):
        camera = resized(camera, *size)
    return CapturedFrame(
        name=photograph.name,
        read_color=partial_read(read_photograph, photograph, *size),
        camera=camera,
        world_from_cam=rigid_pose(matrix, file) @ GL_FROM_CAM,
        read_depth_m=depth_reader(depth, MILLIMETRES, existing(confidence), LEAST_CONFIDENCE),
        depth_camera=resized(camera, *image_size(depth)) if depth else None,
        time_s=int(file.stem) / 1e6 if file.stem.isdecimal() else None,
        color_file=photograph,
    )


FORMAT = CaptureFormat(
    name="polycam",
    title="Polycam, raw data",
    marks="keyframes/images with keyframes/cameras",
    source="Polycam's repository polyform, its description of raw data",
    is_at=_is_at,
    read=_read,
)
