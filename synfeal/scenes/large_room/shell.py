"""Walls, floor and ceiling of the laboratory."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import materials
from synfeal.scenes.canvas import Canvas, Colour, Pixels
from synfeal.scenes.patches import Item, paint
from synfeal.scenes.primitives import level, upright

WIDTH_M, LENGTH_M = 5.0, 6.6
HEIGHT_M = 89.4 / (WIDTH_M * LENGTH_M)  # the volume the paper prints
WHITE: Colour = (0.9, 0.9, 0.88)


def shell(rng: np.random.Generator) -> Item:
    """Four nearly white walls, each with its own band of colour, floor and ceiling."""
    x, y, z = WIDTH_M, LENGTH_M, HEIGHT_M
    wall = partial(materials.wainscot, grain=0.003, stains=0.006)
    surfaces = (
        ((x, 0), (0, 0), (0.9, 0.86, 0.78), (0.75, 0.62, 0.45)),
        ((0, y), (x, y), (0.82, 0.88, 0.89), (0.25, 0.5, 0.52)),
        ((x, y), (x, 0), WHITE, (0.7, 0.7, 0.66)),
        ((0, 0), (0, y), (0.86, 0.87, 0.9), (0.5, 0.56, 0.68)),
    )
    patches = []
    for start, end, colour, lower in surfaces:
        points = upright(start, end, 0, z)
        patches.append(paint(rng, points, partial(wall, colour=colour, lower=lower), 125))
    floor = level((0, x), (0, y), 0)
    ceiling = level((0, x), (0, y), z, face_down=True)
    return Item((*patches, paint(rng, floor, _floor, 180), paint(rng, ceiling, _ceiling, 100)))


def _floor(canvas: Canvas) -> Pixels:
    """Grey linoleum, a lane of blue, tape markings and a door mat."""
    image = materials.plaster(canvas, (0.58, 0.57, 0.54), 0.03, 0.012)
    x, y = canvas.coordinates_m()
    y = canvas.size_m[1] - y  # image rows run towards −y
    lane = (x > 3.1) & (y > 2.2)
    blue = materials.plaster(canvas, (0.28, 0.38, 0.5), 0.03, 0.012)
    image[lane] = blue[lane]
    tape = (np.abs(x - 3.1) < 0.035) & (y > 2.2) | (np.abs(y - 2.2) < 0.035) & (x > 3.1)
    image[tape] = (0.9, 0.75, 0.1)
    hatch = ((x + y) % 0.2 < 0.1) & (np.abs(x - 1.1) < 0.3) & (np.abs(y - 1.9) < 0.3)
    image[hatch] = (0.85, 0.2, 0.15)
    seam = np.abs(x % 1.25 - 0.6) < 0.003
    image[np.broadcast_to(seam, image.shape[:2])] *= np.float32(0.8)
    mat = (np.abs(x - 1.3) < 0.5) & (y > 0.15) & (y < 0.85)
    image[mat] = (0.2, 0.16, 0.14)
    return image


def _ceiling(canvas: Canvas) -> Pixels:
    """White mineral tiles, all alike; a water stain in one corner."""
    x, y = canvas.coordinates_m()
    tiles = materials.plaster(canvas, (0.84, 0.84, 0.81), 0.006, 0.004)
    joint = np.minimum(np.abs((x + 0.3) % 0.6 - 0.3), np.abs((y + 0.3) % 0.6 - 0.3)) < 0.005
    tiles[joint] *= np.float32(0.82)
    ragged = 1 + 0.25 * canvas.noise(0.3, 3)
    stain = np.exp(-((np.hypot(x - 1.3, y - 4.9) / 0.5 / np.maximum(ragged, 0.3)) ** 2))
    rust = tiles * np.asarray((0.75, 0.6, 0.4), np.float32)
    return materials.mix(tiles, rust, stain.astype(np.float32))
