"""Texture look-up as OpenGL does it: repeated, and bilinear in the mip level just sharp enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]
Rgba = NDArray[np.float32]


class MipMaps:
    """Several textures with all their mip levels in one buffer, so that one look-up serves all."""

    def __init__(self, textures: Sequence[NDArray[np.uint8]]) -> None:
        """Halve each texture (H, W, 3 | 4), first row at the top, down to one texel."""
        sizes = [_sizes(texture.shape[1], texture.shape[0]) for texture in textures]
        self._top_level = np.array([len(chain) - 1 for chain in sizes])
        # Width and height, and where the level starts, by texture and level.
        self._size = np.ones((len(sizes), max(map(len, sizes)), 2), np.int64)
        self._start = np.zeros(self._size.shape[:2], np.int64)
        self._texels = np.empty(sum(w * h for chain in sizes for w, h in chain), np.uint32)
        end = 0
        for row, (texture, chain) in enumerate(zip(textures, sizes, strict=True)):
            for column, (size, texels) in enumerate(zip(chain, _levels(texture), strict=True)):
                start, end = end, end + texels.size
                self._size[row, column], self._start[row, column] = size, start
                self._texels[start:end] = texels

    def rgba(self, texture: NDArray[np.intp], uv: Floats, uv_per_px: Floats) -> Rgba:
        """Colours (N, 4), 0 to 255.

        Args:
            texture: (N,) which texture.
            uv: (N, 2) where in it, origin at the bottom left.
            uv_per_px: (N, 4) change from pixel to pixel: du/dx, dv/dx, du/dy, dv/dy.
        """
        ux, vx, uy, vy = (uv_per_px * np.tile(self._size[texture, 0], 2)).T
        squared = np.maximum(np.maximum(ux**2 + vx**2, uy**2 + vy**2), 1.0)
        level = np.minimum(0.5 * np.log2(squared), self._top_level[texture])
        return self._bilinear(texture, level.astype(np.intp), uv)

    def _bilinear(self, texture: NDArray[np.intp], level: NDArray[np.intp], uv: Floats) -> Rgba:
        width, height = self._size[texture, level].T
        left, right, x_share = _neighbours(uv[:, 0], width)
        upper, lower, y_share = _neighbours(1.0 - uv[:, 1], height)
        start = self._start[texture, level]
        upper, lower = start + upper * width, start + lower * width
        above = self._between(upper + left, upper + right, x_share)
        below = self._between(lower + left, lower + right, x_share)
        return above + y_share * (below - above)

    def _between(self, first: NDArray[np.int64], second: NDArray[np.int64], share: Rgba) -> Rgba:
        rgba = _unpacked(self._texels[first])
        return rgba + share * (_unpacked(self._texels[second]) - rgba)


def _sizes(width: int, height: int) -> list[tuple[int, int]]:
    """Width and height of each level: halved and rounded down until one texel is left."""
    top = max(width, height).bit_length() - 1
    return [(max(1, width >> level), max(1, height >> level)) for level in range(top + 1)]


def _levels(texture: NDArray[np.uint8]) -> Iterator[NDArray[np.uint32]]:
    """Texels (H * W,) of each level as packed RGBA."""
    height, width, channels = texture.shape
    rgba = np.full((height, width, 4), 255, np.uint8)
    rgba[..., :channels] = texture
    # As RGBX: colours of RGBA images would be weighed by alpha, which OpenGL does not.
    image = Image.frombuffer("RGBX", (width, height), rgba, "raw", "RGBX", 0, 1)
    for size in _sizes(width, height):
        if size != image.size:
            image = image.resize(size, Image.Resampling.BOX)
        yield np.asarray(image).reshape(-1, 4).view(np.uint32)[:, 0]


def _neighbours(
    position: Floats, size: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Rgba]:
    """The texels before and after a repeated position, and the share (N, 1) of the latter."""
    texel = position * size - 0.5
    below = np.floor(texel)
    share = (texel - below).astype(np.float32)[:, None]
    first = below.astype(np.int64) % size
    second = first + 1
    second[second == size] = 0
    return first, second, share


def _unpacked(texels: NDArray[np.uint32]) -> Rgba:
    return texels.view(np.uint8).reshape(-1, 4).astype(np.float32)
