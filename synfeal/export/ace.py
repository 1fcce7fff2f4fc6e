"""ACE's scenes: ``{train,test}/{rgb,poses,calibration}``, one file of each for a frame.

Source: ``dataset.py`` and ``datasets/setup_7scenes.py`` of nianticlabs/ace: files of a folder go
together by their order; poses are 4x4 ``world_from_cam``; a calibration is a camera matrix (3x3)
with the centre of the image at half its size, as here. ``depth``, in millimetres with 0 for none,
is read by modes that ACE itself does not use. It knows one focal length and no distortion.
"""

from __future__ import annotations

from pathlib import Path

from synfeal.dataset.sevenscenes import pose_text
from synfeal.errors import InputError
from synfeal.export.frames import (
    ExportFrame,
    ExportSet,
    Place,
    need_splits,
    rewrite_depth,
    write_lines,
)

UNITS_PER_M = 1000


def export_ace(data: ExportSet, out: Path, place: Place) -> None:
    """Write the splits.

    Raises:
        InputError: there are no splits, or the camera is more than ACE knows.
    """
    need_splits(data)
    camera = data.camera.intrinsics
    if any(data.camera.distortion) or abs(camera.fx - camera.fy) > 1e-5 * camera.fx:
        raise InputError(
            f"{data.path}: ACE knows one focal length and no distortion; undistort the images first"
        )
    matrix = [" ".join(map(repr, row)) for row in camera.matrix().tolist()]
    for frame in data.frames:
        folder = out / str(frame.split)
        place(frame.color, folder / "rgb" / f"{_stem(frame)}.color.png")
        pose = pose_text(frame.world_from_cam).splitlines()
        write_lines(folder / "poses" / f"{_stem(frame)}.pose.txt", pose)
        write_lines(folder / "calibration" / f"{_stem(frame)}.calibration.txt", matrix)
        if data.has_depth:
            rewrite_depth(frame.depth, folder / "depth" / f"{_stem(frame)}.depth.png", UNITS_PER_M)


def _stem(frame: ExportFrame) -> str:
    return f"{frame.sequence}-{frame.color.name.removesuffix('.color.png')}"
