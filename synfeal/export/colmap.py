"""COLMAP's text model: cameras, images, no points, and the images beside it.

Source: COLMAP documentation, "Output Format". World and camera axes, the order of the quaternion
and the place of the first pixel's centre are ours; poses are ``cam_from_world``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.collection import CameraConfig
from synfeal.export.frames import ExportFrame, ExportSet, place
from synfeal.geometry.poses import inverse, quat_wxyz_of


def export_colmap(
    data: ExportSet, out: Path, copy: bool, on_frame: Callable[[], object]
) -> list[str]:
    """Write ``images/``, ``sparse/0/{cameras,images,points3D}.txt`` and lists of the splits."""
    model = out / "sparse" / "0"
    model.mkdir(parents=True)
    write_model(model, data.camera, data.frames)
    for frame in data.frames:
        place(frame.color, out / "images" / frame_name(frame), copy)
        on_frame()
    if data.has_splits:
        for split in ("train", "test"):
            _write(out / f"{split}.txt", [frame_name(frame) for frame in data.of_split(split)])
    return []


def write_model(folder: Path, camera: CameraConfig, frames: Iterable[ExportFrame]) -> None:
    """Write ``cameras.txt``, ``images.txt`` and an empty ``points3D.txt``."""
    _write(folder / "cameras.txt", ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS", camera_line(camera)])
    lines = ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of points: none"]
    for number, frame in enumerate(frames, start=1):
        lines += [_image(number, frame), ""]
    _write(folder / "images.txt", lines)
    _write(folder / "points3D.txt", ["# POINT3D_ID X Y Z R G B ERROR TRACK: none"])


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


def frame_name(frame: ExportFrame) -> str:
    """What an image is called below ``images``."""
    return f"{frame.sequence}/{frame.color.name}"


def camera_line(camera: CameraConfig) -> str:
    """The simplest of COLMAP's models that holds the camera."""
    *first, k3 = camera.distortion
    parameters: list[float] = list(intrinsics_of(camera))
    if not any(camera.distortion):
        model = "PINHOLE"
    elif not k3:
        model, parameters = "OPENCV", parameters + first
    else:
        model, parameters = "FULL_OPENCV", [*parameters, *first, k3, 0.0, 0.0, 0.0]
    return f"1 {model} {camera.width} {camera.height} {_numbers(parameters)}"


def _image(number: int, frame: ExportFrame) -> str:
    cam_from_world = inverse(frame.world_from_cam)
    values = [*quat_wxyz_of(cam_from_world).tolist(), *cam_from_world[:3, 3].tolist()]
    return f"{number} {_numbers(values)} 1 {frame_name(frame)}"


def _numbers(values: list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
