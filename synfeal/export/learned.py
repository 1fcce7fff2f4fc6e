"""What learned localizers read: ACE's scenes, and the tables of MS-Transformer.

ACE: ``{train,test}/{rgb,poses,calibration}``, one file of each for a frame. Source: ``dataset.py``
and ``datasets/setup_7scenes.py`` of nianticlabs/ace: files of a folder go together by their order;
poses are 4x4 ``world_from_cam``; a calibration is a camera matrix (3x3) with the centre of the
image at half its size, as here. ``depth``, in millimetres with 0 for none, is read by modes that
ACE itself does not use. It knows one focal length and no distortion.

MS-Transformer, and pose regressors that read the same format. Source:
``datasets/CameraPoseDataset.py`` of yolish/multi-scene-pose-transformer and the tables beside it:
columns ``scene,split,seq,img_path,t1,t2,t3,q1,q2,q3,q4``, poses ``world_from_cam`` with quaternions
``wxyz``, image paths below the data set's directory. There is no camera in it.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from synfeal.dataset.sevenscenes import pose_text
from synfeal.errors import InputError
from synfeal.export.frames import (
    ExportFrame,
    ExportSet,
    Place,
    frame_name,
    need_splits,
    rewrite_depth,
    write_lines,
)
from synfeal.geometry.poses import quat_wxyz_of

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


COLUMNS = ("scene", "split", "seq", "img_path", "t1", "t2", "t3", "q1", "q2", "q3", "q4")


def export_mstransformer(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``images/``, ``train.csv`` and ``test.csv``."""
    need_splits(data)
    for split in ("train", "test"):
        rows = []
        for frame in data.of_split(split):
            path = f"images/{frame_name(frame)}"
            place(frame.color, out / path)
            pose = (*frame.world_from_cam[:3, 3], *quat_wxyz_of(frame.world_from_cam))
            rows.append((data.path.resolve().name, split, frame.sequence, path, *pose))
            table = pd.DataFrame(rows, columns=list(COLUMNS))
        table.to_csv(out / f"{split}.csv", index=False, lineterminator="\n")
