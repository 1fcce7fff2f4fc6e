"""A person's pictures: which files they are, and how they become what a network sees."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from synfeal.dataset.packed import View, fit_frame
from synfeal.errors import InputError, why

SUFFIXES = (".png", ".jpg", ".jpeg")
# Modes of eight bits or fewer per channel; what else there is has no scale that is known.
MODES = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "CMYK", "YCbCr")
# A longer picture has no square with as much to see as a training frame has.
MAX_ASPECT = 20


def find_pictures(named: Iterable[Path]) -> list[Path]:
    """The files named, and in place of a directory the pictures in it, sorted by name.

    Of a 7-Scenes sequence these are the colour images: ``*.depth.png`` is left out.

    Raises:
        InputError: something named is not there, or a directory holds no picture.
    """
    return [path for name in named for path in (_in(name) if name.is_dir() else [_file(name)])]


def read_picture(path: Path, input_px: int, view: View = "square") -> NDArray[np.uint8]:
    """Pixels (input_px, input_px, 3), made by the function that packs training frames.

    A picture is first turned upright by its EXIF orientation; rendered frames have none, so the
    packer does not look. Grey, palette and CMYK become RGB; an alpha channel is left out.

    Raises:
        InputError: the file is damaged, or is no picture of eight bits per channel.
    """
    try:
        with Image.open(path, formats=("PNG", "JPEG")) as image:
            problem = _problem(image)
            if not problem:
                return fit_frame(_rgb(ImageOps.exif_transpose(image)), input_px, view)
    except Exception as error:  # a damaged file is refused in every way there is
        problem = f"cannot be read as a PNG or JPEG picture ({why(error)})"
    raise InputError(f"{path}: {problem}; leave it out or repair it")


def _in(directory: Path) -> list[Path]:
    try:
        files = sorted(path for path in directory.iterdir() if path.is_file())
    except OSError as error:
        raise InputError(f"{directory}: cannot be listed ({error.strerror})") from None
    if any(directory.glob("seq-[0-9]*")):
        raise InputError(f"{directory}: is a data set; name its sequences, {directory}/seq-01")
    found = [path for path in files if _is_picture(path.name.lower())]
    if not found:
        raise InputError(f"{directory}: holds no {', '.join(SUFFIXES)}; name another directory")
    return found


def _is_picture(name: str) -> bool:
    hidden_or_depth = name.startswith(".") or name.endswith(".depth.png")
    return name.endswith(SUFFIXES) and not hidden_or_depth


def _file(path: Path) -> Path:
    if not path.is_file():
        raise InputError(f"{path}: there is no such picture or directory")
    return path


def _problem(image: Image.Image) -> str:
    """What keeps a picture from being used; empty if nothing."""
    if image.mode not in MODES:
        return f"holds pixels of mode {image.mode}, such as depth, not 8-bit colours"
    if max(image.size) > MAX_ASPECT * min(image.size):
        return f"is {image.width} x {image.height} pixels, too long for a square to be cut out"
    return ""


def _rgb(image: Image.Image) -> Image.Image:
    if "transparency" in image.info:  # a palette's: Pillow converts it by this way only
        image = image.convert("RGBA")
    return image.convert("RGB")
