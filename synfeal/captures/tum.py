"""Sequences of the TUM RGB-D benchmark: lists of files and poses by time."""

from __future__ import annotations

import re
from pathlib import Path

from synfeal.camera.sensors import SENSORS
from synfeal.captures.capture import Capture, CapturedFrame, partial_read
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, read_photograph
from synfeal.dataset.images import image_size
from synfeal.dataset.posed_sequence import is_tum, read_posed_sequence
from synfeal.errors import InputError

FREIBURG = re.compile(r"(?:freiburg|fr)([123])(?![0-9])")


def _sensor_of(path: Path) -> tuple[str, str]:
    """Return which sensor took a sequence, by its folder's name, and what to say of it."""
    match = FREIBURG.search(path.resolve().name.lower())
    if match:
        return f"tum-fr{match[1]}", f"taken to be the Kinect of freiburg{match[1]}, by its name"
    return (
        "kinect",
        "no calibration is stored here: taken to be an uncalibrated Kinect (525 pixels)",
    )


def _read(path: Path) -> Capture:
    listed = read_posed_sequence(path)
    name, note = _sensor_of(path)
    sensor = SENSORS[name]
    first = listed.color[0]
    assert isinstance(first, Path)
    if (size := image_size(first)) != (sensor.color.width, sensor.color.height):
        raise InputError(
            first,
            f"is of {size[0]}x{size[1]} pixels and nothing in the sequence says what its camera is",
            "scan it with `color_camera=FILE`",
        )
    frames = []
    for stamp, photograph, depth_file, pose in zip(
        listed.names, listed.color, listed.depth, listed.world_from_cam, strict=True
    ):
        assert isinstance(photograph, Path)
        frames.append(
            CapturedFrame(
                name=stamp,
                read_color=partial_read(read_photograph, photograph, *size),
                camera=sensor.color,
                world_from_cam=pose,
                read_depth_m=depth_reader(depth_file, sensor.depth_units_per_m),
                depth_camera=sensor.depth if depth_file else None,
                time_s=_seconds(stamp),
                color_file=photograph,
            )
        )
    return Capture(path, FORMAT.name, tuple(frames), notes=(note,))


def _seconds(stamp: str) -> float | None:
    try:
        return float(stamp)
    except ValueError:
        return None


FORMAT = CaptureFormat(
    name="tum",
    title="TUM RGB-D benchmark",
    marks="rgb.txt with groundtruth.txt",
    source="File Formats, on the page of the RGB-D SLAM data set and benchmark of TUM",
    is_at=lambda path: path.is_dir() and is_tum(path),
    read=_read,
)
