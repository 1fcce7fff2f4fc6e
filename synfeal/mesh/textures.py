"""Images of any kind as 8-bit RGB or RGBA that a renderer can hold."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.errors import why
from synfeal.mesh.model import Findings

Pixels = NDArray[np.uint8]

MAX_SIDE_PX = 16_384  # GL_MAX_TEXTURE_SIZE of Mesa's software renderer and of most GPUs
MAX_PIXELS = 2**30  # 3 GB when decoded: what is larger is not decoded at all


@contextmanager
def large_images_allowed() -> Iterator[None]:
    """Inside, Pillow opens images beyond its limit against hostile files from the web.

    Textures of scans exceed it regularly; :func:`decode` has a limit of its own.
    """
    limit = Image.MAX_IMAGE_PIXELS
    Image.MAX_IMAGE_PIXELS = None
    try:
        yield
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def decode(image: Image.Image, owner: str, findings: Findings) -> Pixels | None:
    """Pixels (H, W, 3 | 4) uint8 of any image Pillow opens; None where it is broken or too large.

    What was converted, made smaller or given up goes to the findings, as ``owner``'s, such as
    ``material 'Wall'``.
    """
    width, height = image.size
    if width * height > MAX_PIXELS:
        findings.warn(
            f"{owner}: texture of {width} x {height} pixels is too large to be read; its base"
            f" colour is used. Make it at most {MAX_SIDE_PX} pixels wide and high"
        )
        return None
    try:
        pixels = to_rgb(image)
    except (OSError, SyntaxError, ValueError) as error:  # Pillow raises all three on damaged files
        findings.warn(f"{owner}: texture cannot be decoded ({why(error)}); its base colour is used")
        return None
    if image.mode not in ("RGB", "RGBA") or pixels.shape[2] != len(image.getbands()):
        kind = "RGBA" if pixels.shape[2] == 4 else "RGB"
        findings.note(f"{owner}: texture converted from {image.mode} to 8-bit {kind}")
    return within_limit(pixels, owner, findings)


def within_limit(pixels: Pixels, owner: str, findings: Findings) -> Pixels:
    """The pixels, made smaller where a side exceeds what renderers take."""
    height, width = pixels.shape[:2]
    if max(height, width) <= MAX_SIDE_PX:
        return pixels
    factor = MAX_SIDE_PX / max(height, width)
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    findings.warn(
        f"{owner}: texture made smaller from {width} x {height} to {size[0]} x {size[1]} pixels,"
        " which is what renderers take"
    )
    return np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BOX))


def to_rgb(image: Image.Image) -> Pixels:
    """Pixels (H, W, 3), or (H, W, 4) where the image carries transparency, as uint8.

    Palette, grey, grey with alpha, 16-bit, float, CMYK and YCbCr images are converted.
    """
    if image.mode.startswith("I") or image.mode == "F":
        return np.repeat(_grey_8bit(image)[..., None], 3, axis=2)
    has_alpha = image.mode in ("LA", "PA", "La", "RGBA", "RGBa") or "transparency" in image.info
    return np.asarray(image.convert("RGBA" if has_alpha else "RGB"))


def _grey_8bit(image: Image.Image) -> Pixels:
    """Grey (H, W) of an integer (16-bit range) or float (0 to 1) image."""
    values = np.asarray(image, dtype=np.float64)
    scale = 255.0 if image.mode == "F" else 255.0 / 65535.0
    return np.clip(np.round(values * scale), 0, 255).astype(np.uint8)
