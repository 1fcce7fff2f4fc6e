"""Recordings of Record3D (``.r3d``): a zip of JPEG images and depth compressed with LZFSE."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from synfeal.captures.capture import (
    GL_FROM_CAM,
    Capture,
    CapturedFrame,
    Colors,
    Depth,
    calibration,
    partial_read,
    quat_pose,
    resized,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import confident, decode_photograph
from synfeal.dataset.frame_files import MOST_BYTES, reading
from synfeal.errors import InputError, read_as

SUFFIX = ".r3d"
LEAST_CONFIDENCE = 1  # of 0, 1, 2


def _is_at(path: Path) -> bool:
    if path.is_dir():
        return (path / "metadata").is_file() and (path / "rgbd").is_dir()
    return path.suffix.lower() == SUFFIX


def _member(path: Path, name: str) -> bytes:
    """Read a file of a recording, packed or unpacked."""
    if path.is_dir():
        with read_as(path / name, "a part of a recording", OSError):
            return (path / name).read_bytes()
    with read_as(path, "a recording", OSError, KeyError), reading(path) as opened:
        info = opened.getinfo(name)
        if info.file_size > MOST_BYTES:
            raise OSError(f"{name} claims {info.file_size} bytes")
        return opened.read(info)


def _names(path: Path) -> set[str]:
    if path.is_dir():
        return {f"rgbd/{file.name}" for file in (path / "rgbd").iterdir()}
    with read_as(path, "a recording", OSError, zipfile.BadZipFile), reading(path) as opened:
        return set(opened.namelist())


def _read(path: Path) -> Capture:
    place = f"{path}: metadata"
    with read_as(place, "the description of a recording", ValueError):
        values = json.loads(_member(path, "metadata"))
    if not isinstance(values, dict):
        raise InputError(place, "must hold a mapping of keys")
    with read_as(place, "the description of a recording", KeyError, TypeError, ValueError):
        width, height = int(values["w"]), int(values["h"])
        poses = [[float(value) for value in pose] for pose in values["poses"]]
        pinholes = _pinholes(values, len(poses))
        rate_hz = float(values.get("fps", 60.0))
    names = _names(path)
    depth_size = (int(values.get("dw", 0)), int(values.get("dh", 0)))
    with_depth = "rgbd/0.depth" in names and min(depth_size) > 0
    frames = []
    for index, pose in enumerate(poses):
        name = f"rgbd/{index}.jpg"
        if name not in names:
            continue
        if len(pose) != 7:
            raise InputError(place, f"poses[{index}] must hold seven numbers")
        camera = calibration(width, height, pinholes[index], place)
        world_from_gl = quat_pose(pose[4:], pose[:4], f"{place}: poses[{index}]")
        confidence = f"rgbd/{index}.conf"
        frames.append(
            CapturedFrame(
                name=name,
                read_color=partial_read(_photograph, path, name),
                camera=camera,
                world_from_cam=world_from_gl @ GL_FROM_CAM,
                read_depth_m=partial_read(_depth_m, path, index, depth_size, confidence in names)
                if with_depth
                else None,
                depth_camera=resized(camera, *depth_size) if with_depth else None,
                time_s=index / rate_hz,
            )
        )
    if not frames:
        raise InputError(path, "holds no rgbd/0.jpg", "export the recording again")
    lost = len(poses) - len(frames)
    notes = (f"{lost} of {len(poses)} poses have no photograph",) if lost else ()
    return Capture(path, FORMAT.name, tuple(frames), up=(0.0, 1.0, 0.0), notes=notes)


def _pinholes(values: dict[str, Any], n_frames: int) -> list[tuple[float, ...]]:
    """Return fx, fy, cx, cy of each frame: one matrix, column by column, or numbers per frame."""
    each = values.get("perFrameIntrinsicCoeffs")
    if each is not None:
        return [tuple(float(value) for value in row[:4]) for row in each]
    matrix = np.array(values["K"], np.float64).reshape(3, 3).T
    one = (matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2])
    return [one] * n_frames


def _photograph(path: Path, name: str) -> Colors:
    return decode_photograph(_member(path, name), f"{path}: {name}")


def _depth_m(path: Path, index: int, size: tuple[int, int], with_confidence: bool) -> Depth:
    depth_m = _unpacked(path, f"rgbd/{index}.depth", size, np.float32).astype(np.float32)
    depth_m = np.where(np.isfinite(depth_m), depth_m, np.float32(0.0))
    if not with_confidence:
        return depth_m
    name = f"rgbd/{index}.conf"
    return confident(depth_m, _unpacked(path, name, size, np.uint8), LEAST_CONFIDENCE, name)


def _unpacked(path: Path, name: str, size: tuple[int, int], kind: Any) -> Any:
    """Decompress an image (H, W) of one channel."""
    try:
        import lzfse
    except ImportError as error:
        raise InputError(
            path, "depth of Record3D is compressed with LZFSE", "pip install 'synfeal[captures]'"
        ) from error
    place = f"{path}: {name}"
    with read_as(place, "depth compressed with LZFSE", ValueError, lzfse.error, MemoryError):
        content = lzfse.decompress(_member(path, name))
    width, height = size
    if len(content) != width * height * np.dtype(kind).itemsize:
        raise InputError(place, f"is not of {width}x{height} pixels as the metadata say")
    return np.frombuffer(content, kind).reshape(height, width)


FORMAT = CaptureFormat(
    name="record3d",
    title="Record3D",
    marks="a file .r3d, or metadata beside the folder rgbd",
    source="record3d.app, Specification of the .r3d file format",
    is_at=_is_at,
    read=_read,
)
