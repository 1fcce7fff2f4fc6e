"""The TUM RGB-D format: a directory for each sequence with lists of images and of poses.

Source: TUM, "File Formats" of the RGB-D SLAM data set: time stamps in seconds, depth in 1/5000 m
with 0 for none, ``tx ty tz qx qy qz qw`` of ``world_from_cam``. Each list has three lines of
comment, which some readers skip by number. The format has no place for a camera; the second line
says it. It has none for splits either: the files that list them are copied.
"""

from __future__ import annotations

import logging
import shutil
from pathlib import Path

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.export.frames import ExportSet, Place, rewrite_depth, write_lines
from synfeal.geometry.poses import quat_wxyz_of

FRAMES_PER_S = 30.0
UNITS_PER_M = 5000
MOST_M = 65535 / UNITS_PER_M

log = logging.getLogger("synfeal")
Lists = dict[str, list[str]]


def export_tum(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``seq-XX/{rgb.txt,depth.txt,groundtruth.txt,rgb/,depth/}``; warns of lost depths."""
    lists: dict[str, Lists] = {}
    lost = 0.0
    for frame in data.frames:
        sequence = lists.setdefault(frame.sequence, {"rgb": [], "depth": [], "groundtruth": []})
        directory = out / frame.sequence
        time = f"{frame.frame.number / FRAMES_PER_S:.6f}"
        w, x, y, z = quat_wxyz_of(frame.world_from_cam).tolist()
        values = (*frame.world_from_cam[:3, 3].tolist(), x, y, z, w)
        sequence["groundtruth"].append(" ".join([time, *(f"{v:.12g}" for v in values)]))
        sequence["rgb"].append(f"{time} rgb/{time}.png")
        place(frame.color, directory / "rgb" / f"{time}.png")
        if data.has_depth:
            sequence["depth"].append(f"{time} depth/{time}.png")
            lost += rewrite_depth(frame.depth, directory / "depth" / f"{time}.png", UNITS_PER_M)
    for name, sequence in lists.items():
        _write_lists(out / name, sequence, data.camera)
    if data.has_splits:
        for name in SPLIT_FILES.values():
            shutil.copyfile(data.path / name, out / name)
    if lost:
        log.warning(
            "%.2f%% of the depths are beyond %.1f m, more than TUM's images hold: now 0",
            *(100 * lost / len(data.frames), MOST_M),
        )


def _write_lists(directory: Path, lists: Lists, camera: CameraConfig) -> None:
    columns = {
        "rgb": "timestamp filename",
        "depth": "timestamp filename, 5000 to the metre, 0 for none",
        "groundtruth": "timestamp tx ty tz qx qy qz qw",
    }
    for kind, lines in lists.items():
        if lines:
            header = [f"# {kind}", f"# {_camera(camera)}", f"# {columns[kind]}"]
            write_lines(directory / f"{kind}.txt", [*header, *lines])


def _camera(camera: CameraConfig) -> str:
    fx, fy, cx, cy = camera.intrinsics
    values = f"fx {fx!r} fy {fy!r} cx {cx - 0.5!r} cy {cy - 0.5!r}"
    coefficients = " ".join(map(repr, camera.distortion))
    return f"OpenCV camera, first pixel's centre at (0, 0): {values}; k1 k2 p1 p2 k3 {coefficients}"
