"""Painters of building materials: plaster, wood, masonry, fabric, marble."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from synfeal.scenes.canvas import Canvas, Colour, Painter, Pixels


def mix(
    first: Pixels | NDArray[np.float32],
    second: Pixels | NDArray[np.float32],
    share: NDArray[np.float32],
) -> Pixels:
    """Per pixel ``first·(1 − share) + second·share``; ``share`` is (H, W)."""
    return np.asarray(first + (second - first) * share[..., None], np.float32)


def _tinted(colour: Colour, relief: NDArray[np.float32]) -> Pixels:
    return np.asarray(np.asarray(colour, np.float32) * (1 + relief[..., None]), np.float32)


def flat(canvas: Canvas, colour: Colour, wear: float = 0.03) -> Pixels:
    """Paint or plastic: one colour with a little wear."""
    return _tinted(colour, np.float32(wear) * canvas.noise(0.08, 3))


def painted(colour: Colour, wear: float = 0.05) -> Painter:
    """A painter of :func:`flat` in one colour."""
    return partial(flat, colour=colour, wear=wear)


def plaster(canvas: Canvas, colour: Colour, stains: float = 0.03, grain: float = 0.012) -> Pixels:
    """A painted wall: almost no texture, broad stains."""
    relief = np.float32(stains) * canvas.noise(0.9, 5, 0.65)
    relief += np.float32(grain) * canvas.noise(0.025, 2)
    return _tinted(colour, relief)


def wainscot(
    canvas: Canvas,
    colour: Colour,
    lower: Colour,
    height_m: float = 0.95,
    grain: float = 0.02,
    stains: float = 0.03,
) -> Pixels:
    """Plaster with a differently painted band of ``height_m`` above the floor and a rail on it."""
    image = plaster(canvas, colour, stains, grain)
    _, y = canvas.coordinates_m()
    above_floor = canvas.size_m[1] - y[:, 0]
    band = above_floor < height_m
    image[band] = plaster(canvas, lower, 2 * stains, grain)[band]
    image[np.abs(above_floor - height_m) < 0.02] *= np.float32(0.55)
    image[above_floor < 0.09] *= np.float32(0.5)
    return image


def wood(canvas: Canvas, colour: Colour, contrast: float = 0.12, upright: bool = False) -> Pixels:
    """Wood grain along x, or along y if ``upright``."""
    along, across = 0.8, 0.035
    cell = (across, along) if upright else (along, across)
    rings = np.sin(6 * canvas.noise((cell[0] * 3, cell[1] * 3), 2)).astype(np.float32)
    relief = contrast * (0.5 * rings + 0.6 * canvas.noise(cell, 4, 0.75))
    return _tinted(colour, relief.astype(np.float32))


def masonry(
    canvas: Canvas,
    palette: tuple[Colour, ...],
    block_m: tuple[float, float],
    joint_m: float = 0.006,
    joint: Colour = (0.45, 0.43, 0.4),
    stagger: float = 0.5,
    spread: float = 0.08,
) -> Pixels:
    """Tiles, bricks, planks or ashlar: blocks of random palette colours between joints.

    ``stagger`` shifts every other row by that share of a block; ``spread`` is the deviation of the
    blocks' brightness.
    """
    x, y = canvas.coordinates_m()
    row = np.floor(y / block_m[1]).astype(np.int64)
    shifted = x / block_m[0] + stagger * (row % 2)
    column = np.floor(shifted).astype(np.int64)
    n_rows, n_columns = int(row.max()) + 1, int(column.max()) + 1
    choice = canvas.rng.integers(len(palette), size=(n_rows, n_columns))
    tint = 1 + spread * canvas.rng.standard_normal((n_rows, n_columns))
    blocks = np.asarray(np.asarray(palette)[choice] * tint[..., None], np.float32)
    image: Pixels = blocks[np.broadcast_to(row, column.shape), column]
    image *= 1 + 0.05 * canvas.noise(0.06, 4, 0.8)[..., None]
    edge_x = np.abs((shifted + 0.5) % 1 - 0.5) * block_m[0]
    edge_y = np.abs((y / block_m[1] + 0.5) % 1 - 0.5) * block_m[1]
    image[np.minimum(edge_x, edge_y) < joint_m / 2] = np.asarray(joint, np.float32)
    return image


def fabric(
    canvas: Canvas, colour: Colour, stripe: Colour | None = None, pitch_m: float = 0.1
) -> Pixels:
    """Cloth with a weave and, if given, stripes."""
    image = _tinted(colour, 0.06 * canvas.noise(0.012, 2) + 0.06 * canvas.noise(0.3, 3))
    if stripe is not None:
        x, _ = canvas.coordinates_m()
        inside = (x[0] / pitch_m) % 1 < 0.3
        ratio = np.asarray(stripe, np.float32) / np.asarray(colour, np.float32)
        image[:, inside] *= ratio.astype(np.float32)
    return image


def marble(canvas: Canvas, colour: Colour, vein: Colour, scale_m: float = 0.35) -> Pixels:
    """Polished stone with turbulent veins."""
    turbulence = canvas.noise(scale_m, 6, 0.65)
    share = np.exp(-9 * np.abs(turbulence)).astype(np.float32)
    share = np.clip(share + 0.12 * canvas.noise(scale_m / 3, 4), 0, 1)
    return mix(np.asarray(colour, np.float32), np.asarray(vein, np.float32), share)


def rug(canvas: Canvas, palette: tuple[Colour, ...]) -> Pixels:
    """A woven rug: nested borders around a field of random diamonds."""
    x, y = canvas.coordinates_m()
    width, height = canvas.size_m
    inset = np.minimum(np.minimum(x, width - x), np.minimum(y, height - y))
    ring = np.floor(inset / 0.09).astype(np.int64)
    image = np.asarray(palette, np.float32)[np.minimum(ring, 2) % len(palette)]
    diamond = np.floor(x / 0.3 + y / 0.3) * 7 + np.floor((x - y) / 0.3) * 3
    table = canvas.rng.integers(len(palette), size=64)
    field = np.asarray(palette, np.float32)[table[diamond.astype(np.int64) % 64]]
    image = np.where((ring >= 3)[..., None], field, image)
    zigzag = np.abs((x + 0.5 * y) / 0.06 % 1 - 0.5) < 0.12
    image[zigzag & (ring == 1)] = np.asarray(palette[-1], np.float32)
    return np.asarray(image * (1 + 0.08 * canvas.noise(0.015, 2))[..., None], np.float32)


def damask(canvas: Canvas, colour: Colour, motif: Colour, pitch_m: float = 0.22) -> Pixels:
    """Wallpaper with a repeated flower-like motif; repetition is the point."""
    x, y = canvas.coordinates_m()
    row = np.floor(y / (0.8 * pitch_m))
    u = ((x / pitch_m + 0.5 * (row % 2)) % 1 - 0.5) * 2
    v = ((y / (0.8 * pitch_m)) % 1 - 0.5) * 2
    radius, angle = np.hypot(u, v), np.arctan2(v, u)
    petal = radius < 0.35 + 0.3 * np.cos(5 * angle)
    image = plaster(canvas, colour, 0.05)
    image[petal] = np.asarray(motif, np.float32)
    return image * (1 + 0.03 * canvas.noise(0.02, 2))[..., None]
