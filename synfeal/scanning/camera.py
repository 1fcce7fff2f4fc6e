"""The two cameras of an RGB-D sensor: their calibrations, how they sit together, known ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from synfeal.camera.sensors import SENSORS
from synfeal.captures.unpack import RECORD, read_capture_record
from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.depth import MILLIMETRES, Depth, read_depth_m
from synfeal.dataset.depth_agreement import PosedDepth
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_rgb
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.errors import Argument, InputError, read_as
from synfeal.geometry.poses import pose_matrix
from synfeal.records.files import read_json

Array = NDArray[np.float64]
TUM_UNITS_PER_M = 5000.0  # what the TUM benchmark stores a metre of depth as
MOST_ASIDE_M = 10.0  # distance between the colour and the depth camera


@dataclass(frozen=True)
class RgbdCamera:
    """Turns the images of an RGB-D sensor into coloured points.

    The poses of a sequence are taken to be those of its *photographs*: a rendering from a pose of
    the sequence is comparable with the photograph of that name. Where they were estimated from
    depth, as KinectFusion does, they are those of the depth camera in truth, 2.5 cm beside; the
    offset that matters, the angle between the two cameras, then shows as a principal point of the
    colour camera that is a few pixels off, and :mod:`synfeal.scanning.consistency` finds it.

    Attributes:
        color: Intrinsics and lens of the photographs.
        depth: Intrinsics and lens of the depth images.
        depth_from_color: Rigid motion (4, 4) from the colour camera to the depth camera.
        depth_units_per_m: What a depth of one metre is stored as.
        source: Where the calibration comes from, for records.
    """

    color: CameraConfig
    depth: CameraConfig
    depth_from_color: Array
    depth_units_per_m: float = MILLIMETRES
    source: str = ""

    def read_color(self, path: FrameFile, shrink: int = 1) -> NDArray[np.uint8]:
        """Read a photograph (H, W, 3).

        Args:
            path: Image file.
            shrink: Factor by which both sides are made shorter, averaging pixels.

        Raises:
            InputError: It cannot be read or is of another size than the camera.
        """
        return read_rgb(path, size=(self.color.width, self.color.height), shrink=shrink)

    def read_depth_m(self, path: FrameFile) -> Depth:
        """Read a depth image (H, W) in metres, 0 where nothing was measured.

        Raises:
            InputError: It cannot be read or is of another size than the camera.
        """
        size = (self.depth.width, self.depth.height)
        return read_depth_m(path, units_per_m=self.depth_units_per_m, nothing=0.0, size=size)

    @property
    def record(self) -> dict[str, Any]:
        """Its values, ready for JSON."""
        return {
            "color": intrinsics_record(self.color),
            "depth": intrinsics_record(self.depth),
            "depth_from_color": self.depth_from_color.tolist(),
            "depth_units_per_m": self.depth_units_per_m,
            "source": self.source,
        }


def intrinsics_record(camera: CameraConfig) -> dict[str, Any]:
    """Return size, pinhole and distortion of a camera, ready for JSON."""
    return {
        "width": camera.width,
        "height": camera.height,
        **camera.intrinsics._asdict(),
        "distortion": list(camera.distortion),
    }


def pinhole(width: int, height: int, focal_px: float) -> CameraConfig:
    """Build a camera with square pixels and its principal point in the middle of the image."""
    return CameraConfig(
        width=width, height=height, fx=focal_px, fy=focal_px, cx=width / 2.0, cy=height / 2.0
    )


def _camera_of_sensor(name: str) -> RgbdCamera:
    """Return the published calibration of a sensor of ``SENSORS``."""
    sensor = SENSORS[name]
    return RgbdCamera(
        color=CameraConfig(**asdict(sensor.color)),
        depth=CameraConfig(**asdict(sensor.depth)),
        depth_from_color=np.eye(4),
        depth_units_per_m=sensor.depth_units_per_m,
        source=f"preset {name}",
    )


PRESETS: Mapping[str, RgbdCamera] = {
    name: _camera_of_sensor(name) for name in ("7scenes", "tum-fr1", "tum-fr2", "tum-fr3")
}


def posed_depth(frames: PosedFrames, camera: RgbdCamera, options: frozenset[str]) -> PosedDepth:
    """Describe frames with depth for the check of depth against poses.

    Args:
        frames: Frames that all have depth.
        camera: Cameras of colour and depth.
        options: Options that remedies may name, see :class:`PosedDepth`.
    """
    files = [file for file in frames.depth if file is not None]
    return PosedDepth(
        files=files,
        read_m=lambda index: camera.read_depth_m(files[index]),
        world_from_cam=frames.world_from_cam,
        camera=camera.depth,
        depth_from_cam=camera.depth_from_color,
        units_per_m=camera.depth_units_per_m,
        options=options,
    )


@dataclass(frozen=True)
class CameraOptions:
    """Statements of a person about the cameras; None where nothing is said.

    Attributes:
        preset: Name of a known sensor, see :data:`PRESETS`.
        color_camera: Calibration file of the photographs.
        depth_camera: Calibration file of the depth images.
        color_focal_px: Focal length of the photographs, the principal point in their middle.
        depth_focal_px: The same of the depth images.
        depth_from_color: Rotation vector in degrees, then translation in metres.
        depth_units_per_m: What a depth of one metre is stored as.
    """

    preset: str | None = None
    color_camera: Path | None = None
    depth_camera: Path | None = None
    color_focal_px: float | None = None
    depth_focal_px: float | None = None
    depth_from_color: tuple[float, ...] | None = None
    depth_units_per_m: float | None = None


def rgbd_camera(
    options: CameraOptions,
    sequence: Path,
    color_size: tuple[int, int],
    depth_size: tuple[int, int],
    is_tum: bool,
) -> RgbdCamera:
    """Resolve what is known of the cameras of a sequence.

    Options go before a preset, a preset before the manifest of a data set of our own. One camera
    given for colour alone is that of depth too, as where depth is registered to colour.

    Args:
        options: What a person says.
        sequence: The sequence, which may have a ``manifest.json``.
        color_size: Width and height of its photographs, pixels.
        depth_size: Width and height of its depth images, pixels.
        is_tum: Whether it is in the format of the TUM benchmark, which stores 5000 units a metre.

    Raises:
        InputError: Nothing says what the focal length is, or two things do, or a calibration is of
            another size of image.
    """
    if options.preset is not None:
        base: RgbdCamera | None = PRESETS[options.preset]
    else:
        base = _of_capture(sequence) or _of_manifest(sequence)
    color = _one(options.color_camera, options.color_focal_px, color_size, "color")
    depth = _one(options.depth_camera, options.depth_focal_px, depth_size, "depth")
    if base is None:
        if color is None:
            raise InputError(
                sequence,
                "nothing says what its cameras are",
                f"give `preset` ({', '.join(PRESETS)}), `color_camera=FILE` or `color_focal_px=PX`,"
                " and the same for depth where depth is not registered to colour",
            )
        units = TUM_UNITS_PER_M if is_tum else MILLIMETRES
        base = RgbdCamera(color, depth or color, np.eye(4), units, "options")
    elif color is not None or depth is not None:
        base = replace(base, color=color or base.color, depth=depth or base.depth, source="options")
    if options.depth_from_color is not None:
        if not np.isfinite(options.depth_from_color).all():
            raise InputError(Argument("depth_from_color"), "must be six finite numbers")
        if np.abs(options.depth_from_color[3:]).max() > MOST_ASIDE_M:
            raise InputError(
                Argument("depth_from_color"),
                f"X Y Z must be within {MOST_ASIDE_M:g} m, which no two cameras of one device are"
                " apart",
            )
        turn = Rotation.from_rotvec(options.depth_from_color[:3], degrees=True).as_matrix()
        base = replace(base, depth_from_color=pose_matrix(turn, options.depth_from_color[3:]))
    if options.depth_units_per_m is not None:
        if not 0 < options.depth_units_per_m < np.inf:
            raise InputError(
                Argument("depth_scale"), f"must be above 0, found {options.depth_units_per_m:g}"
            )
        base = replace(base, depth_units_per_m=options.depth_units_per_m)
    _check_size(sequence, base.color, color_size, "color")
    _check_size(sequence, base.depth, depth_size, "depth")
    return base


def _one(
    file: Path | None, focal_px: float | None, size: tuple[int, int], kind: str
) -> CameraConfig | None:
    """Return the camera given as a file or a focal length; None where neither is given."""
    if file is not None and focal_px is not None:
        raise InputError(
            Argument(f"{kind}_focal_px"), f"comes from `{kind}_camera` too", "leave one of them out"
        )
    if file is not None:
        try:
            camera = CameraConfig.model_validate(
                {"calibration": file, "width": size[0], "height": size[1]}
            )
        except ValidationError as error:
            raise InputError(Argument(f"{kind}_camera"), describe(error)) from error
        _refuse_wide(camera, Argument(f"{kind}_camera"), f"{file}: ")
        return camera
    if focal_px is not None:
        if not 0 < focal_px < 1e5:
            raise InputError(
                Argument(f"{kind}_focal_px"),
                f"must be above 0 and below 1e5 pixels, found {focal_px:g}",
            )
        return pinhole(*size, focal_px)
    return None


def _refuse_wide(camera: CameraConfig, where: Argument | Path, name: str = "") -> None:
    """Refuse a fisheye or a panorama: depth is fused as that of a perspective camera."""
    if camera.projection is not None:
        raise InputError(
            where,
            f"{name}is a camera of projection {camera.projection}, and a perspective one is needed",
            "undistort the images first",
        )


def _of_capture(sequence: Path) -> RgbdCamera | None:
    """Read the cameras of a capture that was unpacked."""
    record = read_capture_record(sequence)
    if record is None:
        return None
    camera = record["camera"]
    with read_as(sequence / RECORD, "the record of a capture"):
        color = CameraConfig.model_validate(camera["color"])
        depth = CameraConfig.model_validate(camera.get("depth", camera["color"]))
        return RgbdCamera(
            color,
            depth,
            np.array(camera.get("depth_from_color", np.eye(4)), np.float64).reshape(4, 4),
            float(camera.get("depth_units_per_m", MILLIMETRES)),
            RECORD,
        )


def _of_manifest(sequence: Path) -> RgbdCamera | None:
    """Read the camera of a data set of our own, which has one for colour and depth."""
    path = sequence / MANIFEST
    if not path.is_file():
        return None
    with read_as(path, "a manifest"):
        values = read_json(path)
        camera = CameraConfig.model_validate(values.get("camera", values))
    _refuse_wide(camera, path)
    units_per_m = camera.depth_units_per_m or MILLIMETRES
    return RgbdCamera(camera, camera, np.eye(4), units_per_m, MANIFEST)


def _check_size(sequence: Path, camera: CameraConfig, size: tuple[int, int], kind: str) -> None:
    """Check that a camera is that of the first image of a kind."""
    if (camera.width, camera.height) != size:
        raise InputError(
            sequence,
            f"the first {kind} image is of {size[0]}x{size[1]} pixels, its camera of"
            f" {camera.width}x{camera.height}",
            f"give the calibration of these images with `{kind}_camera`",
        )
