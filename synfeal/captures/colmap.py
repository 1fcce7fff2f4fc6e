"""COLMAP models, text or binary, with their photographs and, if there are any, depth maps."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from synfeal.camera.calibration import Calibration, colmap_camera
from synfeal.captures.capture import (
    Capture,
    CapturedFrame,
    partial_read,
    quat_pose,
    resized,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, photograph_size, read_photograph
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.images import image_size
from synfeal.dataset.pose_models import NamedPose, colmap_images
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import inverse
from synfeal.records.files import names_below, read_text

MODELS = ("", "sparse/0", "sparse", "colmap/sparse/0", "model")
IMAGES = ("images", "rgb", "", "../images", "../../images")
DEPTHS = ("depth", "depths", "stereo/depth_maps")


def _model_of(path: Path) -> Path | None:
    """Return the folder of the model in or below a path; None where there is none."""
    for name in MODELS:
        for end in (".bin", ".txt"):
            if all((path / name / f"{kind}{end}").is_file() for kind in ("cameras", "images")):
                return path / name
    return None


def _lacking(path: Path) -> Path | None:
    """Return the file of cameras that a model lacks which has its images; None without such."""
    for name in MODELS:
        folder = path / name
        if (folder / "images.bin").is_file():
            return folder / "cameras.bin"
        if (folder / "images.txt").is_file():
            try:
                colmap_images(folder / "images.txt")
            except InputError:
                continue  # it is something else that has this name
            return folder / "cameras.txt"
    return None


def _read(path: Path) -> Capture:
    folder = _model_of(path)
    if folder is None and (lacking := _lacking(path)) is not None:
        raise InputError(lacking, "missing, and the images of a COLMAP model are there", "copy it")
    if folder is None:
        raise InputError(path, "holds no cameras and images, .bin or .txt, of a COLMAP model")
    is_binary = all((folder / f"{kind}.bin").is_file() for kind in ("cameras", "images"))
    end = ".bin" if is_binary else ".txt"
    images = colmap_images(folder / f"images{end}")
    root = _photographs_of(path, folder, [image.name for image in images])
    cameras = _cameras_of(folder / f"cameras{end}", {image.camera for image in images})
    frames, missing = [], []
    for image in images:
        photograph = root / image.name
        if not names_below(image.name):
            raise InputError(folder, f"image '{image.name}' leads out of {root}")
        if not photograph.is_file():
            missing.append(image.name)
            continue
        frames.append(_frame(path, image, photograph, cameras[image.camera]))
    notes = (f"{len(missing)} images are missing ({missing[0]}, ...)",) if missing else ()
    return Capture(path, FORMAT.name, tuple(frames), notes=notes)


def _cameras_of(file: Path, used: set[int]) -> dict[int, Calibration]:
    """Read the cameras that images use.

    Raises:
        InputError: One is missing, or has a lens that is not read.
    """
    with read_as(file, "a model of COLMAP", OSError, struct.error, ValueError):
        rows = _binary_rows(file) if file.suffix == ".bin" else _text_rows(file)
    cameras = {}
    for number in sorted(used):
        if number not in rows:
            raise InputError(
                file, f"camera {number} is missing, and images name it", "copy it again"
            )
        try:
            cameras[number] = colmap_camera(rows[number])
        except ValueError as error:
            raise InputError(f"{file}: camera {number}", str(error)) from error
    return cameras


def _text_rows(file: Path) -> dict[int, list[str]]:
    """Read the lines of ``cameras.txt`` by the numbers of the cameras."""
    lines = [line.split() for line in read_text(file, "utf-8-sig").splitlines()]
    return {int(cells[0]): cells for cells in lines if cells and not cells[0].startswith("#")}


def _binary_rows(file: Path) -> dict[int, list[str]]:
    """Read ``cameras.bin`` as the lines that COLMAP would write as text."""
    import pycolmap

    content = file.read_bytes()
    (count,) = struct.unpack_from("<Q", content)
    models = {int(model.value): name for name, model in pycolmap.CameraModelId.__members__.items()}
    rows, at = {}, struct.calcsize("<Q")
    for _ in range(count):
        number, model, width, height = struct.unpack_from("<IiQQ", content, at)
        at += struct.calcsize("<IiQQ")
        name = models.get(model, "INVALID")
        if name == "INVALID":
            raise ValueError(f"camera {number} is of the unknown model {model}")
        camera = pycolmap.Camera.create_from_model_name(number, name, 1.0, 1, 1)
        layout = f"<{len(camera.params)}d"
        values = struct.unpack_from(layout, content, at)
        at += struct.calcsize(layout)
        rows[number] = [str(number), name, str(width), str(height), *map(repr, values)]
    return rows


def _photographs_of(path: Path, folder: Path, names: list[str]) -> Path:
    """Find the folder that the names of the images start in."""
    for base in (path, folder):
        for sub in IMAGES:
            if any((base / sub / name).is_file() for name in names[:20]):
                return base / sub
    raise InputError(
        folder,
        f"its images ({names[0]}, ...) are neither in {path / 'images'} nor in {path}",
        "copy them to the first",
    )


def _frame(path: Path, image: NamedPose, photograph: Path, camera: Calibration) -> CapturedFrame:
    size = photograph_size(photograph, camera.width, camera.height)
    if size != (camera.width, camera.height):
        camera = resized(camera, *size)
    depth = _depth_of(path, image.name)
    x, y, z, w = (image.quat_wxyz[index] for index in (1, 2, 3, 0))
    pose = quat_pose(image.translation, (x, y, z, w), f"{path}: image '{image.name}'")
    return CapturedFrame(
        name=image.name,
        read_color=partial_read(read_photograph, photograph, *size),
        camera=camera,
        world_from_cam=np.asarray(inverse(pose)),
        read_depth_m=depth_reader(depth, MILLIMETRES),
        depth_camera=resized(camera, *image_size(depth)) if depth else None,
        color_file=photograph,
    )


def _depth_of(path: Path, name: str) -> Path | None:
    """Return the depth image of a photograph, of the same name but for its ending."""
    for folder in DEPTHS:
        file = (path / folder / name).with_suffix(".png")
        if file.is_file():
            return file
    return None


FORMAT = CaptureFormat(
    name="colmap",
    title="COLMAP",
    marks="cameras.bin or cameras.txt in it, in sparse/0 or in model",
    source="COLMAP's documentation, Output format",
    is_at=lambda path: path.is_dir() and (_model_of(path) or _lacking(path)) is not None,
    read=_read,
)
