"""Things that stand in the rooms, as items around the origin with their front towards −y."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import materials, pictures
from synfeal.scenes.canvas import Colour, Painter, pick, shade
from synfeal.scenes.patches import Item, joined, paint
from synfeal.scenes.primitives import box, bumpy, sheet, turned

Generator = np.random.Generator
METAL: Colour = (0.55, 0.56, 0.58)
DARK: Colour = (0.13, 0.13, 0.15)


def _paint_of(colour: Colour, wear: float = 0.05) -> Painter:
    return partial(materials.flat, colour=colour, wear=wear)


def table(
    rng: Generator, size_m: tuple[float, float, float], top: Painter, leg: Colour = METAL
) -> Item:
    """A table: a 4 cm top on four square legs."""
    width, depth, height = size_m
    board = box(rng, (width, depth, 0.04), top, 220).placed(0, 0, height - 0.04)
    legs = [
        box(rng, (0.05, 0.05, height - 0.04), _paint_of(leg), 40, "fblr", casts=False).placed(x, y)
        for x in (-width / 2 + 0.06, width / 2 - 0.06)
        for y in (-depth / 2 + 0.06, depth / 2 - 0.06)
    ]
    return joined([board, *legs])


def monitor(rng: Generator) -> Item:
    """A flat screen on a foot, 0.5 m high."""
    panel = box(rng, (0.56, 0.04, 0.34), _paint_of(DARK), 60, front=None, faces="blrtu")
    face = sheet([(-0.28, -0.02, 0.34), (0.28, -0.02, 0.34), (0.28, -0.02, 0), (-0.28, -0.02, 0)])
    shown = Item((paint(rng, face, pictures.screen, 380, glow=0.6),))
    neck = box(rng, (0.05, 0.04, 0.16), _paint_of(DARK), 40, "fblr", casts=False)
    foot = box(rng, (0.24, 0.16, 0.015), _paint_of(DARK), 60, "fblrt", casts=False)
    return joined([panel.placed(0, 0, 0.14), shown.placed(0, 0, 0.14), neck, foot])


def clutter(rng: Generator, width_m: float, depth_m: float) -> Item:
    """Keyboard, sheets of paper, mugs and boxes spread over a table top at z = 0."""
    things = [
        box(rng, (0.42, 0.14, 0.02), pictures.keyboard, 300, "fblrt", casts=False).placed(
            rng.uniform(-0.2, 0.2), -depth_m * 0.25, 0.001, rng.uniform(-8, 8)
        )
    ]
    for _ in range(4):
        x, y = rng.uniform((-0.42, -0.35), (0.42, 0.3)) * (width_m, depth_m)
        page = box(rng, (0.21, 0.29, 0.004), pictures.page, 320, "t", casts=False)
        things.append(page.placed(x, y, 0.002, rng.uniform(0, 360)))
    for _ in range(3):
        x, y = rng.uniform((-0.45, 0.05), (0.45, 0.4)) * (width_m, depth_m)
        colour = pick(rng, pictures.VIVID)
        if rng.random() < 0.5:
            profile = [(0.03, 0.1), (0.042, 0.1), (0.04, 0.0)]
            things.append(turned(rng, profile, _paint_of(colour), 150, 10, casts=False).placed(x, y, 0.001))
        else:
            size = (rng.uniform(0.12, 0.25), rng.uniform(0.08, 0.16), rng.uniform(0.06, 0.18))
            carton = box(rng, size, partial(pictures.label, colour=colour), 300, "fblrt")
            things.append(carton.placed(x, y, 0.001, rng.uniform(-30, 30)))
    return joined(things)


def chair(rng: Generator, colour: Colour) -> Item:
    """An office chair, 0.95 m high."""
    cloth = partial(materials.fabric, colour=colour)
    seat = box(rng, (0.48, 0.46, 0.08), cloth, 120).placed(0, 0, 0.42)
    back = box(rng, (0.44, 0.06, 0.45), cloth, 120).placed(0, 0.24, 0.52)
    post = turned(rng, [(0.03, 0.42), (0.03, 0.06)], _paint_of(DARK), 60, 8, casts=False)
    feet = [
        box(rng, (0.32, 0.05, 0.05), _paint_of(DARK), 40, "fblrt", casts=False)
        .placed(0.15, 0, 0.03)
        .placed(0, 0, 0, 72 * k)
        for k in range(5)
    ]
    return joined([seat, back, post, *feet])


def cabinet(rng: Generator, size_m: tuple[float, float, float], colour: Colour, doors: int = 2) -> Item:
    """A closed cupboard with doors."""
    front = partial(pictures.cabinet_front, colour=colour, doors=doors)
    return box(rng, size_m, _paint_of(shade(colour, 0.85), 0.08), 120, "blrt", casts=True).__class__(
        (
            *box(rng, size_m, _paint_of(shade(colour, 0.85), 0.08), 120, "flrt", front=front).patches,
        ),
        box(rng, size_m, _paint_of(colour), 4, "t").blocks,
    )
