"""The images of a batch, checked and put where COLMAP reads them in the order of the frames."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from synfeal.config.models import CameraConfig
from synfeal.dataset.archive import FrameFile, link_or_unpack
from synfeal.dataset.png import IMAGE_DAMAGE
from synfeal.errors import InputError, why


def link_images(color_paths: Sequence[FrameFile], camera: CameraConfig, images: Path) -> None:
    """A new directory ``images`` in which the order of the names is the order of the frames.

    COLMAP leaves out an image that it cannot read, which would look like a frame without texture.

    Raises:
        InputError: an image is missing, damaged, or not of the camera's size.
    """
    images.mkdir()
    for frame, path in enumerate(color_paths):
        _check(path, camera)
        link_or_unpack(path, images / f"{frame:06d}{path.suffix}")


def _check(path: FrameFile, camera: CameraConfig) -> None:
    if not path.is_file():
        raise InputError(f"{path}: no such image; collect the data set again")
    try:
        with Image.open(io.BytesIO(path.read_bytes())) as image:
            image.load()
            size = image.size
    except IMAGE_DAMAGE as error:
        raise InputError(
            f"{path}: cannot be read as an image ({why(error)}); collect the data set again"
        ) from None
    if size != (camera.width, camera.height):
        raise InputError(
            f"{path}: is {size[0]}x{size[1]}, the camera has {camera.width}x{camera.height}"
        )
