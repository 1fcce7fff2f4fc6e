"""Raw videos of ARKitScenes: low-resolution photographs and depth, a trajectory by time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from synfeal.captures.capture import (
    Array,
    Capture,
    CapturedFrame,
    calibration,
    numbers,
    partial_read,
    resized,
)
from synfeal.captures.formats import CaptureFormat
from synfeal.captures.images import depth_reader, read_photograph
from synfeal.dataset.images import image_size
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import interpolate, inverse, pose_matrix
from synfeal.records.files import read_text

MILLIMETRES = 1000.0
COLOR, DEPTH, CONFIDENCE = "lowres_wide", "lowres_depth", "confidence"
STAMP = re.compile(r"_(\d+\.\d+)$")
# Poses come ten times a second, photographs up to sixty times.
POSE_SLACK_S = 0.15
# Calibrations are named by a time that is rounded otherwise than the photograph's.
CALIBRATION_SLACK_S = 0.002


def _is_at(path: Path) -> bool:
    return (path / COLOR).is_dir() and (path / "lowres_wide.traj").is_file()


def _by_time(folder: Path, pattern: str) -> dict[float, Path]:
    """List files by the time in seconds that their names end in."""
    found = {}
    for file in folder.glob(pattern) if folder.is_dir() else ():
        match = STAMP.search(file.stem)
        if match:
            found[float(match[1])] = file
    return dict(sorted(found.items()))


def _read(path: Path) -> Capture:
    photographs = _by_time(path / COLOR, "*.png")
    calibrations = _by_time(path / "lowres_wide_intrinsics", "*.pincam")
    depths, confidences = _by_time(path / DEPTH, "*.png"), _by_time(path / CONFIDENCE, "*.png")
    pose_s, poses = _trajectory(path / "lowres_wide.traj")
    if not calibrations:
        raise InputError(path / "lowres_wide_intrinsics", "holds no .pincam", "download it, too")
    calibration_s = np.array(list(calibrations))
    files = list(calibrations.values())
    frames, lost = [], 0
    for time_s, photograph in photographs.items():
        nearest = int(np.abs(calibration_s - time_s).argmin())
        pose = _pose_at(time_s, pose_s, poses)
        if pose is None or abs(calibration_s[nearest] - time_s) > CALIBRATION_SLACK_S:
            lost += 1
            continue
        frames.append(
            _frame(
                photograph,
                files[nearest],
                depths.get(time_s),
                confidences.get(time_s),
                pose,
                time_s,
            )
        )
    if not frames:
        raise InputError(path, "no photograph has a pose and a calibration near in time")
    notes = []
    if lost:
        notes.append(f"{lost} of {len(photographs)} photographs have no pose near in time")
    photograph_s = np.array(list(photographs))
    gaps_s = [float(np.abs(photograph_s - time_s).min()) for time_s in calibrations]
    missing = sum(gap_s > CALIBRATION_SLACK_S for gap_s in gaps_s)
    if missing:
        notes.append(f"{missing} of {len(calibrations)} calibrations have no photograph")
    return Capture(path, FORMAT.name, tuple(frames), up=(0.0, 0.0, 1.0), notes=tuple(notes))


def _trajectory(path: Path) -> tuple[Array, Array]:
    """Read times (N,) in seconds and ``world_from_cam`` (N, 4, 4)."""
    with read_as(path, "a trajectory"):
        lines = read_text(path).splitlines()
    rows = [
        numbers(line, 7, f"{path}: line {number}")
        for number, line in enumerate(lines, 1)
        if line.strip()
    ]
    if len(rows) < 2:
        raise InputError(path, f"holds {len(rows)} poses; a trajectory has two or more")
    table = np.array(rows)
    table = table[np.argsort(table[:, 0], kind="stable")]
    # A rotation vector and a translation, from the world to the camera.
    rotation = Rotation.from_rotvec(table[:, 1:4]).as_matrix()
    return table[:, 0], np.asarray(inverse(pose_matrix(rotation, table[:, 4:])))


def _pose_at(time_s: float, pose_s: Array, poses: Array) -> Array | None:
    """Interpolate the pose (4, 4) at a time; None where no poses are near on both sides."""
    after = int(np.searchsorted(pose_s, time_s))
    exact = np.flatnonzero(pose_s == time_s)
    if len(exact):
        return np.asarray(poses[exact[0]])
    if after == 0 or after == len(pose_s):
        return None
    before_s, after_s = pose_s[after - 1], pose_s[after]
    if max(time_s - before_s, after_s - time_s) > POSE_SLACK_S:
        return None
    fraction = (time_s - before_s) / (after_s - before_s)
    return np.asarray(interpolate(poses[after - 1], poses[after], fraction)[0])


def _frame(
    photograph: Path,
    pincam: Path,
    depth: Path | None,
    confidence: Path | None,
    pose: Array,
    time_s: float,
) -> CapturedFrame:
    with read_as(pincam, "a calibration"):
        text = read_text(pincam)
    width, height, *pinhole = numbers(text, 6, pincam).tolist()
    camera = calibration(int(width), int(height), pinhole, pincam)
    return CapturedFrame(
        name=photograph.name,
        read_color=partial_read(read_photograph, photograph, camera.width, camera.height),
        camera=camera,
        world_from_cam=pose,
        read_depth_m=depth_reader(depth, MILLIMETRES, confidence),
        depth_camera=resized(camera, *image_size(depth)) if depth else None,
        time_s=time_s,
        color_file=photograph,
    )


FORMAT = CaptureFormat(
    name="arkitscenes",
    title="ARKitScenes, raw",
    marks="lowres_wide with lowres_wide.traj",
    source="Baruch et al., ARKitScenes, NeurIPS 2021; DATA.md of its repository",
    is_at=_is_at,
    read=_read,
)
