"""Which camera took the frames: the manifest's, a calibration file's, or the one of 7-Scenes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from synfeal.config.collection import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.manifest import MANIFEST
from synfeal.errors import InputError, why
from synfeal.files import read_json

# Depth and colour of 7-Scenes come from a Kinect; its authors give this for both.
SEVEN_SCENES = CameraConfig(width=640, height=480, fx=585.0, fy=585.0, cx=320.0, cy=240.0)


@dataclass(frozen=True)
class KnownCamera:
    """A camera and where it is known from.

    Attributes:
        config: its intrinsics and distortion.
        source: for the report.
        assumed: nothing says that this is the camera.
    """

    config: CameraConfig
    source: str
    assumed: bool = False


def camera_of_dataset(dataset: Path, camera_file: Path | None) -> KnownCamera:
    """The camera of a data set.

    Args:
        dataset: directory of the data set.
        camera_file: calibration file that goes before the manifest.

    Raises:
        InputError: the file or the manifest is there and cannot be used.
    """
    if camera_file is not None:
        from synfeal.camera.calibration_files import read_calibration

        return KnownCamera(
            _config(camera_file, asdict(read_calibration(camera_file))), str(camera_file)
        )
    path = dataset / MANIFEST
    if not path.exists():
        return KnownCamera(SEVEN_SCENES, "assumed: that of 7-Scenes", assumed=True)
    return KnownCamera(_config(path, read_manifest(dataset).get("camera")), MANIFEST)


def _config(path: Path, values: object) -> CameraConfig:
    try:
        return CameraConfig.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: camera: {describe(error, CameraConfig)}") from None


def read_manifest(dataset: Path) -> dict[str, Any]:
    """The manifest as it stands.

    Raises:
        InputError: it cannot be read as a JSON object.
    """
    path = dataset / MANIFEST
    try:
        manifest = read_json(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as a manifest ({why(error)})") from None
    if not isinstance(manifest, dict):
        raise InputError(f"{path}: cannot be read as a manifest (no JSON object)")
    return manifest
