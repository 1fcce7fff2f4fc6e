"""Scenes of ScanNet as its reader extracts them: ``color``, ``depth``, ``pose``, ``intrinsic``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from synfeal.captures.capture import (
    Array,
    Capture,
    CapturedFrame,
    calibration,
    numbers,
    partial_read,
    rigid_pose,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import read_depth_png, read_photograph
from synfeal.dataset.depth import MILLIMETRES
from synfeal.dataset.images import image_size
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import inverse
from synfeal.records.files import read_text


def _is_at(path: Path) -> bool:
    return all((path / name).is_dir() for name in ("color", "pose", "intrinsic"))


def _matrix(path: Path) -> Array:
    with read_as(path, "a matrix"):
        text = read_text(path)
    return numbers(text, 16, path).reshape(4, 4)


def _read(path: Path) -> Capture:
    photographs = {file.stem: file for file in (path / "color").iterdir() if file.stem.isdecimal()}
    poses = {file.stem: file for file in (path / "pose").glob("*.txt") if file.stem.isdecimal()}
    stems = sorted(photographs.keys() & poses.keys(), key=int)
    if not stems:
        raise InputError(path, "no file of color has one of the same number in pose")
    notes = _unpaired(set(photographs), set(poses))
    size = image_size(photographs[stems[0]])
    color_matrix = _matrix(path / "intrinsic" / "intrinsic_color.txt")
    pinhole = color_matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    camera = calibration(*size, pinhole, path / "intrinsic", centre_of_first_pixel=0.0)
    depth_files = {stem: path / "depth" / f"{stem}.png" for stem in stems}
    with_depth = (path / "depth").is_dir()
    depth_camera, depth_from_color = None, np.eye(4)
    if with_depth:
        depth_matrix = _matrix(path / "intrinsic" / "intrinsic_depth.txt")
        pinhole = depth_matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
        depth_size = image_size(depth_files[stems[0]])
        depth_camera = calibration(
            *depth_size, pinhole, path / "intrinsic", centre_of_first_pixel=0.0
        )
        depth_from_color = _depth_from_color(path / "intrinsic")
    frames, lost = [], 0
    for stem in stems:
        matrix = _pose(poses[stem])
        if matrix is None:
            lost += 1
            continue
        frames.append(
            CapturedFrame(
                name=photographs[stem].name,
                read_color=partial_read(read_photograph, photographs[stem], *size),
                camera=camera,
                world_from_cam=matrix,
                read_depth_m=partial_read(read_depth_png, depth_files[stem], MILLIMETRES)
                if with_depth
                else None,
                depth_camera=depth_camera,
                color_file=photographs[stem],
            )
        )
    if not frames:
        raise InputError(path / "pose", f"none of the {len(stems)} poses is finite")
    if lost:
        notes.append(f"{lost} of {len(stems)} frames have no pose: tracking was lost")
    return Capture(path, FORMAT.name, tuple(frames), depth_from_color, notes=tuple(notes))


def _unpaired(photographs: set[str], poses: set[str]) -> list[str]:
    """Say how many photographs have no pose file of their number, and how many poses none."""
    notes = []
    for found, others, noun, other in (
        (poses, photographs, "poses", "photograph"),
        (photographs, poses, "photographs", "file in pose"),
    ):
        alone = found - others
        if alone:
            first = min(alone, key=int)
            notes.append(f"{len(alone)} of {len(found)} {noun} have no {other} ({first}, ...)")
    return notes


def _pose(path: Path) -> Array | None:
    """Read a pose (4, 4); None where it is not finite: tracking was lost."""
    with read_as(path, "a pose"):
        values = np.array(read_text(path).split(), np.float64)
    if values.shape == (16,) and not np.isfinite(values).all():
        return None
    if values.shape != (16,):
        raise InputError(path, "a pose is four rows of four numbers")
    return rigid_pose(values.reshape(4, 4), path)


def _depth_from_color(folder: Path) -> Array:
    """Combine the two extrinsics, each the pose of a sensor's camera in the device."""
    files = [folder / f"extrinsic_{kind}.txt" for kind in ("depth", "color")]
    device_from_depth, device_from_color = (
        rigid_pose(_matrix(file), file) if file.is_file() else np.eye(4) for file in files
    )
    return np.asarray(inverse(device_from_depth) @ device_from_color)


FORMAT = CaptureFormat(
    name="scannet",
    title="ScanNet, extracted",
    marks="folders color, pose and intrinsic",
    source="Dai et al., ScanNet, CVPR 2017; SensReader of its repository",
    is_at=_is_at,
    read=_read,
)
