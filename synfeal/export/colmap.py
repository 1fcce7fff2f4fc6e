"""COLMAP's text model beside the images, and what hloc localizes in.

Source: COLMAP documentation, "Output Format". World and camera axes, the order of the quaternion
and the place of the first pixel's centre are ours; poses are ``cam_from_world``.

Source of the latter: ``hloc/pipelines/7Scenes`` and ``hloc/utils/parsers.py`` of
cvg/Hierarchical-Localization. ``triangulation.main`` takes ``sfm_reference`` and ``images``;
``localize_sfm.main`` takes ``queries_with_intrinsics.txt`` (``name model width height params...``);
the evaluation takes ``model`` and ``list_test.txt``.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from synfeal.config.dataset import CameraConfig
from synfeal.export.frames import (
    ExportFrame,
    ExportSet,
    Place,
    frame_name,
    need_splits,
    write_lines,
)
from synfeal.geometry.poses import inverse, quat_wxyz_of


def export_colmap(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``images/``, ``sparse/0/{cameras,images,points3D}.txt`` and lists of the splits."""
    model = out / "sparse" / "0"
    model.mkdir(parents=True)
    write_model(model, data.camera, data.frames)
    for frame in data.frames:
        place(frame.color, out / "images" / frame_name(frame))
    if data.has_splits:
        for split in ("train", "test"):
            write_lines(out / f"{split}.txt", [frame_name(frame) for frame in data.of_split(split)])


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
    """The simplest of COLMAP's models that holds the camera."""
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
    """A model in the form that hloc reads by default."""
    import pycolmap

    folder.mkdir()
    write_model(folder, data.camera, frames)
    model = pycolmap.Reconstruction(folder)
    for path in folder.iterdir():
        path.unlink()
    model.write_binary(folder)
