"""A capture written as one posed sequence: the layout that every other command reads.

Every photograph is of one camera then: those whose calibration differs, as where a phone focuses
anew, or whose lens is a fisheye, are drawn as one pinhole camera sees them. ``capture.json`` beside
the frames keeps calibrations, names, times, and the way up.
"""

from __future__ import annotations

import os
import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from synfeal.camera.calibration import Calibration
from synfeal.captures.capture import Array, Capture, CapturedFrame, Colors, Depth, resized
from synfeal.captures.views import (
    common_camera,
    has_lens,
    largest_offset_px,
    redrawn_color,
    redrawn_depth,
)
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.sevenscenes import pose_text
from synfeal.errors import InputError, read_as
from synfeal.records.files import atomic_directory, read_json, write_json

RECORD = "capture.json"
MILLIMETRES = 1000.0
FARTHEST_MM = 65534
# Below, a photograph is kept as it is: what a feature's place is known to.
SAME_CAMERA_PX = 0.25
JPEG_QUALITY = 95
# Longest side of photographs: a scan's vertices are a centimetre apart, which at two metres is
# seven pixels of a phone's 1920, and larger images take longer at every later stage.
LONGEST_PX = 1280
SUFFIXES = (".jpg", ".jpeg", ".png")


@dataclass(frozen=True)
class Unpacked:
    """A capture as a posed sequence.

    Attributes:
        format: Name of the format that the capture has.
        n_captured: Number of frames of the capture.
        folder: Folder of ``frame-000000.color.jpg`` and so on, with ``capture.json``.
        color: Camera of all photographs.
        depth: Camera of all depth images; None where there are none.
        names: Names of the photographs in the capture, in the order of the frames.
        notes: What was left out; sentences for a person.
    """

    format: str
    n_captured: int
    folder: Path
    color: Calibration
    depth: Calibration | None
    names: tuple[str, ...]
    notes: tuple[str, ...]


def unpack(
    capture: Capture,
    folder: Path,
    *,
    stride: int = 1,
    longest_px: int = LONGEST_PX,
    on_frame: Callable[[], object] = lambda: None,
) -> Unpacked:
    """Write a capture as a posed sequence.

    Args:
        capture: Photographs with poses, and depth or none.
        folder: To create; it appears when it is complete.
        stride: Take every so many frames.
        longest_px: Photographs with a longer side are made smaller, pixels.
        on_frame: Called after every frame.

    Returns:
        The sequence, and what was left out.

    Raises:
        InputError: No two frames are left, or an image cannot be read.
    """
    frames, notes = _usable(capture)
    frames = frames[::stride]
    if len(frames) < 2:
        raise InputError(capture.path, f"{len(frames)} of its frames can be used; two are needed")
    color = _at_most(common_camera([frame.camera for frame in frames]), longest_px)
    depth = None
    if frames[0].depth_camera is not None:
        depth = common_camera([_depth_camera(frame) for frame in frames])
    far = _Far()
    with atomic_directory(folder) as temporary:
        for index, frame in enumerate(frames):
            stem = temporary / f"frame-{index:06d}"
            _write_color(frame, color, stem)
            if depth is not None:
                _write_depth(frame, depth, stem, far)
            Path(f"{stem}.pose.txt").write_text(pose_text(frame.world_from_cam), encoding="utf-8")
            on_frame()
        write_json(temporary / RECORD, _record(capture, frames, color, depth))
    notes = (*capture.notes, *notes, *far.notes())
    return Unpacked(
        format=capture.format,
        n_captured=len(capture),
        folder=folder,
        color=color,
        depth=depth,
        names=tuple(frame.name for frame in frames),
        notes=notes,
    )


def _at_most(camera: Calibration, longest_px: int) -> Calibration:
    """Return a camera, or the same view in an image whose longer side is no longer than that."""
    factor = longest_px / max(camera.width, camera.height)
    if factor >= 1.0:
        return camera
    return resized(camera, round(camera.width * factor), round(camera.height * factor))


def _depth_camera(frame: CapturedFrame) -> Calibration:
    assert frame.depth_camera is not None
    return frame.depth_camera


def _usable(capture: Capture) -> tuple[list[CapturedFrame], tuple[str, ...]]:
    """Choose the frames of the commonest size, and those with depth where most have it."""
    notes = []
    sizes = Counter((frame.camera.width, frame.camera.height) for frame in capture.frames)
    size, n_of_size = sizes.most_common(1)[0]
    frames = [f for f in capture.frames if (f.camera.width, f.camera.height) == size]
    if n_of_size < len(capture):
        notes.append(
            f"{len(capture) - n_of_size} photographs are not of {size[0]}x{size[1]} pixels and are"
            " left out"
        )
    with_depth = [frame for frame in frames if frame.read_depth_m is not None]
    if 0 < len(with_depth) < len(frames):
        if 2 * len(with_depth) < len(frames):
            notes.append(f"depth is not used: {len(with_depth)} of {len(frames)} frames have it")
            return [_without_depth(frame) for frame in frames], tuple(notes)
        notes.append(f"{len(frames) - len(with_depth)} frames have no depth and are left out")
        return with_depth, tuple(notes)
    return frames, tuple(notes)


def _without_depth(frame: CapturedFrame) -> CapturedFrame:
    values = {**frame.__dict__, "read_depth_m": None, "depth_camera": None}
    return CapturedFrame(**values)


def _is_kept(own: Calibration, shared: Calibration) -> bool:
    """Tell whether an image of a camera can stand for one of another."""
    if own == shared:
        return True
    return not has_lens(own) and largest_offset_px(own, shared) <= SAME_CAMERA_PX


def _write_color(frame: CapturedFrame, camera: Calibration, stem: Path) -> None:
    """Copy a photograph, or draw it anew where its camera or its size is another."""
    own, size = frame.camera, (camera.width, camera.height)
    is_of_size = (own.width, own.height) == size
    file = frame.color_file
    can_stay = is_of_size and _is_kept(own, camera)
    if can_stay and file is not None and file.suffix.lower() in SUFFIXES:
        _copy(file, Path(f"{stem}.color{file.suffix.lower()}"))
        return
    image: Colors = frame.read_color()
    if not is_of_size:
        smaller = Image.fromarray(image).resize(size, Image.Resampling.BOX)
        image, own = np.asarray(smaller), resized(own, *size)
    if not _is_kept(own, camera):
        image = redrawn_color(image, own, camera)
    Image.fromarray(image).save(f"{stem}.color.jpg", quality=JPEG_QUALITY, subsampling=0)


def _copy(source: Path, target: Path) -> None:
    """Link a file, or copy it where it lies on another disk."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)


class _Far:
    """Count of measurements beyond what a depth image of 16 bits holds in millimetres."""

    def __init__(self) -> None:
        self.n_measured = self.n_far = 0

    def count(self, depth_mm: Depth) -> None:
        self.n_measured += int((depth_mm > 0).sum())
        self.n_far += int((depth_mm > FARTHEST_MM).sum())

    def notes(self) -> tuple[str, ...]:
        if not self.n_far:
            return ()
        share = self.n_far / self.n_measured
        return (f"{share:.1%} of the depth measured is beyond 65.5 m and is left out",)


def _write_depth(frame: CapturedFrame, camera: Calibration, stem: Path, far: _Far) -> None:
    assert frame.read_depth_m is not None
    depth_m = frame.read_depth_m()
    own = _depth_camera(frame)
    if depth_m.shape != (own.height, own.width):
        raise InputError(
            frame.name,
            f"its depth is of {depth_m.shape[1]}x{depth_m.shape[0]} pixels, its calibration of"
            f" {own.width}x{own.height}; are both of one capture?",
        )
    if not _is_kept(own, camera):
        depth_m = redrawn_depth(depth_m, own, camera)
    depth_mm = np.rint(np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0) * MILLIMETRES)
    far.count(depth_mm)
    stored = np.where((depth_mm > 0) & (depth_mm <= FARTHEST_MM), depth_mm, 0).astype(np.uint16)
    Path(f"{stem}.depth.png").write_bytes(encode_png(stored))


def _record(
    capture: Capture,
    frames: list[CapturedFrame],
    color: Calibration,
    depth: Calibration | None,
) -> dict[str, Any]:
    """Return the content of ``capture.json``."""
    camera: dict[str, Any] = {"color": asdict(color)}
    if depth is not None:
        camera |= {
            "depth": asdict(depth),
            "depth_from_color": capture.depth_from_color.tolist(),
            "depth_units_per_m": MILLIMETRES,
        }
    return {
        "format": capture.format,
        "camera": camera,
        "up": None if capture.up is None else list(capture.up),
        "names": [frame.name for frame in frames],
        "times_s": [frame.time_s for frame in frames],
    }


def read_capture_record(folder: Path) -> dict[str, Any] | None:
    """Read ``capture.json`` of an unpacked capture; None for a sequence from elsewhere.

    Raises:
        InputError: It is there and cannot be read.
    """
    path = folder / RECORD
    if not path.is_file():
        return None
    with read_as(path, "the record of a capture"):
        values = read_json(path)
    if not isinstance(values, dict) or not isinstance(values.get("camera"), dict):
        raise InputError(path, "is no record of a capture", "unpack it again")
    return values


def known_up(folder: Path) -> Array | None:
    """Return the way up (3,), of length 1, in the world of an unpacked capture, where it is known.

    Raises:
        InputError: ``capture.json`` is there and cannot be read.
    """
    record = read_capture_record(folder)
    if record is None or record.get("up") is None:
        return None
    with read_as(folder / RECORD, "the record of a capture", TypeError, ValueError):
        up = np.array(record["up"], np.float64).reshape(3)
        length = float(np.linalg.norm(up))
        if not 0.5 < length < 2.0:
            raise ValueError("'up' must be a direction of length 1")
    return np.asarray(up / length)
