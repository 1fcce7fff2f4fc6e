"""Images of a camera, checked as they are read, and put where COLMAP finds them in order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig
from synfeal.dataset import frame_files
from synfeal.dataset.frame_files import FrameFile, link_or_unpack
from synfeal.errors import InputError


def read_image(path: FrameFile, camera: CameraConfig, mode: str | None = None) -> NDArray[Any]:
    """An image of the camera's size as an array, converted to ``mode`` if one is given.

    Raises:
        InputError: it is missing, cannot be read, or has another size.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such image; collect the data set again")
    pixels = np.asarray(frame_files.read_image(path, mode))
    if pixels.shape[:2] != (camera.height, camera.width):
        raise InputError(
            f"{path}: is {pixels.shape[1]}x{pixels.shape[0]}, the camera has"
            f" {camera.width}x{camera.height}; collect the data set again"
        )
    return pixels


def link_images(color_paths: Sequence[FrameFile], camera: CameraConfig, images: Path) -> None:
    """A new directory ``images`` in which the order of the names is the order of the frames.

    COLMAP leaves out an image that it cannot read, which would look like a frame without texture.

    Raises:
        InputError: as :func:`read_image`.
    """
    images.mkdir()
    for frame, path in enumerate(color_paths):
        read_image(path, camera)
        link_or_unpack(path, images / f"{frame:06d}{path.suffix}")
