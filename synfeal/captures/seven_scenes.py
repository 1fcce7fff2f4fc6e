"""One sequence of 7-Scenes or several: the layout that ``synfeal collect`` writes, too."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from synfeal.camera.calibration import Calibration, read_calibration
from synfeal.camera.sensors import SENSORS
from synfeal.captures.capture import Array, Capture, CapturedFrame, calibration, partial_read
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import decode_photograph, depth_reader
from synfeal.captures.unpack import RECORD, read_capture_record
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.errors import read_as

MANIFEST = "manifest.json"


def _is_at(path: Path) -> bool:
    if not path.is_dir() or (path / "info.txt").exists():
        return False
    if any((path / f"seq-{number:02d}{end}").exists() for number in (1, 2) for end in ("", ".zip")):
        return True
    with os.scandir(path) as entries:
        return any(
            entry.name.startswith("frame-") and entry.name.endswith(".pose.txt")
            for entry in entries
        )


class _Device(NamedTuple):
    """Cameras of a sequence, and what else is known of what took it."""

    color: Calibration
    depth: Calibration
    units_per_m: float = 1000.0
    depth_from_color: Array = np.eye(4)
    up: tuple[float, float, float] | None = None
    notes: tuple[str, ...] = ()


def _device(path: Path) -> _Device:
    for folder in (path, path.parent):
        unpacked = _of_unpacked(folder)
        if unpacked is not None:
            return unpacked
        if (folder / MANIFEST).is_file():
            camera = read_calibration(folder / MANIFEST, with_fisheye=True)
            return _Device(camera, camera)
    sensor = SENSORS["7scenes"]
    note = "no calibration is stored here: taken to be the Kinect of 7-Scenes (525 and 585 pixels)"
    return _Device(sensor.color, sensor.depth, sensor.depth_units_per_m, notes=(note,))


def _of_unpacked(folder: Path) -> _Device | None:
    """Read what ``synfeal unpack`` keeps of a capture; None for a sequence from elsewhere."""
    record = read_capture_record(folder)
    if record is None:
        return None
    with read_as(folder / RECORD, "the record of a capture", KeyError, TypeError, ValueError):
        camera, up = record["camera"], record.get("up")
        color = _pinhole(camera["color"], folder)
        return _Device(
            color,
            _pinhole(camera["depth"], folder) if "depth" in camera else color,
            float(camera.get("depth_units_per_m", 1000.0)),
            np.array(camera.get("depth_from_color", np.eye(4)), np.float64).reshape(4, 4),
            None if up is None else (float(up[0]), float(up[1]), float(up[2])),
        )


def _pinhole(values: Mapping[str, Any], folder: Path) -> Calibration:
    return calibration(
        values["width"],
        values["height"],
        [values[name] for name in ("fx", "fy", "cx", "cy")],
        folder / RECORD,
        distortion=tuple(values["distortion"]),
    )


def _read(path: Path) -> Capture:
    listed = read_posed_sequence(path)
    device = _device(path)
    frames = []
    for name, photograph, depth_file, pose in zip(
        listed.names, listed.color, listed.depth, listed.world_from_cam, strict=True
    ):
        frames.append(
            CapturedFrame(
                name=name,
                read_color=partial_read(_photograph, photograph),
                camera=device.color,
                world_from_cam=pose,
                read_depth_m=depth_reader(depth_file, device.units_per_m),
                depth_camera=device.depth if depth_file else None,
                color_file=photograph if isinstance(photograph, Path) else None,
            )
        )
    return Capture(
        path,
        FORMAT.name,
        tuple(frames),
        depth_from_color=device.depth_from_color,
        up=device.up,
        notes=device.notes,
    )


def _photograph(file: FrameFile) -> object:
    return decode_photograph(file.read_bytes(), file)


FORMAT = CaptureFormat(
    name="7scenes",
    title="7-Scenes, and data sets of synfeal collect",
    marks="frame-000000.pose.txt, or seq-01",
    source="Shotton et al., Scene Coordinate Regression Forests, CVPR 2013; its data set's page",
    is_at=_is_at,
    read=_read,
)
