"""Exports for reconstruction: COLMAP models, hloc, and the TUM RGB-D format.

COLMAP. Source: its documentation, "Output Format". World and camera axes, the order of the
quaternion and the place of the first pixel's centre are ours; poses are ``cam_from_world``.

hloc. Source: ``hloc/pipelines/7Scenes`` and ``hloc/utils/parsers.py`` of
cvg/Hierarchical-Localization. ``triangulation.main`` takes ``sfm_reference`` and ``images``;
``localize_sfm.main`` takes ``queries_with_intrinsics.txt`` (``name model width height params...``);
the evaluation takes ``model`` and ``list_test.txt``.

TUM: a directory for each sequence with lists of images and of poses. Source: "File Formats" of the
RGB-D SLAM data set: time stamps in seconds, depth in 1/5000 m with 0 for none, ``tx ty tz qx qy qz
qw`` of ``world_from_cam``. Each list has three lines of comment, which some readers skip by number.
The format has no place for a camera; the second line says it. It has none for splits either: the
files that list them are copied.
"""

from __future__ import annotations

import logging
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from synfeal.camera.fisheye import EQUIDISTANT
from synfeal.camera.projection import cell_directions
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.sevenscenes import SPLIT_FILES
from synfeal.exporting.frames import (
    RIGHT,
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
from synfeal.geometry.poses import inverse, quat_wxyz_of
from synfeal.records.files import write_json

log = logging.getLogger("synfeal")


def export_colmap(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``images/``, ``sparse/0/{cameras,images,points3D}.txt`` and lists of the splits."""
    model = out / "sparse" / "0"
    model.mkdir(parents=True)
    write_model(model, data.camera, data.frames)
    for frame in data.frames:
        place(frame.color, out / "images" / frame_name(frame))
    _write_mask(data.camera, out / MASK)
    if any(frame.is_right for frame in data.frames):
        write_json(out / "rig_config.json", _rigs(data))
    if data.has_splits:
        for split in ("train", "test"):
            write_lines(out / f"{split}.txt", [frame_name(frame) for frame in data.of_split(split)])


def _rigs(data: ExportSet) -> list[dict[str, Any]]:
    """Describe the stereo pairs as ``colmap rig_configurator`` reads them, a rig per sequence."""
    assert data.camera.stereo_baseline_m is not None
    sequences = dict.fromkeys(frame.sequence for frame in data.frames if not frame.is_right)
    right_from_left_m = [-data.camera.stereo_baseline_m, 0.0, 0.0]
    return [
        {
            "cameras": [
                {"image_prefix": f"{name}/", "ref_sensor": True},
                {
                    "image_prefix": f"{name}{RIGHT}/",
                    "cam_from_rig_rotation": [1.0, 0.0, 0.0, 0.0],
                    "cam_from_rig_translation": right_from_left_m,
                },
            ]
        }
        for name in sequences
    ]


MASK = "camera_mask.png"
LARGEST_ANGLE_DEG = 89.0


def _write_mask(camera: CameraConfig, path: Path) -> None:
    """Write a mask of the pixels that COLMAP's fisheye model holds for, if not for all.

    Its formulas are in x / z and y / z, so that it takes a pixel which looks sideways or backwards
    for one that looks ahead.
    """
    if camera.projection != "fisheye":
        return
    ray = cell_directions(camera, camera.width, camera.height)
    with np.errstate(invalid="ignore"):
        good = ray[..., 2] > np.cos(np.radians(LARGEST_ANGLE_DEG))
    if good.all():
        return
    Image.fromarray(np.where(good, 255, 0).astype(np.uint8)).save(path)
    log.warning(
        "%.0f %% of the pixels look farther from the axis than %g degrees, where COLMAP's fisheye"
        " models end; %s leaves them out (--ImageReader.camera_mask_path)",
        100.0 * float(np.mean(~good)),
        LARGEST_ANGLE_DEG,
        MASK,
    )


def write_model(folder: Path, camera: CameraConfig, frames: Iterable[ExportFrame]) -> None:
    """Write ``cameras.txt``, ``images.txt`` and an empty ``points3D.txt``."""
    write_lines(
        folder / "cameras.txt", ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS", camera_line(camera)]
    )
    lines = ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of points: none"]
    for number, frame in enumerate(frames, start=1):
        cam_from_world = inverse(frame.world_from_cam)
        values = [*quat_wxyz_of(cam_from_world).tolist(), *cam_from_world[:3, 3].tolist()]
        lines += [f"{number} {_numbers(values)} 1 {frame_name(frame)}", ""]
    write_lines(folder / "images.txt", lines)
    write_lines(folder / "points3D.txt", ["# POINT3D_ID X Y Z R G B ERROR TRACK: none"])


def camera_line(camera: CameraConfig) -> str:
    """Choose the simplest of COLMAP's camera models that holds the camera."""
    if camera.projection == "equirectangular":
        size = f"{camera.width} {camera.height}"
        return f"1 EQUIRECTANGULAR {size} {_numbers([camera.width, camera.height])}"
    if camera.projection == "fisheye":
        lens = [*camera.intrinsics, *(camera.fisheye_k or EQUIDISTANT)]
        return f"1 OPENCV_FISHEYE {camera.width} {camera.height} {_numbers(lens)}"
    *first, k3 = camera.distortion
    parameters: list[float] = list(camera.intrinsics)
    if not any(camera.distortion):
        model = "PINHOLE"
    elif not k3:
        model, parameters = "OPENCV", parameters + first
    else:
        model, parameters = "FULL_OPENCV", [*parameters, *first, k3, 0.0, 0.0, 0.0]
    return f"1 {model} {camera.width} {camera.height} {_numbers(parameters)}"


def _numbers(values: list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def export_hloc(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``images/``, ``model/``, ``sfm_reference/`` and the lists."""
    need_splits(data)
    if data.camera.projection == "equirectangular":
        need_perspective(data, "hloc")
    for frame in data.frames:
        place(frame.color, out / "images" / frame_name(frame))
    _write_binary(out / "model", data, data.frames)
    _write_binary(out / "sfm_reference", data, data.of_split("train"))
    camera = camera_line(data.camera).partition(" ")[2]  # without its number
    for split in ("train", "test"):
        names = [frame_name(frame) for frame in data.of_split(split)]
        write_lines(out / f"list_{split}.txt", names)
        if split == "test":
            write_lines(out / "queries_with_intrinsics.txt", [f"{name} {camera}" for name in names])


def _write_binary(folder: Path, data: ExportSet, frames: Iterable[ExportFrame]) -> None:
    """Write a model in the binary form that hloc reads by default."""
    import pycolmap

    folder.mkdir()
    write_model(folder, data.camera, frames)
    model = pycolmap.Reconstruction(folder)
    for path in folder.iterdir():
        path.unlink()
    model.write_binary(folder)


FRAMES_PER_S = 30.0
UNITS_PER_M = 5000

Lists = dict[str, list[str]]


def export_tum(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``seq-XX/{rgb.txt,depth.txt,groundtruth.txt,rgb/,depth/}``; warns of lost depths."""
    need_perspective(data, "TUM's format")
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
    warn_of_lost(lost, len(data.frames), UNITS_PER_M, "TUM's")


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
