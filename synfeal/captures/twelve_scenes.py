"""Scenes of 12-Scenes: frames in ``data``, beside the calibrations of their Structure Sensor."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from synfeal.camera.calibration import Calibration
from synfeal.captures.capture import Capture, CapturedFrame, calibration, numbers, partial_read
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, read_photograph
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.errors import InputError, read_as
from synfeal.records.files import read_text

INFO = "info.txt"
ENTRY = re.compile(r"^\s*(m_\w+)\s*=\s*(.*?)\s*$", re.MULTILINE)


def _is_at(path: Path) -> bool:
    return _info_of(path).is_file() and _frames_of(path).is_dir()


def _info_of(path: Path) -> Path:
    return path / INFO if (path / INFO).exists() else path.parent / INFO


def _frames_of(path: Path) -> Path:
    return path / "data" if (path / "data").is_dir() else path


def _read(path: Path) -> Capture:
    info = _info_of(path)
    with read_as(info, "the calibrations of a scene"):
        entries = dict(ENTRY.findall(read_text(info)))
    color, depth = _camera(info, entries, "Color"), _camera(info, entries, "Depth")
    units_per_m = numbers(_entry(info, entries, "m_depthShift"), 1, f"{info}: m_depthShift")[0]
    moved = numbers(_entry(info, entries, "m_calibrationColorExtrinsic"), 16, info).reshape(4, 4)
    notes = () if np.allclose(moved, np.eye(4)) else ("m_calibrationColorExtrinsic is not used",)
    listed = read_posed_sequence(_frames_of(path))
    frames = []
    for name, photograph, depth_file, pose in zip(
        listed.names, listed.color, listed.depth, listed.world_from_cam, strict=True
    ):
        assert isinstance(photograph, Path)
        frames.append(
            CapturedFrame(
                name=name,
                read_color=partial_read(read_photograph, photograph, color.width, color.height),
                camera=color,
                world_from_cam=pose,
                read_depth_m=depth_reader(depth_file, units_per_m),
                depth_camera=depth if depth_file else None,
                color_file=photograph,
            )
        )
    return Capture(path, FORMAT.name, tuple(frames), notes=notes)


def _entry(info: Path, entries: dict[str, str], name: str) -> str:
    if name not in entries:
        raise InputError(info, f"{name} is missing", "copy the scene again")
    return entries[name]


def _camera(info: Path, entries: dict[str, str], kind: str) -> Calibration:
    """Read the camera of a kind, ``Color`` or ``Depth``."""
    sides = [_entry(info, entries, f"m_{kind.lower()}{side}") for side in ("Width", "Height")]
    key = f"m_calibration{kind}Intrinsic"
    matrix = numbers(_entry(info, entries, key), 16, f"{info}: {key}").reshape(4, 4)
    width, height = (int(numbers(side, 1, f"{info}: size of {kind}")[0]) for side in sides)
    pinhole = (matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2])
    return calibration(width, height, pinhole, f"{info}: {key}", centre_of_first_pixel=0.0)


FORMAT = CaptureFormat(
    name="12scenes",
    title="12-Scenes",
    marks="info.txt beside the folder data of frame-000000.pose.txt",
    source="Valentin et al., Learning to Navigate the Energy Landscape, 3DV 2016; its read-me",
    is_at=_is_at,
    read=_read,
)
