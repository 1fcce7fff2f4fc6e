"""A capture: photographs with poses and calibrations, and depth where the device has it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synfeal.camera.calibration import Calibration
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import pose_from_quat, pose_matrix

Array = NDArray[np.float64]
Colors = NDArray[np.uint8]
Depth = NDArray[np.float32]

# OpenGL's camera (x right, y up, z back), of ARKit and nerfstudio, in ours (x right, y down, z
# forward): multiplied from the right, it turns the one's poses into the other's.
GL_FROM_CAM: Array = np.diag([1.0, -1.0, -1.0, 1.0])
# How far a rotation of a file may be from orthonormal: they are printed with as few as four digits.
RIGID_BOUND = 2e-3


@dataclass(frozen=True)
class CapturedFrame:
    """One photograph of a capture.

    Attributes:
        name: Name of the photograph, unique in the capture, as the capture's files spell it.
        read_color: Returns the photograph (H, W, 3).
        camera: Calibration of the photograph.
        world_from_cam: Pose (4, 4) of the camera of the photograph, x right, y down, z forward, in
            the world of the capture, metres.
        read_depth_m: Returns depth (h, w) along the optical axis in metres, 0 where nothing was
            measured; None where there is no depth image.
        depth_camera: Calibration of the depth image.
        time_s: When it was taken, by the clock of the capture; None where nothing says.
        color_file: File of the photograph, where it is one of its own.
    """

    name: str
    read_color: Callable[[], Colors]
    camera: Calibration
    world_from_cam: Array
    read_depth_m: Callable[[], Depth] | None = None
    depth_camera: Calibration | None = None
    time_s: float | None = None
    color_file: Path | None = None


@dataclass(frozen=True)
class Capture:
    """Photographs of a place in the order they were taken.

    Attributes:
        path: Folder or file that was read.
        format: Name of its format.
        frames: At least one.
        depth_from_color: Rigid motion (4, 4) from the colour camera to the depth camera.
        up: Way up (3,) in the world of the capture, from the device's own sense of gravity; None
            where nothing says.
        notes: What was found and is not used, or is missing; sentences for a person.

    Raises:
        InputError: There are no frames.
    """

    path: Path
    format: str
    frames: tuple[CapturedFrame, ...]
    depth_from_color: Array = field(default_factory=lambda: np.eye(4))
    up: tuple[float, float, float] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.frames:
            raise InputError(self.path, f"holds no photographs, read as {self.format}")

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def has_depth(self) -> bool:
        """True where every frame has a depth image."""
        return all(frame.read_depth_m is not None for frame in self.frames)

    @property
    def world_from_cam(self) -> Array:
        """Poses (N, 4, 4) of the photographs."""
        return np.array([frame.world_from_cam for frame in self.frames])


def rigid_pose(matrix: ArrayLike | None, place: object) -> Array:
    """Return a pose (4, 4) whose rotation is exactly orthonormal.

    Args:
        matrix: Pose (3, 4) or (4, 4) as a file gives it, perhaps with few digits.
        place: Where it stands, for the message.

    Raises:
        InputError: Its rotation is none, or it holds numbers that are not finite.
    """
    with read_as(place, "a pose", TypeError, ValueError):
        pose = np.asarray(() if matrix is None else matrix, np.float64)
    if pose.shape not in ((3, 4), (4, 4)) or not np.isfinite(pose).all():
        raise InputError(place, "must hold a pose: a matrix of 3 or 4 rows and 4 columns")
    rotation = pose[:3, :3]
    u, stretch, vt = np.linalg.svd(rotation)
    if np.abs(stretch - 1.0).max() > RIGID_BOUND or np.linalg.det(rotation) < 0:
        raise InputError(
            place, "is not a rigid pose; the upper left 3x3 of its matrix must be a rotation"
        )
    return pose_matrix(u @ vt, pose[:3, 3])


def quat_pose(position_m: Sequence[float], quat_xyzw: Sequence[float], place: object) -> Array:
    """Return the pose (4, 4) of a position (3,) and a quaternion (4,), real part last.

    Raises:
        InputError: The quaternion is far from length 1, or a number is not finite.
    """
    values = np.array([*position_m, *quat_xyzw], np.float64)
    if not np.isfinite(values).all() or abs(float(np.linalg.norm(values[3:])) - 1.0) > 0.02:
        raise InputError(place, "must hold a position and a quaternion of length 1")
    return pose_from_quat(values[:3], values[[6, 3, 4, 5]])


def calibration(
    width: int,
    height: int,
    pinhole: Sequence[float],
    place: object,
    *,
    centre_of_first_pixel: float = 0.5,
    **lens: Any,
) -> Calibration:
    """Build a calibration from numbers of a file.

    Args:
        width: Width of the image, pixels.
        height: Height of the image, pixels.
        pinhole: fx, fy, cx, cy in pixels.
        place: Where they stand, for the message.
        centre_of_first_pixel: Where the format puts it: 0 (OpenCV) or 0.5 (COLMAP).
        lens: ``distortion``, ``projection``, ``fisheye_k`` of :class:`Calibration`.

    Raises:
        InputError: No camera has such values.
    """
    try:
        fx, fy, cx, cy = (float(value) for value in pinhole)
        shift = 0.5 - centre_of_first_pixel
        values: dict[str, Any] = {"distortion": (0.0,) * 5, **lens}
        if not np.isfinite([fx, fy, cx, cy]).all():
            raise ValueError("numbers must be finite")
        return Calibration(
            width=int(width),
            height=int(height),
            fx=fx,
            fy=fy,
            cx=cx + shift,
            cy=cy + shift,
            **values,
        )
    except (TypeError, ValueError) as error:
        raise InputError(place, f"is no calibration ({error})") from error


def resized(camera: Calibration, width: int, height: int) -> Calibration:
    """Return the calibration of the same view in an image of another size, pixels.

    Unlike :meth:`Calibration.scaled` the sides may change by different factors, as where a depth
    sensor's 256 x 192 stand for 1920 x 1440.
    """
    x, y = width / camera.width, height / camera.height
    return Calibration(
        width=width,
        height=height,
        fx=camera.fx * x,
        fy=camera.fy * y,
        cx=camera.cx * x,
        cy=camera.cy * y,
        distortion=camera.distortion,
        projection=camera.projection,
        fisheye_k=camera.fisheye_k,
    )


def numbers(text: str, count: int, place: object) -> Array:
    """Read so many finite numbers from text.

    Raises:
        InputError: There are others, or one is no finite number.
    """
    with read_as(place, f"{count} numbers"):
        values = np.array(text.replace(",", " ").split(), np.float64)
    if values.shape != (count,) or not np.isfinite(values).all():
        raise InputError(place, f"must hold {count} finite numbers, found {text.strip()[:60]!r}")
    return values


def partial_read(function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """Bind the arguments of a reader; what it reads is read when the frame is used."""
    return partial(function, *arguments)
