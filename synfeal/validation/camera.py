"""Which camera took the frames, and its pixels as rays by other code than the renderers'."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.finish import MANIFEST
from synfeal.errors import InputError
from synfeal.validation.manifest import read_manifest

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
    """The camera of a data set; a calibration file goes before the manifest."""
    if camera_file is not None:
        from synfeal.camera.calibration import read_calibration

        return KnownCamera(
            _config(camera_file, asdict(read_calibration(camera_file))), str(camera_file)
        )
    path = dataset / MANIFEST
    if not path.exists():
        return KnownCamera(
            SEVEN_SCENES, "assumed: that of 7-Scenes", assumed=True, of_depth=SEVEN_SCENES_DEPTH
        )
    return KnownCamera(_config(path, read_manifest(dataset).get("camera")), MANIFEST)


def _config(path: Path, values: object) -> CameraConfig:
    try:
        return CameraConfig.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{path}: camera: {describe(error)}") from error


Array = NDArray[np.float64]


class Lens:
    """A camera with the rays of a grid of its pixels, every ``step``-th along both axes.

    ``moved`` is added to (cx, cy), pixels, and to the logarithm of the focal lengths.
    """

    def __init__(
        self, camera: CameraConfig, step: int, moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        import pycolmap  # takes long to load, and only comparing frames needs it

        fx, fy, cx, cy = camera.intrinsics
        self.focal_px = np.array([fx, fy])
        scale = float(np.exp(moved[2]))
        pinhole = [fx * scale, fy * scale, cx + moved[0], cy + moved[1]]
        self._camera = pycolmap.Camera(
            model="FULL_OPENCV",
            width=camera.width,
            height=camera.height,
            params=[*pinhole, *camera.distortion, 0.0, 0.0, 0.0],
        )
        self.rows, self.columns = np.mgrid[
            step // 2 : camera.height : step, step // 2 : camera.width : step
        ].reshape(2, -1)
        pixels = np.stack([self.columns, self.rows], axis=1) + 0.5
        centre = [camera.width / 2.0, camera.height / 2.0]
        self.places = (pixels - centre) / (camera.width / 2.0)
        rays = np.asarray(self._camera.cam_from_img(pixels), np.float64)
        # Points (N, 3) at depth 1 that the pixels of the grid see.
        self.rays = np.column_stack([rays, np.ones(len(rays))])
        # Beyond the corners of the image a distortion polynomial may fold back.
        self._radius = 1.1 * float(np.nanmax(np.linalg.norm(rays, axis=1)))

    def project(self, points_m: Array) -> Array:
        """Pixels (N, 2) of points (N, 3) in the camera, NaN where the camera cannot see them."""
        pixels = np.full((len(points_m), 2), np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            radius = np.linalg.norm(points_m[:, :2], axis=1) / points_m[:, 2]
            seen = (points_m[:, 2] > 1e-6) & (radius < self._radius)
        if seen.any():
            pixels[seen] = self._camera.img_from_cam(points_m[seen])
        return pixels
