"""Exports for learned methods: ACE, MS-Transformer, Nerfstudio.

ACE: ``{train,test}/{rgb,poses,calibration}``, one file of each for a frame. Source: ``dataset.py``
and ``datasets/setup_7scenes.py`` of nianticlabs/ace: files of a folder go together by their order;
poses are 4x4 ``world_from_cam``; a calibration is a camera matrix (3x3) with the centre of the
image at half its size, as here. ``depth``, in millimetres with 0 for none, is read by modes that
ACE itself does not use. It knows one focal length and no distortion.

MS-Transformer, and pose regressors that read the same format. Source:
``datasets/CameraPoseDataset.py`` of yolish/multi-scene-pose-transformer and the tables beside it:
columns ``scene,split,seq,img_path,t1,t2,t3,q1,q2,q3,q4``, poses ``world_from_cam`` with quaternions
``wxyz``, image paths below the data set's directory. There is no camera in it.

Nerfstudio. Source: its documentation, "Data conventions", and its data
parser: cameras are x right, y up, z backward; the world has z up; the centre of the first pixel is
at (0.5, 0.5); depth is in millimetres along the optical axis, 0 where there is none; the three
lists of file names go together and evaluation during training reads ``val_filenames``. Rays of
``OPENCV_FISHEYE`` and ``EQUIRECTANGULAR`` are of unit length there, so that depth is along the ray;
the focal length of a panorama is its height.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from synfeal.camera.fisheye import EQUIDISTANT
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.sequence_listing import DEPTH
from synfeal.dataset.sevenscenes import pose_text
from synfeal.errors import InputError
from synfeal.exporting.frames import (
    ExportFrame,
    ExportSet,
    Place,
    frame_name,
    need_perspective,
    need_splits,
    rewrite_depth,
    warn_of_lost,
    write_lines,
)
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.records.files import write_json
from synfeal.records.tables import write_frame


def export_ace(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``{train,test}/{rgb,poses,calibration}`` and, if there is depth, ``depth``.

    Raises:
        InputError: The camera has distortion or two focal lengths, which ACE does not know.
    """
    need_splits(data)
    need_perspective(data, "ACE")
    camera = data.camera.intrinsics
    if any(data.camera.distortion) or abs(camera.fx - camera.fy) > 1e-5 * camera.fx:
        raise InputError(
            data.path, "ACE knows one focal length and no distortion", "undistort the images first"
        )
    matrix, lost = [" ".join(map(repr, row)) for row in camera.matrix().tolist()], 0.0
    for frame in data.frames:
        folder = out / str(frame.split)
        place(frame.color, folder / "rgb" / f"{_stem(frame)}.color.png")
        pose = pose_text(frame.world_from_cam).splitlines()
        write_lines(folder / "poses" / f"{_stem(frame)}.pose.txt", pose)
        write_lines(folder / "calibration" / f"{_stem(frame)}.calibration.txt", matrix)
        if data.has_depth:
            lost += rewrite_depth(frame.depth, folder / "depth" / f"{_stem(frame)}.depth.png")
    warn_of_lost(lost, len(data.frames), MILLIMETRES, "ACE's")


def _stem(frame: ExportFrame) -> str:
    return f"{frame.sequence}-{frame.stem}"


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
        write_frame(out / f"{split}.csv", table, float_format=None)


# OpenGL cameras are x right, y up, z backward; ours are x right, y down, z forward.
CAM_FROM_GL = np.diag([1.0, -1.0, -1.0, 1.0])


def export_nerfstudio(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``transforms.json``, ``images/`` and, if there is depth, ``depth/``."""
    frames, units_per_m = [], data.camera.depth_units_per_m or MILLIMETRES
    for frame in data.frames:
        world_from_gl = frame.world_from_cam @ CAM_FROM_GL
        entry = {"file_path": _image(frame), "transform_matrix": world_from_gl.tolist()}
        place(frame.color, out / _image(frame))
        if data.has_depth:
            entry["depth_file_path"] = f"depth/{frame.sequence}/{frame.stem}.{DEPTH}"
            rewrite_depth(frame.depth, out / entry["depth_file_path"], units_per_m)
        frames.append(entry)
    splits = {}
    if data.has_splits:
        train, test = ([_image(frame) for frame in data.of_split(s)] for s in ("train", "test"))
        splits = {"train_filenames": train, "val_filenames": test, "test_filenames": test}
    units = {"depth_unit_scale_factor": 1 / units_per_m} if units_per_m != MILLIMETRES else {}
    written = {**_camera(data.camera), **units, **splits, "frames": frames}
    write_json(out / "transforms.json", written)


def _image(frame: ExportFrame) -> str:
    return f"images/{frame_name(frame)}"


def _camera(camera: CameraConfig) -> dict[str, Any]:
    size = {"w": camera.width, "h": camera.height}
    if camera.projection == "equirectangular":
        focal = {"fl_x": camera.height, "fl_y": camera.height}
        middle = {"cx": camera.width / 2.0, "cy": camera.height / 2.0}
        return {"camera_model": "EQUIRECTANGULAR", **size, **focal, **middle}
    pinhole = dict(zip(("fl_x", "fl_y", "cx", "cy"), camera.intrinsics, strict=True))
    if camera.projection == "fisheye":
        radial = camera.fisheye_k or EQUIDISTANT
        lens = dict(zip(("k1", "k2", "k3", "k4"), radial, strict=True))
        return {"camera_model": "OPENCV_FISHEYE", **size, **pinhole, **lens}
    distortion = dict(zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion, strict=True))
    return {"camera_model": "OPENCV", **size, **pinhole, **distortion}
