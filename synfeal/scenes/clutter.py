"""Small things that lie about, stand on shelves and hang on walls, and what they hide."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import fronts, materials
from synfeal.scenes.canvas import Colour, pick, shade
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, Maker, joined
from synfeal.scenes.pictures import VIVID

BOTTLES: tuple[Colour, ...] = (
    (0.35, 0.2, 0.08), (0.75, 0.78, 0.8), (0.2, 0.4, 0.25), (0.85, 0.85, 0.8), (0.2, 0.3, 0.6),
)  # fmt: skip
LEAVES: tuple[Colour, ...] = ((0.16, 0.4, 0.12), (0.25, 0.5, 0.15), (0.4, 0.55, 0.2))
PAGES_M = ((0.21, 0.297), (0.297, 0.21), (0.297, 0.42))  # width and height
MUG_M = [(0.03, 0.1), (0.042, 0.1), (0.04, 0.0)]


def on_table(make: Maker, width_m: float, depth_m: float) -> Item:
    """Keyboard, sheets of paper, mugs and boxes spread over a table top at z = 0."""
    rng, scale = make.rng, (width_m, depth_m)
    keys = make.box((0.42, 0.14, 0.02), fronts.keyboard, 300, "fblrt")
    things = [keys.placed(rng.uniform(-0.2, 0.2), -depth_m * 0.25, 0.001, rng.uniform(-8, 8))]
    for _ in range(4):
        x, y = rng.uniform((-0.42, -0.35), (0.42, 0.3)) * scale
        page = make.box((0.21, 0.29, 0.004), fronts.page, 320, "t")
        things.append(page.placed(x, y, 0.003, rng.uniform(0, 360)))
    for _ in range(3):
        x, y = rng.uniform((-0.45, 0.05), (0.45, 0.4)) * scale
        colour = pick(rng, VIVID)
        if rng.random() < 0.5:
            things.append(make.turned(MUG_M, painted(colour), 150, 10).placed(x, y, 0.001))
        else:
            size = (rng.uniform(0.12, 0.25), rng.uniform(0.08, 0.16), rng.uniform(0.06, 0.18))
            carton = make.box(size, partial(fronts.label, colour=colour), 300, "fblrt")
            things.append(carton.placed(x, y, 0.001, rng.uniform(-30, 30)))
    return joined(things)


def books(make: Maker, width_m: float, depth_m: float, height_m: float) -> Item:
    """A row of books on z = 0, some leaning, with gaps; the spines face -y."""
    rng, things, x = make.rng, [], -width_m / 2
    while x < width_m / 2 - 0.05:
        thick = rng.uniform(0.018, 0.055)
        size = (thick, depth_m * rng.uniform(0.6, 0.95), height_m * rng.uniform(0.6, 0.98))
        spine = partial(fronts.spine, colour=shade(pick(rng, VIVID), rng.uniform(0.4, 1.2)))
        if rng.random() < 0.9:
            book = make.box(size, painted((0.85, 0.82, 0.74)), 90, "flrt", front=spine)
            at_y = -depth_m / 2 + size[1] / 2 + rng.uniform(0, 0.03)
            things.append(book.placed(x + thick / 2, at_y, 0, rng.uniform(-3, 3)))
        x += thick * 1.04
    return joined(things)


def bottles(make: Maker, width_m: float, count: int) -> Item:
    """A row of bottles, jars and tins on z = 0."""
    rng, things = make.rng, []
    for x in np.linspace(-width_m / 2, width_m / 2, count) + rng.uniform(-0.02, 0.02, count):
        radius, high = rng.uniform(0.025, 0.05), rng.uniform(0.1, 0.24)
        neck = radius * rng.uniform(0.3, 1.0)
        top = [(0.002, high), (neck, high), (neck, 0.75 * high)]
        label = partial(fronts.label, colour=pick(rng, BOTTLES))
        bottle = make.turned([*top, (radius, 0.6 * high), (radius, 0)], label, 170, 12)
        things.append(bottle.placed(x, rng.uniform(-0.03, 0.03)))
    return joined(things)


def wall_shelf(make: Maker, width_m: float, count: int) -> Item:
    """A board on two brackets with a row of bottles; its back is at y = 0."""
    iron, edge = painted((0.3, 0.3, 0.32)), 0.4 * width_m
    board = make.box((width_m, 0.22, 0.025), partial(materials.wood, colour=(0.8, 0.7, 0.55)), 120)
    brackets = [
        make.box((0.02, 0.18, 0.12), iron, 60, "flru").placed(x, -0.1, -0.12) for x in (-edge, edge)
    ]
    row = bottles(make, width_m - 0.14, count).placed(0, -0.11, 0.026)
    return joined(board.placed(0, -0.11), brackets, row)


def pinned_page(make: Maker) -> Item:
    """A sheet of paper on a wall at y = 0, pinned at the top, its lower edge curling off."""
    wide, high = PAGES_M[int(make.rng.integers(len(PAGES_M)))]
    down = np.linspace(0, 1, 7)
    y = -0.006 - make.rng.uniform(0.0, 0.05) * down**2
    sides = [np.stack([np.full(7, x), y, -high * down], axis=-1) for x in (-wide / 2, wide / 2)]
    return make.sheet(np.stack(sides, axis=1), fronts.page, 320)


def coat(make: Maker, colour: Colour) -> Item:
    """A coat on a hook: a folded, drooping sheet in front of a wall at y = 0, hook at z = 0."""
    rng = make.rng
    down, across = np.meshgrid(np.linspace(0, 1, 19), np.linspace(-1, 1, 15), indexing="ij")
    half = 0.07 + 0.2 * np.sqrt(down) + 0.05 * down
    folds = np.sin(across * rng.uniform(7, 10) + rng.uniform(0, 6) + 1.5 * down)
    y = -0.05 - (0.12 * np.sqrt(down) + 0.03 * folds * down) * (1 - 0.85 * across**4)
    points = np.stack([half * across, y, -0.95 * down - 0.04 * across**2], axis=-1)
    return make.sheet(points, partial(materials.fabric, colour=colour), 130)


def plant(make: Maker, height_m: float, pot: Colour, leaves: int = 40) -> Item:
    """A pot plant: bent leaves around a stem."""
    rng, rim = make.rng, 0.14
    profile = [(0.005, 0.24), (rim - 0.02, 0.24), (rim, 0.28), (rim * 0.7, 0.0)]
    things = [make.turned(profile, painted(pot, 0.1), 150, 14)]
    for _ in range(leaves):
        length, width = rng.uniform(0.2, 0.42), rng.uniform(0.04, 0.09)
        along = np.linspace(0, 1, 5)
        rise, bend = rng.uniform(0.1, 0.8), rng.uniform(0.3, 1.2)
        out, up = length * along, length * (rise * along - bend * along**2)
        half = width * np.sin(np.pi * np.clip(along, 0.04, 0.97)) / 2 + 0.002
        leaf = np.stack([np.stack([-half, out, up], -1), np.stack([half, out, up], -1)], axis=1)
        green = shade(pick(rng, LEAVES), rng.uniform(0.7, 1.3))
        made = make.sheet(leaf, painted(green, 0.12), 70)
        things.append(made.placed(0, 0, rng.uniform(0.28, height_m), rng.uniform(0, 360)))
    stem = make.turned([(0.015, height_m), (0.02, 0.24)], painted((0.35, 0.25, 0.15)), 60, 6)
    return joined(things, stem)
