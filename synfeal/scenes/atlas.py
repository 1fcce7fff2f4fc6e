"""Layout of pictures in square textures; the charts are the patches, so no unwrapping is needed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

ATLAS_PX = 4096
GUTTER_PX = 8  # repeated rim around each picture; what mipmaps and filters may reach into

Size = tuple[int, int]
Pixels = NDArray[np.uint8]


def pack(sizes_px: Sequence[Size]) -> tuple[list[tuple[int, int, int]], list[Size]]:
    """Shelf packing of (height, width) into as many atlases as are needed.

    Returns:
        The atlas, row and column of every picture's top-left corner, and the atlases' sizes.

    Raises:
        ValueError: a picture is larger than an atlas.
    """
    places = [(0, 0, 0)] * len(sizes_px)
    atlases: list[Size] = []
    top = shelf = column = used = 0
    for index in sorted(range(len(sizes_px)), key=lambda index: (-sizes_px[index][0], index)):
        height, width = sizes_px[index]
        if max(height, width) > ATLAS_PX:
            raise ValueError(f"a picture of {width} x {height} px; an atlas has {ATLAS_PX} a side")
        if column + width > ATLAS_PX:
            top, shelf, column = top + shelf, 0, 0
        if top + height > ATLAS_PX:
            atlases.append((_rounded_up(top), _rounded_up(used)))
            top = shelf = column = used = 0
        places[index] = (len(atlases), top, column)
        column, shelf = column + width, max(shelf, height)
        used = max(used, column)
    atlases.append((_rounded_up(top + shelf), _rounded_up(used)))
    return places, atlases


def _rounded_up(side_px: int) -> int:
    return min(ATLAS_PX, -(-side_px // 16) * 16)


def laid_out(pictures: Sequence[Pixels]) -> tuple[list[tuple[int, int, int]], list[Pixels]]:
    """Pictures (H, W, 3) in atlases: where each one begins, within its gutter, and the textures."""
    sizes = [(p.shape[0] + 2 * GUTTER_PX, p.shape[1] + 2 * GUTTER_PX) for p in pictures]
    places, atlases = pack(sizes)
    textures = [np.full((*size, 3), 128, np.uint8) for size in atlases]
    for picture, (atlas, row, column) in zip(pictures, places, strict=True):
        padded = np.pad(picture, ((GUTTER_PX,) * 2, (GUTTER_PX,) * 2, (0, 0)), mode="edge")
        height, width = padded.shape[:2]
        textures[atlas][row : row + height, column : column + width] = padded
    return [(atlas, row + GUTTER_PX, column + GUTTER_PX) for atlas, row, column in places], textures
