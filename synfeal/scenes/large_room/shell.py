"""Walls, floor and ceiling of the laboratory, and what hangs there: windows, boards, the door."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import fronts, materials, pictures
from synfeal.scenes.canvas import Canvas, Colour, Painter, Pixels
from synfeal.scenes.patches import Item, box, joined, level, on_wall, paint, turned, upright

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


Generator = np.random.Generator
WINDOWS_Y_M = (1.25, 3.3, 5.35)  # centres of the bays in the west wall
WINDOW_M = (1.5, 1.25)
SILL_M = 0.95
BLIND = 0.25
BEECH: Painter = partial(materials.wood, colour=(0.8, 0.68, 0.5), contrast=0.08)
RIBS: Painter = partial(
    materials.masonry, palette=((0.86, 0.86, 0.84),), block_m=(0.06, 1.0), joint_m=0.012
)


def boards(rng: Generator) -> Item:
    """Everything flat on the four walls."""
    return joined([_windows(rng), _south(rng), _east(rng), _north(rng)])


def _windows(rng: Generator) -> Item:
    """Three equal bays in the west wall: view, sill and radiator."""
    view = partial(pictures.window_view, blind=BLIND)
    centre = (0.0, 0.0, SILL_M + WINDOW_M[1] / 2)
    sill = box(rng, (WINDOW_M[0] + 0.2, 0.2, 0.04), BEECH, 120)
    bay = joined(
        [
            on_wall(rng, centre, 90, WINDOW_M, view, 230, depth_m=0.05, glow=0.85),
            sill.placed(0.1, 0, SILL_M - 0.05, 90),
            box(rng, (1.2, 0.1, 0.5), RIBS, 100, "flrt").placed(0.08, 0, 0.2, 90),
        ]
    )
    return joined(bay.placed(0, y) for y in WINDOWS_Y_M)


def _south(rng: Generator) -> Item:
    """Door with exit sign, whiteboard, notice and extinguisher."""
    door = partial(fronts.door, colour=(0.15, 0.3, 0.6), window=True)
    sign = partial(fronts.label, colour=(0.1, 0.6, 0.25))
    profile = [(0.02, 0.55), (0.03, 0.5), (0.08, 0.45), (0.08, 0.0)]
    extinguisher = turned(rng, profile, materials.painted((0.8, 0.08, 0.06)), 150, 12)
    return joined(
        [
            on_wall(rng, (1.3, 0, 1.05), 180, (1.0, 2.1), door, 180, 0.04),
            on_wall(rng, (3.4, 0, 1.55), 180, (2.2, 1.15), pictures.whiteboard, 280, 0.03),
            on_wall(rng, (2.1, 0, 1.25), 180, (0.12, 0.16), fronts.page, 250),
            on_wall(rng, (1.3, 0, 2.36), 180, (0.6, 0.22), sign, 300, 0.03, glow=0.6),
            extinguisher.placed(2.12, 0.12, 0.5),
        ]
    )


def _east(rng: Generator) -> Item:
    """Posters between the cabinets and above the desks."""
    places = (
        (1.15, 1.75, 0.6, 0.85),
        (3.35, 1.8, 0.85, 1.15),
        (4.35, 1.75, 0.6, 0.8),
        (5.1, 1.9, 0.55, 0.4),
    )
    return joined(
        on_wall(rng, (WIDTH_M, y, z), -90, (width, height), pictures.poster, 320)
        for y, z, width, height in places
    )


def _north(rng: Generator) -> Item:
    """Notice board, a large blue poster and small ones."""
    blue = partial(pictures.poster, ground=(0.1, 0.4, 0.75))
    places: tuple[tuple[float, float, float, float, Painter], ...] = (
        (1.2, 1.65, 1.3, 0.95, pictures.noticeboard),
        (2.45, 1.7, 0.7, 1.0, blue),
        (0.3, 1.8, 0.35, 0.5, pictures.poster),
        (3.15, 2.15, 0.36, 0.36, pictures.poster),
    )
    return joined(
        on_wall(rng, (x, LENGTH_M, z), 0, (width, height), painter, 320)
        for x, z, width, height, painter in places
    )
