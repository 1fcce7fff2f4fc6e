"""One sequence of 7-Scenes or several: the layout that ``synfeal collect`` writes, too."""

from __future__ import annotations

import os
from pathlib import Path

from synfeal.camera.calibration import Calibration, read_calibration
from synfeal.camera.sensors import SENSORS
from synfeal.captures.capture import Capture, CapturedFrame, partial_read
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import decode_photograph, depth_reader
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.posed_sequence import read_posed_sequence

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


def _cameras(path: Path) -> tuple[Calibration, Calibration, float, tuple[str, ...]]:
    """Return the cameras of colour and depth, units a metre, and what to say of them."""
    for folder in (path, path.parent):
        if (folder / MANIFEST).is_file():
            camera = read_calibration(folder / MANIFEST, with_fisheye=True)
            return camera, camera, 1000.0, ()
    sensor = SENSORS["7scenes"]
    note = "no calibration is stored here: taken to be the Kinect of 7-Scenes (525 and 585 pixels)"
    return sensor.color, sensor.depth, sensor.depth_units_per_m, (note,)


def _read(path: Path) -> Capture:
    listed = read_posed_sequence(path)
    color, depth, units_per_m, notes = _cameras(path)
    frames = []
    for name, photograph, depth_file, pose in zip(
        listed.names, listed.color, listed.depth, listed.world_from_cam, strict=True
    ):
        frames.append(
            CapturedFrame(
                name=name,
                read_color=partial_read(_photograph, photograph),
                camera=color,
                world_from_cam=pose,
                read_depth_m=depth_reader(depth_file, units_per_m),
                depth_camera=depth if depth_file else None,
                color_file=photograph if isinstance(photograph, Path) else None,
            )
        )
    return Capture(path, FORMAT.name, tuple(frames), notes=notes)


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
