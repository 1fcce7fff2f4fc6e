"""Things that stand in the rooms, as items around the origin with their front towards −y."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import fronts, materials
from synfeal.scenes.canvas import Colour, Painter, pick, shade
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, joined, paint
from synfeal.scenes.pictures import VIVID
from synfeal.scenes.primitives import box, sheet, turned

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
        box(rng, (0.05, 0.05, height - 0.04), painted(leg), 40, "fblr", casts=False).placed(x, y)
        for x in (-width / 2 + 0.06, width / 2 - 0.06)
        for y in (-depth / 2 + 0.06, depth / 2 - 0.06)
    ]
    return joined([board, *legs])


def monitor(rng: Generator) -> Item:
    """A flat screen on a foot, 0.5 m high."""
    panel = box(rng, (0.56, 0.04, 0.34), painted(DARK), 60, "blrtu")
    face = sheet([(-0.28, -0.02, 0.34), (0.28, -0.02, 0.34), (0.28, -0.02, 0), (-0.28, -0.02, 0)])
    shown = Item((paint(rng, face, fronts.screen, 380, glow=0.6),))
    neck = box(rng, (0.05, 0.04, 0.16), painted(DARK), 40, "fblr", casts=False)
    foot = box(rng, (0.24, 0.16, 0.015), painted(DARK), 60, "fblrt", casts=False)
    return joined([panel.placed(0, 0, 0.14), shown.placed(0, 0, 0.14), neck, foot])


def clutter(rng: Generator, width_m: float, depth_m: float) -> Item:
    """Keyboard, sheets of paper, mugs and boxes spread over a table top at z = 0."""
    things = [
        box(rng, (0.42, 0.14, 0.02), fronts.keyboard, 300, "fblrt", casts=False).placed(
            rng.uniform(-0.2, 0.2), -depth_m * 0.25, 0.001, rng.uniform(-8, 8)
        )
    ]
    for _ in range(4):
        x, y = rng.uniform((-0.42, -0.35), (0.42, 0.3)) * (width_m, depth_m)
        page = box(rng, (0.21, 0.29, 0.004), fronts.page, 320, "t", casts=False)
        things.append(page.placed(x, y, 0.002, rng.uniform(0, 360)))
    for _ in range(3):
        x, y = rng.uniform((-0.45, 0.05), (0.45, 0.4)) * (width_m, depth_m)
        colour = pick(rng, VIVID)
        if rng.random() < 0.5:
            profile = [(0.03, 0.1), (0.042, 0.1), (0.04, 0.0)]
            things.append(
                turned(rng, profile, painted(colour), 150, 10, casts=False).placed(x, y, 0.001)
            )
        else:
            size = (rng.uniform(0.12, 0.25), rng.uniform(0.08, 0.16), rng.uniform(0.06, 0.18))
            carton = box(rng, size, partial(fronts.label, colour=colour), 300, "fblrt")
            things.append(carton.placed(x, y, 0.001, rng.uniform(-30, 30)))
    return joined(things)


def chair(rng: Generator, colour: Colour) -> Item:
    """An office chair, 0.95 m high."""
    cloth = partial(materials.fabric, colour=colour)
    seat = box(rng, (0.48, 0.46, 0.08), cloth, 120).placed(0, 0, 0.42)
    back = box(rng, (0.44, 0.06, 0.45), cloth, 120).placed(0, 0.24, 0.52)
    post = turned(rng, [(0.03, 0.42), (0.03, 0.06)], painted(DARK), 60, 8, casts=False)
    feet = [
        box(rng, (0.32, 0.05, 0.05), painted(DARK), 40, "fblrt", casts=False)
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
    """A bookcase: painted books between real boards."""
    width, depth, height = size_m
    grain = partial(materials.wood, colour=(0.5, 0.36, 0.22))
    body = box(
        rng,
        (width, depth - 0.1, height),
        grain,
        120,
        "flrt",
        front=partial(fronts.books, rows=rows),
    )
    boards = [
        box(rng, (width, 0.1, 0.025), grain, 90, "ftu", casts=False).placed(0, 0, z)
        for z in np.linspace(0, height - 0.025, rows + 1)
    ]
    sides = [
        box(rng, (0.025, 0.1, height), grain, 90, "flr", casts=False).placed(x, 0)
        for x in (-width / 2 + 0.0125, width / 2 - 0.0125)
    ]
    trim = joined([*boards, *sides]).placed(0, -depth / 2 + 0.05)
    return joined([body.placed(0, 0.05), trim])


def plant(rng: Generator, height_m: float, pot: Colour, leaves: int = 40) -> Item:
    """A pot plant: bent leaves around a stem."""
    rim = 0.14
    profile = [(0.005, 0.24), (rim - 0.02, 0.24), (rim, 0.28), (rim * 0.7, 0.0)]
    things = [turned(rng, profile, painted(pot, 0.1), 150, 14)]
    for _ in range(leaves):
        length, width = rng.uniform(0.2, 0.42), rng.uniform(0.04, 0.09)
        along = np.linspace(0, 1, 5)
        rise, bend = rng.uniform(0.1, 0.8), rng.uniform(0.3, 1.2)
        out = length * along
        up = length * (rise * along - bend * along**2)
        half = width * np.sin(np.pi * np.clip(along, 0.04, 0.97)) / 2 + 0.002
        leaf = np.stack([np.stack([-half, out, up], -1), np.stack([half, out, up], -1)], axis=1)
        green = shade(
            pick(rng, ((0.16, 0.4, 0.12), (0.25, 0.5, 0.15), (0.4, 0.55, 0.2))),
            rng.uniform(0.7, 1.3),
        )
        patch = paint(rng, leaf, painted(green, 0.12), 70)
        things.append(Item((patch,)).placed(0, 0, rng.uniform(0.28, height_m), rng.uniform(0, 360)))
    stem = turned(
        rng, [(0.015, height_m), (0.02, 0.24)], painted((0.35, 0.25, 0.15)), 60, 6, casts=False
    )
    return joined([*things, stem])


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
        box(rng, (0.05, 0.46, 0.92), oak, 110, casts=True).placed(x, 0)
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
