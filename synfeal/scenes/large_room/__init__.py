"""The stand-in for the paper's *Large Room*: a laboratory of 5.0 × 6.6 × 2.71 m = 89.4 m³.

White, weakly textured walls and repeated desks, lamps and window bays, as in the original; posters,
boards, cabinets and light that differs from wall to wall make every pose decidable.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes import clutter, fronts, furniture, materials
from synfeal.scenes.bake import scanned_mesh
from synfeal.scenes.canvas import Colour, Painter
from synfeal.scenes.large_room.shell import (
    BEECH,
    HEIGHT_M,
    LENGTH_M,
    SILL_M,
    WHITE,
    WIDTH_M,
    WINDOW_M,
    WINDOWS_Y_M,
    boards,
    shell,
)
from synfeal.scenes.lighting import Lamp, Lighting, Sun, ambient_corners
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, box, joined, level, paint, tube, turned
from synfeal.scenes.scan import Scanner, stations
from synfeal.seeds import generator_of

LOWER_M, UPPER_M = (0.0, 0.0, 0.0), (WIDTH_M, LENGTH_M, HEIGHT_M)
CELL_M = 0.0456  # gives the paper's number of faces


def build(seed: int) -> TexturedMesh:
    """The laboratory; x 0 – 5 (windows at 0), y 0 – 6.6 (door at 0), z 0 – 2.71 m."""
    return scanned_mesh(*ingredients(seed))


def ingredients(seed: int) -> tuple[np.random.Generator, Item, Lighting, Scanner]:
    """What it is scanned from."""
    rng = generator_of("scene", "large_room", seed)
    everything = joined([shell(rng), boards(rng), contents(rng)])
    scanner = Scanner(CELL_M, stations(LOWER_M, UPPER_M, (2, 3, 1)), LOWER_M, UPPER_M)
    return rng, everything, _lighting(), scanner


def _lighting() -> Lighting:
    daylight = [
        Lamp((0.12, y + dy, z), (1, 0, 0), (0.5, 0.62, 0.78), "daylight")
        for y in WINDOWS_Y_M
        for dy in (-0.45, 0.45)
        for z in (1.3, 1.9)
    ]
    ceiling = [
        Lamp((x, y, HEIGHT_M - 0.1), (0, 0, -1), (0.62 * s, 0.53 * s, 0.4 * s))
        for (x, y), s in zip(LAMPS_M, LAMP_STRENGTHS, strict=True)
    ]
    # A different tint in every corner tells the corners apart even where there is no texture.
    ambient = ambient_corners(
        (0.46, 0.44, 0.47), (0.4, 0.5, 0.57), (0.6, 0.46, 0.35), (0.4, 0.47, 0.38), top=1.15
    )
    half = WINDOW_M[0] / 2
    openings = tuple(
        ((0.0, y - half, SILL_M), (0.0, y + half, SILL_M + WINDOW_M[1])) for y in WINDOWS_Y_M[1:]
    )
    sun = Sun((0.75, -0.42, -0.62), (2.0, 1.6, 1.0), openings)
    return Lighting(LOWER_M, UPPER_M, ambient, [*daylight, *ceiling], sun)


Generator = np.random.Generator
LAMPS_M = tuple((x, y) for x in (1.4, 3.6) for y in (1.2, 3.3, 5.4))
LAMP_STRENGTHS = (0.9, 0.5, 0.95, 0.8, 0.05, 0.7)  # the fifth is off
INNER_LOWER_M = (0.06, 0.01, 0.0)  # the windows stand 5 cm out of the west wall
INNER_UPPER_M = (WIDTH_M - 0.01, LENGTH_M - 0.01, HEIGHT_M)
BLUE: Colour = (0.15, 0.25, 0.55)
DESKS_M = (  # x, y, yaw in degrees
    (0.55, 2.3, 90),
    (0.55, 4.3, 90),
    (0.55, 5.7, 90),
    (4.6, 3.35, -90),
    (4.6, 4.85, -90),
    (1.9, 6.2, 0),
)
OAK: Painter = partial(materials.wood, colour=(0.72, 0.55, 0.36))
CONCRETE: Painter = partial(materials.plaster, colour=(0.5, 0.5, 0.48), grain=0.06)
HAZARD: Painter = partial(
    materials.masonry,
    palette=((0.95, 0.8, 0.1), (0.1, 0.1, 0.1)),
    block_m=(0.6, 0.1),
    joint_m=0.001,
)
DIFFUSER: Painter = partial(
    materials.masonry, palette=((1.0, 0.98, 0.92),), block_m=(0.3, 0.3), stagger=0, spread=0.02
)


def contents(rng: Generator) -> Item:
    """All things with volume; nothing sticks out of the room."""
    things = joined([_desks(rng), _storage(rng), _lamps(rng), _fittings(rng), _small_things(rng)])
    return things.clipped(INNER_LOWER_M, INNER_UPPER_M)


def _desks(rng: Generator) -> Item:
    """Equal desks with two equal screens and a chair each, and an island with one."""
    screen = furniture.monitor(rng)
    screens = [screen.placed(dx, 0.18, 0.74) for dx in (-0.32, 0.32)]
    desk = joined([furniture.table(rng, (1.4, 0.7, 0.74), BEECH), *screens])
    chair = furniture.chair(rng, BLUE)
    things = []
    for x, y, yaw in DESKS_M:
        stuff = clutter.on_table(rng, 1.2, 0.6).placed(0, 0, 0.74)
        seat = chair.placed(rng.uniform(-0.3, 0.3), -0.6, 0, 180 + rng.uniform(-50, 50))
        things.append(joined([desk, stuff, seat]).placed(x, y, 0, yaw))
    island = furniture.table(rng, (0.9, 1.9, 0.74), OAK)
    stuff = clutter.on_table(rng, 0.8, 1.7).placed(0, 0, 0.74)
    lone = screen.placed(0.1, 0.6, 0.74, 25)
    return joined([*things, joined([island, stuff, lone]).placed(2.55, 3.5)])


def _storage(rng: Generator) -> Item:
    """Cupboards, a bookcase, cartons, plants: large areas of one colour."""
    cabinet, east = furniture.cabinet, WIDTH_M - 0.23
    large = box(rng, (0.5, 0.4, 0.4), partial(fronts.label, colour=(0.65, 0.48, 0.3)), 200, "fblrt")
    small = box(
        rng, (0.38, 0.35, 0.3), partial(fronts.label, colour=(0.7, 0.55, 0.36)), 200, "fblrt"
    )
    bin_profile = [(0.11, 0.05), (0.14, 0.35), (0.15, 0.35), (0.11, 0.0)]
    waste = turned(rng, bin_profile, painted((0.1, 0.35, 0.3)), 100, 14)
    return joined(
        [
            cabinet(rng, (0.9, 0.45, 1.95), (0.82, 0.35, 0.08)).placed(east, 0.5, 0, -90),
            cabinet(rng, (1.0, 0.45, 1.2), (0.2, 0.45, 0.3), 2, 3).placed(east, 1.95, 0, -90),
            cabinet(rng, (0.9, 0.5, 0.95), (0.72, 0.12, 0.15), 1, 4).placed(4.05, 0.27, 0, 180),
            cabinet(rng, (0.6, 0.5, 1.85), (0.35, 0.37, 0.4), 1).placed(0.35, 0.27, 0, 180),
            furniture.bookshelf(rng, (1.1, 0.35, 2.05)).placed(3.95, LENGTH_M - 0.18),
            large.placed(4.72, 1.8, 1.2, -80),
            small.placed(4.77, 0.5, 1.95, -95),
            waste.placed(3.1, 6.3),
            clutter.plant(rng, 1.1, (0.6, 0.3, 0.2), 110).placed(4.75, 5.95),
            clutter.plant(rng, 0.5, (0.85, 0.85, 0.8), 60).placed(0.2, 3.3, 0.94),
        ]
    )


def _small_things(rng: Generator) -> Item:
    """Shelves with bottles, pinned sheets of paper, coats, files on cupboards, more plants."""
    sheets = [
        *((WIDTH_M, y, z, -90) for y, z in ((2.6, 1.95), (2.85, 1.5), (4.0, 1.95), (4.75, 2.05))),
        *((x, LENGTH_M, z, 0) for x, z in ((2.0, 2.3), (2.95, 1.5), (0.45, 1.35), (0.6, 2.3))),
        *((0.0, y, z, 90) for y, z in ((2.15, 1.95), (2.4, 1.5), (4.35, 1.9), (6.35, 1.6))),
        *((x, 0.0, z, 180) for x, z in ((2.2, 1.95), (0.72, 1.75), (2.1, 0.95))),
    ]
    files = partial(clutter.books, rng)
    plant = partial(clutter.plant, rng)
    return joined(
        [
            *(clutter.pinned_page(rng).placed(x, y, z, yaw) for x, y, z, yaw in sheets),
            clutter.wall_shelf(rng, 1.2, 11).placed(WIDTH_M, 4.85, 1.42, -90),
            clutter.wall_shelf(rng, 0.9, 8).placed(1.9, LENGTH_M, 1.25),
            clutter.coat(rng, (0.2, 0.22, 0.28)).placed(0.68, 0.0, 1.65, 180),
            clutter.coat(rng, (0.92, 0.92, 0.9)).placed(2.35, 0.0, 1.6, 180),
            files(0.9, 0.25, 0.3).placed(WIDTH_M - 0.2, 2.05, 1.2, -90),
            files(0.5, 0.25, 0.32).placed(0.35, 0.25, 1.85, 180),
            files(0.8, 0.28, 0.3).placed(2.55, 4.3, 0.74, 180),
            plant(0.55, (0.3, 0.35, 0.6), 70).placed(2.5, 2.75, 0.74),
            plant(0.5, (0.7, 0.4, 0.25), 60).placed(4.3, 0.35, 0.95),
            plant(0.6, (0.5, 0.5, 0.5), 70).placed(0.15, 1.0, 0.94),
        ]
    )


def _lamps(rng: Generator) -> Item:
    """Six ceiling lamps; a dark one looks dark."""
    z, things = HEIGHT_M - 0.06, []
    for (x, y), strength in zip(LAMPS_M, LAMP_STRENGTHS, strict=True):
        frame = box(rng, (0.3, 1.2, 0.06), painted(WHITE), 60, "fblr")
        panel = level((x - 0.15, x + 0.15), (y - 0.6, y + 0.6), z, face_down=True)
        shining = paint(rng, panel, DIFFUSER, 120, glow=0.95 if strength > 0.1 else 0.1)
        things += [frame.placed(x, y, z), Item((shining,))]
    return joined(things)


def _fittings(rng: Generator) -> Item:
    """A pillar, a red pipe, a cable tray with cables that hang from it."""
    z, y = HEIGHT_M, LENGTH_M
    pipe = [(4.7, at, z - 0.2) for at in (0, y / 2, y)]
    tray = box(rng, (0.2, y, 0.08), painted((0.3, 0.32, 0.35)), 60, "lru")
    cables = []
    for at, colour in ((2.2, (0.9, 0.8, 0.1)), (2.3, (0.1, 0.1, 0.1)), (4.35, (0.1, 0.3, 0.8))):
        sag = [(0.55, at, z - 0.28), (0.3, at + 0.04, 2.3), (0.04, at, 1.9), (0.04, at, 0.75)]
        cables.append(tube(rng, sag, 0.015, painted(colour), 60, 5))
    return joined(
        [
            Item((tube(rng, pipe, 0.07, painted((0.75, 0.15, 0.1)), 80, 10), *cables)),
            box(rng, (0.3, 0.3, z), CONCRETE, 200, "fblr").placed(1.55, 4.6),
            box(rng, (0.31, 0.31, 0.4), HAZARD, 200, "fblrt").placed(1.55, 4.6, 0.9),
            tray.placed(0.6, y / 2, z - 0.3),
        ]
    )
