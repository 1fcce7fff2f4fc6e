"""Images of frames and photographs: the one reader of them.

Pixels are taken as they are stored, because poses and calibrations are of the stored pixels. A
camera that was held upright may have stored them lying and noted the turn in EXIF:
:mod:`synfeal.camera.orientation` reports and follows it.
"""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.camera.orientation import Orientation, orientation_of
from synfeal.dataset.frame_files import MOST_PIXELS, FrameFile, decode_png
from synfeal.errors import InputError, read_as
from synfeal.records.files import read_bytes

# Modes of Pillow that hold colours of eight bits per channel, or fewer.
EIGHT_BIT = ("1", "L", "LA", "La", "P", "PA", "RGB", "RGBA", "RGBX", "RGBa", "CMYK", "YCbCr", "LAB")
# What Pillow raises on damaged files, decompression bombs included.
IMAGE_DAMAGE = (
    OSError,
    SyntaxError,
    ValueError,
    EOFError,
    struct.error,
    MemoryError,
    RuntimeError,  # pillow-heif
    Image.DecompressionBombError,
)
# HEIF as phones write it; its files begin with a box ``ftyp`` of one of these brands (ISO/IEC
# 23008-12). Pillow decodes it with the help of pillow-heif.
HEIF_SUFFIXES = (".heic", ".heif")
HEIF_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
HEIF = "HEIF"
HEIF_REMEDY = "pip install 'synfeal[heic]', or convert to JPEG"
MOST_FILE_BYTES = 2**30  # per image: more than its pixels take, stored plainly
# A frame of nearly one colour: every so many rows and columns are looked at, and so many of their
# pixels are within so many grey levels of the median.
LOOKED_AT, SAME, ONE_COLOR = 4, 2, 0.95


class TooManyPixelsError(ValueError):
    """An image claims more pixels than memory is taken for."""


def read_image(
    path: FrameFile,
    mode: str | None = None,
    *,
    size: tuple[int, int] | None = None,
    formats: tuple[str, ...] | None = None,
    most_pixels: int = MOST_PIXELS,
    remedy: str = "",
) -> Image.Image:
    """Read and decode an image, verifying the checksums of a PNG.

    Args:
        path: Image file, on its own or inside an archive.
        mode: Pillow mode to convert to: ``RGB`` or ``L``, which only images of eight bits per
            channel can be converted to; None keeps the file's own.
        size: Width and height that it must have, pixels.
        formats: Names of the formats that are read, such as ``PNG``; None reads all of Pillow's.
        most_pixels: Largest width times height; no memory is taken for more.
        remedy: Advice at the end of messages ("; collect the data set again").

    Returns:
        The image as it is stored, with its EXIF data.

    Raises:
        InputError: It is missing, damaged, in another format, or of another size or kind.
    """
    content = _content(path, remedy)
    return decode_image(
        content, path, mode, size=size, formats=formats, most_pixels=most_pixels, remedy=remedy
    )


def decode_image(
    content: bytes,
    place: object,
    mode: str | None = None,
    *,
    size: tuple[int, int] | None = None,
    formats: tuple[str, ...] | None = None,
    most_pixels: int = MOST_PIXELS,
    remedy: str = "",
) -> Image.Image:
    """Decode the bytes of an image; ``place`` names it in messages, see :func:`read_image`.

    Raises:
        InputError: The image is damaged, of another size, or none of 8-bit colours where ``mode``
            asks for one.
    """
    image = _decoded(content, place, formats, most_pixels, remedy)
    if size is not None and image.size != size:
        raise InputError(
            place,
            f"is of {image.width} x {image.height} pixels, the camera of {size[0]} x"
            f" {size[1]}{remedy or '; all images of a camera must be of its size'}",
        )
    if mode is None or mode == image.mode:
        return image
    if image.mode not in EIGHT_BIT:
        raise InputError(
            place, f"holds pixels of mode {image.mode}, such as depth, not 8-bit colours{remedy}"
        )
    if "transparency" in image.info:  # a palette's: Pillow knows this way only
        image = image.convert("RGBA")
    return image.convert(mode)


def read_rgb(
    path: FrameFile,
    *,
    size: tuple[int, int] | None = None,
    shrink: int = 1,
    formats: tuple[str, ...] | None = None,
    remedy: str = "",
) -> NDArray[np.uint8]:
    """Read the colours (H, W, 3) of an image.

    Args:
        path: Image file.
        size: Width and height that it must have, pixels.
        shrink: Factor by which both sides are then made shorter, averaging pixels.
        formats: Names of the formats that are read, such as ``PNG``; None reads all of Pillow's.
        remedy: Advice at the end of messages.

    Raises:
        InputError: See :func:`read_image`.
    """
    image = read_image(path, "RGB", size=size, formats=formats, remedy=remedy)
    return np.asarray(image.reduce(shrink) if shrink > 1 else image)


def image_size(path: FrameFile) -> tuple[int, int]:
    """Read the width and height of an image as it is stored, pixels, without decoding it.

    EXIF may turn it: see :func:`image_size_and_turn`.

    Raises:
        InputError: It is missing or no image.
    """
    return image_size_and_turn(path)[0]


def image_size_and_turn(path: FrameFile) -> tuple[tuple[int, int], Orientation]:
    """Read width and height of the stored pixels, and EXIF's turn, without decoding an image.

    Raises:
        InputError: It is missing or no image.
    """
    with (
        read_as(path, "an image", *IMAGE_DAMAGE),
        _opened(path) as file,
        opened_image(file) as image,
    ):
        return image.size, orientation_of(image)


def reads_heif() -> bool:
    """Tell whether HEIF can be read here; make Pillow read it if so."""
    try:
        from pillow_heif import register_heif_opener
    except ImportError:
        return False
    register_heif_opener()
    return True


def is_of_one_color(rgb: NDArray[np.uint8]) -> bool:
    """Check whether nearly all pixels of an image (H, W, 3) have about the same colour."""
    rgb = rgb[::LOOKED_AT, ::LOOKED_AT]
    usual = np.median(rgb.reshape(-1, 3), axis=0)
    return bool(np.mean((np.abs(rgb - usual) <= SAME).all(axis=2)) >= ONE_COLOR)


@contextmanager
def opened_image(
    file: IO[bytes], formats: tuple[str, ...] | None = None, most_pixels: int = MOST_PIXELS
) -> Iterator[Image.Image]:
    """Open an image without decoding it.

    Args:
        file: The file, open.
        formats: Names of the formats that Pillow tries, such as ``PNG``; None tries all.
        most_pixels: Largest width times height.

    Raises:
        TooManyPixelsError: The image claims more pixels; no memory is taken for them.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # our bound is lower
        try:
            image = Image.open(file, formats=formats)
        except Image.DecompressionBombError as error:
            raise TooManyPixelsError(
                "it claims more pixels than are read; make it smaller"
            ) from error
    with image:
        if image.width * image.height > most_pixels:
            raise TooManyPixelsError(
                f"{image.width} x {image.height} pixels are too many; make it smaller"
            )
        yield image


def _opened(path: FrameFile) -> IO[bytes]:
    """Open a file, of which its beginning may be all that is read."""
    if isinstance(path, Path) and path.is_file():
        return path.open("rb")
    return io.BytesIO(_content(path))


def _content(path: FrameFile, remedy: str = "") -> bytes:
    with read_as(path, "an image", OSError, ValueError, remedy=remedy):
        try:
            return (
                read_bytes(path, MOST_FILE_BYTES) if isinstance(path, Path) else path.read_bytes()
            )
        except FileNotFoundError as error:
            raise InputError(path, f"missing{remedy}") from error


def _decoded(
    content: bytes, place: object, formats: tuple[str, ...] | None, most_pixels: int, remedy: str
) -> Image.Image:
    """Decode every row; our own PNG files by the fast codec."""
    if content[4:8] == b"ftyp" and content[8:12] in HEIF_BRANDS:
        if not reads_heif():
            raise InputError(place, f"is HEIC, which needs pillow-heif: {HEIF_REMEDY}")
    elif formats is not None:
        formats = tuple(name for name in formats if name != HEIF)  # which Pillow may not know
    if formats is None or "PNG" in formats:
        pixels = decode_png(content)
        if pixels is not None and pixels.shape[0] * pixels.shape[1] <= most_pixels:
            return Image.fromarray(pixels)
    with read_as(place, "an image", *IMAGE_DAMAGE, remedy=remedy):
        with opened_image(io.BytesIO(content), formats, most_pixels) as image:
            is_png = image.format == "PNG"
            if is_png:
                image.verify()  # after which it has to be opened anew
        with opened_image(io.BytesIO(content), formats, most_pixels) as image:
            image.load()
            return image.copy()
