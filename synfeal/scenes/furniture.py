"""Things that stand in the rooms, as items around the origin with their front towards −y."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import clutter, fronts, materials
from synfeal.scenes.canvas import Colour, Painter, shade
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, Maker, joined, sheet

Size = tuple[float, float, float]  # metres along x, y and z
METAL: Colour = (0.55, 0.56, 0.58)
DARK = painted((0.13, 0.13, 0.15))


def table(make: Maker, size_m: Size, top: Painter, leg: Colour = METAL) -> Item:
    """A table: a 4 cm top on four square legs."""
    width, depth, height = size_m
    board = make.box((width, depth, 0.04), top, 220).placed(0, 0, height - 0.04)
    legs = (
        make.box((0.05, 0.05, height - 0.04), painted(leg), 40, "fblr").placed(x, y)
        for x in (-width / 2 + 0.06, width / 2 - 0.06)
        for y in (-depth / 2 + 0.06, depth / 2 - 0.06)
    )
    return joined(board, legs)


def monitor(make: Maker) -> Item:
    """A flat screen on a foot, 0.5 m high."""
    panel = make.box((0.56, 0.04, 0.34), DARK, 60, "blrtu")
    face = sheet([(-0.28, -0.02, 0.34), (0.28, -0.02, 0.34), (0.28, -0.02, 0), (-0.28, -0.02, 0)])
    shown = make.sheet(face, fronts.screen, 380, glow=0.6)
    neck = make.box((0.05, 0.04, 0.16), DARK, 40, "fblr")
    foot = make.box((0.24, 0.16, 0.015), DARK, 60, "fblrt")
    return joined(panel.placed(0, 0, 0.14), shown.placed(0, 0, 0.14), neck, foot)


def chair(make: Maker, colour: Colour) -> Item:
    """An office chair, 0.95 m high."""
    cloth = partial(materials.fabric, colour=colour)
    feet = (
        make.box((0.32, 0.05, 0.05), DARK, 40, "fblrt").placed(0.15, 0, 0.03).placed(0, 0, 0, turn)
        for turn in range(0, 360, 72)
    )
    return joined(
        make.box((0.48, 0.46, 0.08), cloth, 120).placed(0, 0, 0.42),
        make.box((0.44, 0.06, 0.45), cloth, 120).placed(0, 0.24, 0.52),
        make.turned([(0.03, 0.42), (0.03, 0.06)], DARK, 60, 8),
        feet,
    )


def cabinet(make: Maker, size_m: Size, colour: Colour, doors: int = 2, rows: int = 1) -> Item:
    """A closed cupboard with doors, or with rows of drawers."""
    front = partial(fronts.cabinet_front, colour=colour, doors=doors, rows=rows)
    return make.box(size_m, painted(shade(colour, 0.85), 0.08), 150, "flrt", front=front)


def bookshelf(make: Maker, size_m: Size, rows: int = 5) -> Item:
    """A bookcase with a back, boards and sides, filled with books."""
    width, depth, height = size_m
    grain = partial(materials.wood, colour=(0.5, 0.36, 0.22))
    levels = np.linspace(0.02, height - 0.025, rows + 1)
    inner = width - 0.06, depth - 0.06, levels[1] - levels[0] - 0.06
    edge = width / 2 - 0.0125
    return joined(
        make.box((width, 0.02, height), grain, 90, "flrt").placed(0, depth / 2 - 0.01),
        (make.box((width, depth, 0.025), grain, 120, "fbtu").placed(0, 0, z) for z in levels),
        (make.box((0.025, depth, height), grain, 120).placed(x, 0) for x in (-edge, edge)),
        (clutter.books(make, *inner).placed(0, 0, z + 0.025) for z in levels[:-1]),
    )


def cushion(make: Maker, size_m: Size, painter: Painter, px_per_m: float = 130) -> Item:
    """A soft box: one bulging sheet over top and sides."""
    width, depth, height = size_m
    grid = np.linspace(-1, 1, 11)
    x, y = np.meshgrid(grid, -grid)
    dome = (1 - x**4) * (1 - y**4)
    points = np.stack([x * width / 2, y * depth / 2, height * (0.25 + 0.75 * dome**0.5)], axis=-1)
    points[[0, -1], :, 2] = 0
    points[:, [0, -1], 2] = 0
    return make.sheet(points + make.rng.uniform(-0.004, 0.004, points.shape), painter, px_per_m)


def pew(make: Maker, width_m: float) -> Item:
    """A church bench, 0.9 m high; one sits facing +y."""
    oak, edge = partial(materials.wood, colour=(0.46, 0.29, 0.16), contrast=0.22), width_m / 2
    return joined(
        make.box((width_m, 0.38, 0.04), oak, 110).placed(0, 0, 0.42),
        make.box((width_m, 0.035, 0.42), oak, 110).placed(0, -0.2, 0.48),
        (
            make.box((0.05, 0.46, 0.92), oak, 110).placed(x, 0)
            for x in (-edge - 0.025, edge + 0.025)
        ),
    )


def sofa(make: Maker, width_m: float, painter: Painter) -> Item:
    """A sofa with bulging cushions."""
    edge, inner = width_m / 2 - 0.09, (width_m - 0.36) / 2
    seat = partial(cushion, make, (inner, 0.6, 0.16), painter)
    return joined(
        make.box((width_m, 0.8, 0.24), painter, 130).placed(0, 0, 0.08),
        make.box((width_m, 0.2, 0.5), painter, 130).placed(0, 0.3, 0.3),
        (make.box((0.18, 0.8, 0.34), painter, 130).placed(x, 0, 0.28) for x in (-edge, edge)),
        (seat().placed(x, -0.1, 0.315) for x in (-inner / 2, inner / 2)),
    )
