"""Bounds of a collection after a person's photographs: box, headings, tilt and roll.

What a localizer has to know is how the scene looks from where photographs will be taken. The
photographs of a scan tell: the box that their camera centres fill and the angles they were held at,
both with a margin, since nobody stands in the same places twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from synfeal.camera.calibration import Calibration
from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.world import ScanRecord, read_scan_record
from synfeal.errors import Argument, InputError, read_as
from synfeal.geometry.axes import meant_poses
from synfeal.geometry.poses import inverse
from synfeal.geometry.rotations import BODY_FROM_CAM
from synfeal.records.files import read_json

Array = NDArray[np.float64]
# Least free view of a photograph, metres, for people photograph tables from nearer than rooms; and
# the least share of it that the scan shows: at the border of a scan cameras could look past it.
MIN_VIEW_DISTANCE_M, MIN_SEEN = 0.8, 0.85
FULL_TURN_DEG, STEEPEST_DEG = 330.0, 89.0


@dataclass(frozen=True)
class Like:
    """Bounds that a collection takes from a trajectory.

    Attributes:
        box: x0, x1, y0, y1, z0, z1 of camera centres in the mesh's world, metres.
        roll_deg: Bounds; so are ``pitch_deg``, positive down, and ``yaw_deg``.
        camera: Camera of the photographs, None where nothing says.
        n_frames: Photographs that it was taken from.
    """

    box: tuple[float, float, float, float, float, float]
    roll_deg: tuple[float, float]
    pitch_deg: tuple[float, float]
    yaw_deg: tuple[float, float]
    camera: CameraConfig | None
    n_frames: int


def like_trajectory(
    mesh: Path,
    sequence: Path,
    frames: slice | None,
    margin_m: float,
    margin_deg: float,
) -> Like:
    """Take bounds and camera from the trajectory of a sequence.

    Args:
        mesh: The mesh that frames are collected of; where ``synfeal scan`` made it, its
            record says how its world lies in that of the sequence, and what the camera is.
        sequence: Posed photographs.
        frames: Which of them; None for all.
        margin_m: Added to the box on all sides, metres.
        margin_deg: Added to the bounds of the angles on both sides, degrees.

    Raises:
        InputError: The sequence cannot be read.
    """
    record = read_scan_record(mesh)
    poses = _read_poses(sequence, frames, record)
    low, high = poses[:, :3, 3].min(axis=0) - margin_m, poses[:, :3, 3].max(axis=0) + margin_m
    roll_deg, pitch_deg, yaw_deg = np.rad2deg(rpy_of(poses[:, :3, :3])).T
    return Like(
        box=(low[0], high[0], low[1], high[1], low[2], high[2]),
        roll_deg=_arc(roll_deg, margin_deg),
        pitch_deg=(
            float(max(pitch_deg.min() - margin_deg, -STEEPEST_DEG)),
            float(min(pitch_deg.max() + margin_deg, STEEPEST_DEG)),
        ),
        yaw_deg=_arc(yaw_deg, margin_deg),
        camera=_camera(sequence, record),
        n_frames=len(poses),
    )


def photograph_poses(mesh: Path | None, sequence: Path) -> Array:
    """Read where the photographs of a sequence were taken, in the world of a mesh.

    Args:
        mesh: File of the mesh, of which ``synfeal scan`` may have made a record; None where there
            is none.
        sequence: Posed photographs.

    Returns:
        Poses ``world_from_cam`` (N, 4, 4).

    Raises:
        InputError: The sequence cannot be read.
    """
    return _read_poses(sequence, None, None if mesh is None else read_scan_record(mesh))


def _read_poses(sequence: Path, frames: slice | None, record: ScanRecord | None) -> Array:
    poses = read_posed_sequence(sequence, frames).world_from_cam
    if record is None:
        return poses
    poses = meant_poses(poses, record.values.get("poses_are", "world_from_cam"))
    return np.asarray(inverse(record.sequence_from_world) @ poses)


def rpy_of(rotation: Array) -> Array:
    """Compute roll, pitch and yaw (N, 3), radians, of ``world_from_cam`` rotations (N, 3, 3).

    The inverse of :func:`synfeal.geometry.rotations.rotation_from_rpy`.
    """
    body = rotation @ BODY_FROM_CAM.T
    return np.asarray(Rotation.from_matrix(body).as_euler("ZYX"))[:, ::-1]


def _arc(angle_deg: Array, margin_deg: float) -> tuple[float, float]:
    """Find the shortest arc of all angles with a margin; a whole turn where it is nearly one.

    Its bounds rise, so the second may be beyond 360 degrees.
    """
    rising = np.sort(angle_deg % 360.0)
    gaps = np.diff(rising, append=rising[0] + 360.0)
    widest = int(np.argmax(gaps))
    start = rising[(widest + 1) % len(rising)]
    length = 360.0 - gaps[widest]
    if length + 2.0 * margin_deg >= FULL_TURN_DEG:
        return (0.0, 360.0)
    low = float(start - margin_deg)
    if low > 180.0:  # nearer to 0 the same arc reads better
        low -= 360.0
    # A single heading and no margin still has to be an interval.
    return (low, low + max(float(length) + 2.0 * margin_deg, 0.1))


def _camera(sequence: Path, record: ScanRecord | None) -> CameraConfig | None:
    """Return the camera of the photographs from a scan's record or a data set's manifest."""
    if record is not None:
        path, values = record.source, record.values.get("camera", {}).get("color")
    elif (sequence / MANIFEST).is_file():
        path = sequence / MANIFEST
        with read_as(path, "a manifest"):
            values = read_json(path)["camera"]
    else:
        return None
    try:
        return CameraConfig.model_validate(values)
    except ValidationError as error:
        raise InputError(path, f"camera: {describe(error)}") from error


def resized(camera: CameraConfig, width: int | None, height: int | None) -> CameraConfig:
    """Resize the images of a perspective camera, keeping its lens.

    Args:
        camera: The camera.
        width: Width of the images, pixels; None to keep the aspect ratio.
        height: Height of the images, pixels; None to keep the aspect ratio. If both are None, the
            size stays.

    Raises:
        InputError: The two sides would not keep the aspect ratio, or the camera is a fisheye or a
            panorama.
    """
    if camera.projection is not None:
        raise InputError(
            Argument("like"),
            f"its camera is {camera.projection}",
            "give a calibration, or projection and field of view",
        )
    try:
        small = Calibration.of_camera(camera).scaled(width, height)
    except ValueError as error:
        raise InputError(Argument("width"), f"the camera to be like {error}") from error
    return camera.model_copy(
        update={
            "width": small.width,
            "height": small.height,
            "fx": small.fx,
            "fy": small.fy,
            "cx": small.cx,
            "cy": small.cy,
        }
    )
