"""COLMAP models, text or binary, with their photographs and, if there are any, depth maps."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from synfeal.camera.calibration import Calibration
from synfeal.captures.capture import (
    Capture,
    CapturedFrame,
    calibration,
    partial_read,
    resized,
    rigid_pose,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, photograph_size, read_photograph
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.images import image_size
from synfeal.dataset.pose_models import image_lines
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import inverse
from synfeal.records.files import names_below

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


def _read(path: Path) -> Capture:
    folder = _model_of(path)
    if folder is None:
        raise InputError(path, "holds no cameras and images, .bin or .txt, of a COLMAP model")
    with read_as(folder, "a model of COLMAP", OSError, ValueError, RuntimeError):
        model = _reconstruction(folder)
    registered = [model.images[i] for i in model.reg_image_ids()]
    if not registered:
        raise InputError(folder, "none of its images has a pose")
    names = _names(folder, registered)
    root = _photographs_of(path, folder, list(names.values()))
    cameras = {
        number: _camera(camera, f"{folder}: camera {number}")
        for number, camera in model.cameras.items()
    }
    frames, missing = [], []
    for image in sorted(registered, key=lambda image: names[image.image_id]):
        name = names[image.image_id]
        photograph = root / name
        if not names_below(name):
            raise InputError(folder, f"image '{name}' leads out of {root}")
        if not photograph.is_file():
            missing.append(name)
            continue
        frames.append(_frame(path, name, image, photograph, cameras[image.camera_id]))
    notes = (f"{len(missing)} images are missing ({missing[0]}, ...)",) if missing else ()
    return Capture(path, FORMAT.name, tuple(frames), notes=notes)


def _reconstruction(folder: Path) -> Any:
    """Read cameras, images and poses of a model with COLMAP's own reader.

    Of text it is given what it needs, line by line: it skips every other image where the second
    lines are left out, and wants a file of points that nothing here reads.
    """
    import pycolmap

    if (folder / "images.bin").is_file():
        points = folder / "points3D.bin"
        if not points.is_file():
            raise InputError(
                points,
                "missing",
                "copy it, too, or convert the model to text, which does without: colmap"
                " model_converter --output_type TXT",
            )
        return pycolmap.Reconstruction(folder)
    with tempfile.TemporaryDirectory() as name:
        copy = Path(name)
        shutil.copyfile(folder / "cameras.txt", copy / "cameras.txt")
        lines = [f"{line}\n\n" for line, _ in image_lines(folder / "images.txt")]
        (copy / "images.txt").write_text("".join(lines), encoding="utf-8")
        (copy / "points3D.txt").touch()
        return pycolmap.Reconstruction(copy)


def _names(folder: Path, images: list[Any]) -> dict[int, str]:
    """Return the names of images by their numbers.

    COLMAP's reader of text ends a name at its first blank; the rest of the line is the name.
    """
    names = {int(image.image_id): str(image.name) for image in images}
    if (folder / "images.bin").is_file():
        return names
    for line, pose in image_lines(folder / "images.txt"):
        number = int(line.split(None, 1)[0])
        if number in names:
            names[number] = pose.name
    return names


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


def _camera(camera: Any, place: str) -> Calibration:
    """Translate a camera; those of more coefficients than ours, and fisheyes of fewer, by name."""
    model = camera.model.name
    names = [name.strip() for name in camera.params_info.split(",")]
    values: dict[str, float] = dict(zip(names, camera.params.tolist(), strict=True))
    focal = values.get("f", 0.0)
    pinhole = [values.get("fx", focal), values.get("fy", focal), values["cx"], values["cy"]]
    radial = values.get("k", values.get("k1", 0.0))
    if "FISHEYE" in model and "THIN" not in model:
        k = (radial, *(values.get(name, 0.0) for name in ("k2", "k3", "k4")))
        return calibration(
            camera.width, camera.height, pinhole, place, projection="fisheye", fisheye_k=k
        )
    lens = (radial, *(values.get(name, 0.0) for name in ("k2", "p1", "p2", "k3")))
    if any(values.get(name) for name in ("k4", "k5", "k6", "omega", "sx1", "sy1")):
        raise InputError(place, f"a lens of {model} is not read", "undistort the images first")
    return calibration(camera.width, camera.height, pinhole, place, distortion=lens)


def _frame(
    path: Path, name: str, image: Any, photograph: Path, camera: Calibration
) -> CapturedFrame:
    size = photograph_size(photograph, camera.width, camera.height)
    if size != (camera.width, camera.height):
        camera = resized(camera, *size)
    depth = _depth_of(path, name)
    pose = rigid_pose(image.cam_from_world().matrix(), f"image '{name}'")
    return CapturedFrame(
        name=name,
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
    is_at=lambda path: path.is_dir() and _model_of(path) is not None,
    read=_read,
)
