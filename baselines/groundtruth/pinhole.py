"""The pinhole camera of the configuration, in pixels."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig


def focal_length_px(camera: CameraConfig) -> float:
    """Focal length in pixels, the same in both directions."""
    return camera.width / 2 / math.tan(math.radians(camera.horizontal_fov_deg) / 2)


def intrinsic_matrix(camera: CameraConfig, centre_shift_px: float = 0.0) -> NDArray[np.float64]:
    """Intrinsics (3, 3) with the principal point in the image centre.

    Args:
        camera: image size and field of view.
        centre_shift_px: added to the principal point: 0 where the centre of the first pixel is at
            (0.5, 0.5), as here and in COLMAP; -0.5 where it is at (0, 0), as in Open3D.
    """
    focal = focal_length_px(camera)
    centre_x, centre_y = camera.width / 2 + centre_shift_px, camera.height / 2 + centre_shift_px
    return np.array([[focal, 0.0, centre_x], [0.0, focal, centre_y], [0.0, 0.0, 1.0]])
