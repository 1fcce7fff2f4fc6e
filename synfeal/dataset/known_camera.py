"""The camera of the frames of a data set, and where it is known from."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import ValidationError

from synfeal.camera.calibration import read_calibration
from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.manifest import MANIFEST, read_manifest
from synfeal.errors import InputError, read_as
from synfeal.records.files import read_json

# Beside the frames of an unpacked capture.
CAPTURE = "capture.json"
# Depth and colour of 7-Scenes come from the two cameras of a Kinect. The focal length that its
# authors give is that of depth; with that of colour photographs and depth agree (docs/scanning.md).
SEVEN_SCENES = CameraConfig(width=640, height=480, fx=525.0, fy=525.0, cx=320.0, cy=240.0)
SEVEN_SCENES_DEPTH = SEVEN_SCENES.model_copy(update={"fx": 585.0, "fy": 585.0})


@dataclass(frozen=True)
class KnownCamera:
    """A camera and where it is known from."""

    config: CameraConfig  # its intrinsics and distortion
    source: str  # for the report
    assumed: bool = False  # nothing says that this is the camera
    of_depth: CameraConfig | None = None  # that of the depth images, where it is another one

    @property
    def depth(self) -> CameraConfig:
        """The camera of the depth images."""
        return self.of_depth or self.config


def camera_of_dataset(dataset: Path, camera_file: Path | None) -> KnownCamera:
    """Read the camera of a data set; a calibration file takes precedence over the manifest.

    Raises:
        InputError: The calibration or the manifest's camera cannot be used.
    """
    if camera_file is not None:
        lens = asdict(read_calibration(camera_file, with_fisheye=True))
        return KnownCamera(_config(camera_file, lens), str(camera_file))
    path = dataset / MANIFEST
    if not path.exists() and (dataset / CAPTURE).is_file():
        return _of_capture(dataset / CAPTURE)
    if not path.exists():
        return KnownCamera(
            SEVEN_SCENES, "assumed: that of 7-Scenes", assumed=True, of_depth=SEVEN_SCENES_DEPTH
        )
    return KnownCamera(_config(path, read_manifest(dataset).get("camera")), MANIFEST)


def _of_capture(path: Path) -> KnownCamera:
    """Read the cameras that ``synfeal unpack`` recorded."""
    with read_as(path, "the record of a capture"):
        record = read_json(path)
    cameras = record.get("camera") if isinstance(record, dict) else None
    if not isinstance(cameras, dict) or "color" not in cameras:
        raise InputError(path, "is no record of a capture", "unpack it again")
    of_depth = _config(path, cameras["depth"]) if "depth" in cameras else None
    return KnownCamera(_config(path, cameras["color"]), CAPTURE, of_depth=of_depth)


def _config(path: Path, values: object) -> CameraConfig:
    try:
        return CameraConfig.model_validate(values)
    except ValidationError as error:
        raise InputError(path, f"camera: {describe(error)}") from error
