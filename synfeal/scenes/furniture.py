"""Things that stand in the rooms, as items around the origin with their front towards −y."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import clutter, fronts, materials
from synfeal.scenes.canvas import Colour, Painter, shade
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, box, joined, paint, sheet, turned

Generator = np.random.Generator
METAL: Colour = (0.55, 0.56, 0.58)
DARK: Colour = (0.13, 0.13, 0.15)


def table(
    rng: Generator, size_m: tuple[float, float, float], top: Painter, leg: Colour = METAL
) -> Item:
    """A table: a 4 cm top on four square legs."""
    width, depth, height = size_m
    board = box(rng, (width, depth, 0.04), top, 220).placed(0, 0, height - 0.04)
    legs = [
        box(rng, (0.05, 0.05, height - 0.04), painted(leg), 40, "fblr").placed(x, y)
        for x in (-width / 2 + 0.06, width / 2 - 0.06)
        for y in (-depth / 2 + 0.06, depth / 2 - 0.06)
    ]
    return joined([board, *legs])


def monitor(rng: Generator) -> Item:
    """A flat screen on a foot, 0.5 m high."""
    panel = box(rng, (0.56, 0.04, 0.34), painted(DARK), 60, "blrtu")
    face = sheet([(-0.28, -0.02, 0.34), (0.28, -0.02, 0.34), (0.28, -0.02, 0), (-0.28, -0.02, 0)])
    shown = Item((paint(rng, face, fronts.screen, 380, glow=0.6),))
    neck = box(rng, (0.05, 0.04, 0.16), painted(DARK), 40, "fblr")
    foot = box(rng, (0.24, 0.16, 0.015), painted(DARK), 60, "fblrt")
    return joined([panel.placed(0, 0, 0.14), shown.placed(0, 0, 0.14), neck, foot])


def chair(rng: Generator, colour: Colour) -> Item:
    """An office chair, 0.95 m high."""
    cloth = partial(materials.fabric, colour=colour)
    seat = box(rng, (0.48, 0.46, 0.08), cloth, 120).placed(0, 0, 0.42)
    back = box(rng, (0.44, 0.06, 0.45), cloth, 120).placed(0, 0.24, 0.52)
    post = turned(rng, [(0.03, 0.42), (0.03, 0.06)], painted(DARK), 60, 8)
    feet = [
        box(rng, (0.32, 0.05, 0.05), painted(DARK), 40, "fblrt")
        .placed(0.15, 0, 0.03)
        .placed(0, 0, 0, 72 * k)
        for k in range(5)
    ]
    return joined([seat, back, post, *feet])


def cabinet(
    rng: Generator,
    size_m: tuple[float, float, float],
    colour: Colour,
    doors: int = 2,
    rows: int = 1,
) -> Item:
    """A closed cupboard with doors, or with rows of drawers."""
    front = partial(fronts.cabinet_front, colour=colour, doors=doors, rows=rows)
    return box(rng, size_m, painted(shade(colour, 0.85), 0.08), 150, "flrt", front=front)


def bookshelf(rng: Generator, size_m: tuple[float, float, float], rows: int = 5) -> Item:
    """A bookcase with a back, boards and sides, filled with books."""
    width, depth, height = size_m
    grain = partial(materials.wood, colour=(0.5, 0.36, 0.22))
    back = box(rng, (width, 0.02, height), grain, 90, "flrt").placed(0, depth / 2 - 0.01)
    levels = np.linspace(0.02, height - 0.025, rows + 1)
    boards = [box(rng, (width, depth, 0.025), grain, 120, "fbtu").placed(0, 0, z) for z in levels]
    sides = [
        box(rng, (0.025, depth, height), grain, 120).placed(x, 0)
        for x in (-width / 2 + 0.0125, width / 2 - 0.0125)
    ]
    pitch = levels[1] - levels[0]
    shelves = [
        clutter.books(rng, width - 0.06, depth - 0.06, pitch - 0.06).placed(0, 0, z + 0.025)
        for z in levels[:-1]
    ]
    return joined([back, *boards, *sides, *shelves])


def cushion(
    rng: Generator, size_m: tuple[float, float, float], painter: Painter, px_per_m: float = 130
) -> Item:
    """A soft box: one bulging sheet over top and sides."""
    width, depth, height = size_m
    grid = np.linspace(-1, 1, 11)
    x, y = np.meshgrid(grid, -grid)
    dome = (1 - x**4) * (1 - y**4)
    points = np.stack([x * width / 2, y * depth / 2, height * (0.25 + 0.75 * dome**0.5)], axis=-1)
    points[[0, -1], :, 2] = 0
    points[:, [0, -1], 2] = 0
    points = points + rng.uniform(-0.004, 0.004, points.shape)
    return Item((paint(rng, points, painter, px_per_m),))


def pew(rng: Generator, width_m: float) -> Item:
    """A church bench, 0.9 m high; one sits facing +y."""
    oak = partial(materials.wood, colour=(0.46, 0.29, 0.16), contrast=0.22)
    seat = box(rng, (width_m, 0.38, 0.04), oak, 110).placed(0, 0, 0.42)
    back = box(rng, (width_m, 0.035, 0.42), oak, 110).placed(0, -0.2, 0.48)
    ends = [
        box(rng, (0.05, 0.46, 0.92), oak, 110).placed(x, 0)
        for x in (-width_m / 2 - 0.025, width_m / 2 + 0.025)
    ]
    return joined([seat, back, *ends])


def sofa(rng: Generator, width_m: float, painter: Painter) -> Item:
    """A sofa with bulging cushions."""
    base = box(rng, (width_m, 0.8, 0.24), painter, 130).placed(0, 0, 0.08)
    back = box(rng, (width_m, 0.2, 0.5), painter, 130).placed(0, 0.3, 0.3)
    arms = [
        box(rng, (0.18, 0.8, 0.34), painter, 130).placed(x, 0, 0.28)
        for x in (-width_m / 2 + 0.09, width_m / 2 - 0.09)
    ]
    inner = (width_m - 0.36) / 2
    seats = [
        cushion(rng, (inner, 0.6, 0.16), painter).placed(x, -0.1, 0.315)
        for x in (-inner / 2, inner / 2)
    ]
    return joined([base, back, *arms, *seats])
