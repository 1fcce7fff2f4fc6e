"""``transforms.json`` of nerfstudio and instant-ngp: images and poses of OpenGL cameras."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from synfeal.camera.calibration import Calibration, transforms_camera
from synfeal.captures.capture import (
    GL_FROM_CAM,
    Capture,
    CapturedFrame,
    partial_read,
    resized,
    rigid_pose,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, photograph_size, read_photograph
from synfeal.dataset.images import image_size
from synfeal.errors import InputError, read_as, why
from synfeal.records.files import names_below, read_json

NAME = "transforms.json"
# Depth is in millimetres unless ``depth_unit_scale_factor`` says what else.
METRES_PER_UNIT = 1e-3


def _file_of(path: Path) -> Path:
    return path / NAME if path.is_dir() else path


def _is_at(path: Path) -> bool:
    return (path / NAME).is_file() if path.is_dir() else path.name == NAME


def _read(path: Path) -> Capture:
    file = _file_of(path)
    with read_as(file, "a file of transforms"):
        values = read_json(file)
    if not isinstance(values, dict) or not isinstance(values.get("frames"), list):
        raise InputError(file, "must hold a list 'frames'; is it of nerfstudio?")
    if not values["frames"]:
        raise InputError(file, "its list 'frames' is empty")
    with read_as(f"{file}: depth_unit_scale_factor", "a number", TypeError, ValueError):
        units_per_m = 1.0 / float(values.get("depth_unit_scale_factor", METRES_PER_UNIT))
    moved = _moved(file, values["frames"])
    frames, missing = [], []
    for index, entry in enumerate(values["frames"]):
        place = f"{file}: frames[{index}]"
        if not isinstance(entry, dict):
            raise InputError(place, "must hold a mapping of keys")
        photograph = _image_at(file, entry.get("file_path"), f"{place}.file_path", moved)
        if photograph is None:
            missing.append(str(entry["file_path"]))
            continue
        frames.append(_frame(file, photograph, values, entry, units_per_m, place, moved))
    if not frames:
        raise InputError(file, f"{missing[0]} and all other images are missing", "copy them, too")
    frames.sort(key=lambda frame: frame.name)
    notes = [f"{len(missing)} images are missing ({missing[0]}, ...)"] if missing else []
    if moved:
        notes.append(f"images are found without the first {_folders(moved)} of their paths")
    return Capture(path, FORMAT.name, tuple(frames), up=None, notes=(*notes, *_world(values)))


def _world(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Say where the world of the file is not that of the capture."""
    if values.get("applied_scale", 1.0) != 1.0:
        return (f"applied_scale is {values['applied_scale']}: lengths are not metres",)
    # colmap2nerf.py moves cameras to a mean distance of 4 from what they look at.
    if "aabb_scale" in values and "applied_scale" not in values:
        return ("aabb_scale is there, as instant-ngp writes it: lengths need not be metres",)
    return ()


def _moved(file: Path, entries: list[Any]) -> int:
    """Count the folders that the names of images begin with and that are not here.

    Whoever moves a file of transforms beside the images leaves them in the names, as instant-ngp
    wrote them: relative to where it ran.

    Returns:
        The least number without which an image of the first entry is here; 0 where there is none.
    """
    name = entries[0].get("file_path") if isinstance(entries[0], dict) else None
    if not isinstance(name, str) or not names_below(name):
        return 0
    parts = PurePosixPath(name).parts
    for count in range(len(parts)):
        if _present(file.parent.joinpath(*parts[count:])) is not None:
            return count
    return 0


def _folders(count: int) -> str:
    return "folder" if count == 1 else f"{count} folders"


def _image_at(file: Path, name: Any, place: str, moved: int) -> Path | None:
    """Return the image of a name, with the ending that older files leave out; None if missing.

    Args:
        file: File of transforms.
        name: The name.
        place: Where it is said.
        moved: Folders at the name's beginning that are not here.
    """
    if not isinstance(name, str) or not name:
        raise InputError(place, "must name an image")
    if not names_below(name):
        raise InputError(place, f"'{name}' leads out of the folder", "copy the image into it")
    return _present(file.parent.joinpath(*PurePosixPath(name).parts[moved:]))


def _present(named: Path) -> Path | None:
    """Return the file of this name, or with one of the endings that may be left out."""
    candidates = (named, *(named.with_name(named.name + end) for end in (".png", ".jpg")))
    return next((path for path in candidates if path.is_file()), None)


def _frame(
    file: Path,
    photograph: Path,
    values: Mapping[str, Any],
    entry: Mapping[str, Any],
    units_per_m: float,
    place: str,
    moved: int,
) -> CapturedFrame:
    camera = _camera({**values, **entry}, photograph, place)
    pose = rigid_pose(entry.get("transform_matrix"), f"{place}.transform_matrix") @ GL_FROM_CAM
    depth_file, depth_camera = None, None
    if entry.get("depth_file_path") is not None:
        depth_file = _image_at(file, entry["depth_file_path"], f"{place}.depth_file_path", moved)
        if depth_file is None:
            raise InputError(f"{place}.depth_file_path", f"{entry['depth_file_path']} is missing")
        depth_camera = resized(camera, *image_size(depth_file))
    return CapturedFrame(
        name=str(photograph.relative_to(file.parent)),
        read_color=partial_read(read_photograph, photograph, camera.width, camera.height),
        camera=camera,
        world_from_cam=pose,
        read_depth_m=depth_reader(depth_file, units_per_m),
        depth_camera=depth_camera,
        color_file=photograph,
    )


def _camera(values: Mapping[str, Any], photograph: Path, place: str) -> Calibration:
    """Read the camera of a frame: what it says itself goes before what the file says."""
    try:
        camera = transforms_camera(values, image_size(photograph))
    except ValueError as error:
        raise InputError(place, why(error)) from error
    # Images that were made smaller after they were calibrated (images_2, images_4).
    return resized(camera, *photograph_size(photograph, camera.width, camera.height))


FORMAT = CaptureFormat(
    name="transforms",
    title="nerfstudio or instant-ngp",
    marks=NAME,
    source="nerfstudio's documentation, Data conventions",
    is_at=_is_at,
    read=_read,
)
