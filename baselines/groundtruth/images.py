"""Images of a camera, checked as they are read."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.config.models import CameraConfig
from synfeal.dataset.archive import FrameFile
from synfeal.dataset.png import IMAGE_DAMAGE
from synfeal.errors import InputError, why


def read_image(path: FrameFile, camera: CameraConfig, mode: str | None = None) -> NDArray[Any]:
    """An image of the camera's size as an array, converted to ``mode`` if one is given.

    Raises:
        InputError: it cannot be read, or has another size.
    """
    try:
        with Image.open(io.BytesIO(path.read_bytes())) as image:
            pixels = np.asarray(image.convert(mode) if mode else image)
    except IMAGE_DAMAGE as error:
        raise InputError(f"{path}: cannot be read as an image ({why(error)})") from None
    if pixels.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"{path}: is {pixels.shape[1]}x{pixels.shape[0]}, the camera of the configuration"
            f" {camera.width}x{camera.height}; collect the data set again"
        )
    return pixels
