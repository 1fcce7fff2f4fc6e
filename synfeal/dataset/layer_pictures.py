"""Depth, normals and masks of frames as pictures to look at."""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import read_image
from synfeal.dataset.layer_files import read_mask
from synfeal.dataset.sequence_listing import COLOR, DEPTH, MASK, NORMAL, RIGHT_COLOR, RIGHT_DEPTH

GOLDEN_RATIO = 0.618034  # neighbours in number get hues far apart


def depth_picture(depth_m: NDArray[np.float32]) -> Image.Image:
    """Show depth (H, W) in grey: white at the camera, half as bright at 2 m, black for nothing."""
    return Image.fromarray((510.0 / (2.0 + depth_m)).astype(np.uint8)).convert("RGB")


def mask_picture(ids: NDArray[np.integer]) -> Image.Image:
    """Show instances (H, W) each in a colour of its own, black for nothing."""
    numbers, index = np.unique(ids, return_inverse=True)
    palette = [
        colorsys.hsv_to_rgb(number * GOLDEN_RATIO % 1.0, 0.65, 0.95) if number else (0.0, 0.0, 0.0)
        for number in numbers.tolist()
    ]
    colors = (255.0 * np.array(palette)).astype(np.uint8)
    return Image.fromarray(colors[index.reshape(ids.shape)])


def _image(file: FrameFile) -> Image.Image:
    return read_image(file, "RGB")


def _depth(file: FrameFile) -> Image.Image:
    return depth_picture(read_depth_m(file))


class Layer(NamedTuple):
    """Display of a kind of file.

    Attributes:
        kind: Ending of its files.
        picture: Makes a picture of one.
        collected_with: Arguments of ``collect`` that make it.
    """

    kind: str
    picture: Callable[[FrameFile], Image.Image]
    collected_with: str


# By the names of ``synfeal preview --show``.
PICTURES: Mapping[str, Layer] = {
    "color": Layer(COLOR, _image, ""),
    "depth": Layer(DEPTH, _depth, "`depth=True`"),
    "normals": Layer(NORMAL, _image, "`normals=True`"),
    "masks": Layer(MASK, lambda file: mask_picture(read_mask(file)), "`masks=True`"),
    "right": Layer(RIGHT_COLOR, _image, "`stereo_m=BASELINE_M`"),
    "right-depth": Layer(RIGHT_DEPTH, _depth, "`depth=True` and `stereo_m=BASELINE_M`"),
}
