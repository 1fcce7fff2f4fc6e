"""Things in the rooms: furniture, what lies on it, and what hangs on walls; fronts towards −y."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.objects import materials
from synfeal.objects.canvas import VIVID, Color, Painter, pick, shade
from synfeal.objects.materials import painted
from synfeal.objects.patches import Item, Maker, joined, upright

Size = tuple[float, float, float]  # metres along x, y and z
METAL: Color = (0.55, 0.56, 0.58)
DARK = painted((0.13, 0.13, 0.15))


def table(make: Maker, size_m: Size, top: Painter, leg: Color = METAL) -> Item:
    """Build a table: a 4 cm top on four square legs."""
    width, depth, height = size_m
    board = make.box((width, depth, 0.04), top, 220).placed(0, 0, height - 0.04)
    legs = (
        make.box((0.05, 0.05, height - 0.04), painted(leg), 40, "fblr").placed(x, y)
        for x in (-width / 2 + 0.06, width / 2 - 0.06)
        for y in (-depth / 2 + 0.06, depth / 2 - 0.06)
    )
    return joined(board, legs)


def monitor(make: Maker) -> Item:
    """Build a flat screen on a foot, 0.5 m high."""
    panel = make.box((0.56, 0.04, 0.34), DARK, 60, "blrtu")
    face = upright((-0.28, -0.02), (0.28, -0.02), 0, 0.34)
    shown = make.sheet(face, materials.screen(), 380, glow=0.6)
    neck = make.box((0.05, 0.04, 0.16), DARK, 40, "fblr")
    foot = make.box((0.24, 0.16, 0.015), DARK, 60, "fblrt")
    return joined(panel.placed(0, 0, 0.14), shown.placed(0, 0, 0.14), neck, foot)


def chair(make: Maker, color: Color) -> Item:
    """Build an office chair, 0.95 m high."""
    cloth = materials.fabric(color)
    foot = partial(make.box, (0.32, 0.05, 0.05), DARK, 40, "fblrt")
    turns = range(0, 360, 72)
    return joined(
        make.box((0.48, 0.46, 0.08), cloth, 120).placed(0, 0, 0.42),
        make.box((0.44, 0.06, 0.45), cloth, 120).placed(0, 0.24, 0.52),
        make.turned([(0.03, 0.42), (0.03, 0.06)], DARK, 60, 8),
        (foot().placed(0.15, 0, 0.03).placed(0, 0, 0, turn) for turn in turns),
    )


def cabinet(make: Maker, size_m: Size, color: Color, doors: int = 2, rows: int = 1) -> Item:
    """Build a closed cupboard with doors or drawers in its front.

    Args:
        make: Maker of shapes.
        size_m: Width, depth and height, metres.
        color: Colour of the front; the sides are a little darker.
        doors: Doors, or columns of drawers, side by side.
        rows: Rows of them, one above another.
    """
    front = materials.cabinet_front(color, doors=doors, rows=rows)
    return make.box(size_m, painted(shade(color, 0.85), 0.08), 150, "flrt", front=front)


def bookshelf(make: Maker, size_m: Size, rows: int = 5) -> Item:
    """Build a bookcase with a back, boards and sides, filled with books.

    Args:
        make: Maker of shapes.
        size_m: Width, depth and height, metres.
        rows: Rows of books.
    """
    width, depth, height = size_m
    grain = materials.wood((0.5, 0.36, 0.22))
    levels = np.linspace(0.02, height - 0.025, rows + 1)
    inner_width, inner_depth, inner_height = (
        width - 0.06,
        depth - 0.06,
        levels[1] - levels[0] - 0.06,
    )
    edge = width / 2 - 0.0125
    return joined(
        make.box((width, 0.02, height), grain, 90, "flrt").placed(0, depth / 2 - 0.01),
        (make.box((width, depth, 0.025), grain, 120, "fbtu").placed(0, 0, z) for z in levels),
        (make.box((0.025, depth, height), grain, 120).placed(x, 0) for x in (-edge, edge)),
        (
            books(make, inner_width, inner_depth, inner_height).placed(0, 0, z + 0.025)
            for z in levels[:-1]
        ),
    )


def cushion(make: Maker, size_m: Size, painter: Painter, px_per_m: float = 130) -> Item:
    """Build a soft box: one bulging sheet over top and sides.

    Args:
        make: Maker of shapes.
        size_m: Width, depth and height, metres.
        painter: Paints the cover.
        px_per_m: Texels per metre of the cover.
    """
    width, depth, height = size_m
    grid = np.linspace(-1, 1, 11)
    x, y = np.meshgrid(grid, -grid)
    dome = (1 - x**4) * (1 - y**4)
    points = np.stack([x * width / 2, y * depth / 2, height * (0.25 + 0.75 * dome**0.5)], axis=-1)
    points[[0, -1], :, 2] = points[:, [0, -1], 2] = 0
    return make.sheet(points + make.rng.uniform(-0.004, 0.004, points.shape), painter, px_per_m)


def pew(make: Maker, width_m: float) -> Item:
    """Build a church bench, 0.9 m high; one sits facing +y."""
    oak, edge = materials.wood((0.46, 0.29, 0.16), contrast=0.22), width_m / 2 + 0.025
    return joined(
        make.box((width_m, 0.38, 0.04), oak, 110).placed(0, 0, 0.42),
        make.box((width_m, 0.035, 0.42), oak, 110).placed(0, -0.2, 0.48),
        (make.box((0.05, 0.46, 0.92), oak, 110).placed(x, 0) for x in (-edge, edge)),
    )


def sofa(make: Maker, width_m: float, painter: Painter) -> Item:
    """Build a sofa with bulging cushions."""
    edge, inner = width_m / 2 - 0.09, (width_m - 0.36) / 2
    seat = partial(cushion, make, (inner, 0.6, 0.16), painter)
    return joined(
        make.box((width_m, 0.8, 0.24), painter, 130).placed(0, 0, 0.08),
        make.box((width_m, 0.2, 0.5), painter, 130).placed(0, 0.3, 0.3),
        (make.box((0.18, 0.8, 0.34), painter, 130).placed(x, 0, 0.28) for x in (-edge, edge)),
        (seat().placed(x, -0.1, 0.315) for x in (-inner / 2, inner / 2)),
    )


BOTTLES: tuple[Color, ...] = (
    (0.35, 0.2, 0.08), (0.75, 0.78, 0.8), (0.2, 0.4, 0.25), (0.85, 0.85, 0.8), (0.2, 0.3, 0.6),
)  # fmt: skip
LEAVES: tuple[Color, ...] = ((0.16, 0.4, 0.12), (0.25, 0.5, 0.15), (0.4, 0.55, 0.2))
PAGES_M = ((0.21, 0.297), (0.297, 0.21), (0.297, 0.42))  # width and height
MUG_M = [(0.03, 0.1), (0.042, 0.1), (0.04, 0.0)]


def on_table(make: Maker, width_m: float, depth_m: float) -> Item:
    """Build what lies on a table: keyboard, sheets of paper, mugs and boxes, at z = 0.

    Args:
        make: Maker of shapes.
        width_m: Width of the table top (x), metres.
        depth_m: Its depth (y), metres.
    """
    rng, scale = make.rng, (width_m, depth_m)
    keys = make.box((0.42, 0.14, 0.02), materials.keyboard(), 300, "fblrt")
    things = [keys.placed(rng.uniform(-0.2, 0.2), -depth_m * 0.25, 0.001, rng.uniform(-8, 8))]
    for _ in range(4):
        x, y = rng.uniform((-0.42, -0.35), (0.42, 0.3)) * scale
        page = make.box((0.21, 0.29, 0.004), materials.page(), 320, "t")
        things.append(page.placed(x, y, 0.003, rng.uniform(0, 360)))
    for _ in range(3):
        x, y = rng.uniform((-0.45, 0.05), (0.45, 0.4)) * scale
        color = pick(rng, VIVID)
        if rng.random() < 0.5:
            things.append(make.turned(MUG_M, painted(color), 150, 10).placed(x, y, 0.001))
        else:
            size = (rng.uniform(0.12, 0.25), rng.uniform(0.08, 0.16), rng.uniform(0.06, 0.18))
            carton = make.box(size, materials.label(color), 300, "fblrt")
            things.append(carton.placed(x, y, 0.001, rng.uniform(-30, 30)))
    return joined(things)


def books(make: Maker, width_m: float, depth_m: float, height_m: float) -> Item:
    """Build a row of books on z = 0, some leaning, with gaps; the spines face -y.

    Args:
        make: Maker of shapes.
        width_m: Width of the row, metres.
        depth_m: Depth of the shelf, metres; books are less deep.
        height_m: Clear height of the shelf, metres; books are lower.
    """
    rng, things, x = make.rng, [], -width_m / 2
    while x < width_m / 2 - 0.05:
        thick = rng.uniform(0.018, 0.055)
        size = (thick, depth_m * rng.uniform(0.6, 0.95), height_m * rng.uniform(0.6, 0.98))
        spine = materials.spine(shade(pick(rng, VIVID), rng.uniform(0.4, 1.2)))
        if rng.random() < 0.9:
            book = make.box(size, painted((0.85, 0.82, 0.74)), 90, "flrt", front=spine)
            at_y = -depth_m / 2 + size[1] / 2 + rng.uniform(0, 0.03)
            things.append(book.placed(x + thick / 2, at_y, 0, rng.uniform(-3, 3)))
        x += thick * 1.04
    return joined(things)


def bottles(make: Maker, width_m: float, count: int) -> Item:
    """Build a row of bottles, jars and tins on z = 0."""
    rng, things = make.rng, []
    for x in np.linspace(-width_m / 2, width_m / 2, count) + rng.uniform(-0.02, 0.02, count):
        radius, high = rng.uniform(0.025, 0.05), rng.uniform(0.1, 0.24)
        neck = radius * rng.uniform(0.3, 1.0)
        top = [(0.002, high), (neck, high), (neck, 0.75 * high)]
        label = materials.label(pick(rng, BOTTLES))
        bottle = make.turned([*top, (radius, 0.6 * high), (radius, 0)], label, 170, 12)
        things.append(bottle.placed(x, rng.uniform(-0.03, 0.03)))
    return joined(things)


def wall_shelf(make: Maker, width_m: float, count: int) -> Item:
    """Build a board on two brackets with a row of bottles; its back is at y = 0."""
    iron, edge = painted((0.3, 0.3, 0.32)), 0.4 * width_m
    board = make.box((width_m, 0.22, 0.025), materials.wood((0.8, 0.7, 0.55)), 120)
    bracket = partial(make.box, (0.02, 0.18, 0.12), iron, 60, "flru")
    brackets = [bracket().placed(x, -0.1, -0.12) for x in (-edge, edge)]
    row = bottles(make, width_m - 0.14, count).placed(0, -0.11, 0.026)
    return joined(board.placed(0, -0.11), brackets, row)


def pinned_page(make: Maker) -> Item:
    """Build a sheet of paper on a wall at y = 0, pinned at the top, its lower edge curling off."""
    wide, high = PAGES_M[int(make.rng.integers(len(PAGES_M)))]
    down = np.linspace(0, 1, 7)
    y = -0.006 - make.rng.uniform(0.0, 0.05) * down**2
    sides = [np.stack([np.full(7, x), y, -high * down], axis=-1) for x in (-wide / 2, wide / 2)]
    return make.sheet(np.stack(sides, axis=1), materials.page(), 320)


def coat(make: Maker, color: Color) -> Item:
    """Build a coat on a hook: a folded sheet in front of a wall at y = 0, the hook at z = 0."""
    rng = make.rng
    down, across = np.meshgrid(np.linspace(0, 1, 19), np.linspace(-1, 1, 15), indexing="ij")
    half = 0.07 + 0.2 * np.sqrt(down) + 0.05 * down
    folds = np.sin(across * rng.uniform(7, 10) + rng.uniform(0, 6) + 1.5 * down)
    y = -0.05 - (0.12 * np.sqrt(down) + 0.03 * folds * down) * (1 - 0.85 * across**4)
    points = np.stack([half * across, y, -0.95 * down - 0.04 * across**2], axis=-1)
    return make.sheet(points, materials.fabric(color), 130)


def plant(make: Maker, height_m: float, pot: Color, leaves: int = 40) -> Item:
    """Build a pot plant: bent leaves around a stem.

    Args:
        make: Maker of shapes.
        height_m: Height of the stem with its pot, metres.
        pot: Colour of the pot.
        leaves: Number of leaves.
    """
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
