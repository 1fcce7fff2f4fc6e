"""The stand-in for the paper's *Large Room*: a laboratory of 5.0 × 6.6 × 2.71 m = 89.4 m³.

White, weakly textured walls and repeated desks, lamps and window bays, as in the original; posters,
boards, cabinets and light that differs from wall to wall make every pose decidable.

x 0 – 5 (windows at 0), y 0 – 6.6 (door at 0), z 0 – 2.71 m.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from reproduction.rooms import furniture, pictures
from reproduction.rooms.lighting import Lamp, Lighting, Sun, ambient_corners
from reproduction.rooms.scan import Scanner, stations
from synfeal.objects import materials
from synfeal.objects.canvas import Canvas, Color, Pixels, mix
from synfeal.objects.materials import painted
from synfeal.objects.patches import Item, Maker, joined, level, upright
from synfeal.records.provenance import generator_of

WIDTH_M, LENGTH_M = 5.0, 6.6
HEIGHT_M = 89.4 / (WIDTH_M * LENGTH_M)  # the volume the paper prints
LOWER_M, UPPER_M = (0.0, 0.0, 0.0), (WIDTH_M, LENGTH_M, HEIGHT_M)
INNER_LOWER_M = (0.06, 0.01, 0.0)  # the windows stand 5 cm out of the west wall
INNER_UPPER_M = (WIDTH_M - 0.01, LENGTH_M - 0.01, HEIGHT_M)
CELL_M = 0.0456  # gives the paper's number of faces
WINDOWS_Y_M = (1.25, 3.3, 5.35)  # centres of the bays in the west wall
WINDOW_M, SILL_M = (1.5, 1.25), 0.95
LAMPS_M = tuple((x, y) for x in (1.4, 3.6) for y in (1.2, 3.3, 5.4))
LAMP_STRENGTHS = (0.9, 0.5, 0.95, 0.8, 0.05, 0.7)  # the fifth is off

WHITE: Color = (0.9, 0.9, 0.88)
BEECH = materials.wood((0.8, 0.68, 0.5), contrast=0.08)
OAK = materials.wood((0.72, 0.55, 0.36))
CONCRETE = materials.plaster((0.5, 0.5, 0.48), grain=0.06)
RIBS = materials.masonry(((0.86, 0.86, 0.84),), block_m=(0.06, 1.0), joint_m=0.012)
HAZARD = materials.masonry(((0.95, 0.8, 0.1), (0.1, 0.1, 0.1)), block_m=(0.6, 0.1), joint_m=0.001)
DIFFUSER = materials.masonry(((1.0, 0.98, 0.92),), block_m=(0.3, 0.3), stagger=0, spread=0.02)

WALLS = (  # left and right end, colour, and that of the band below
    ((WIDTH_M, 0), (0, 0), (0.9, 0.86, 0.78), (0.75, 0.62, 0.45)),
    ((0, LENGTH_M), (WIDTH_M, LENGTH_M), (0.82, 0.88, 0.89), (0.25, 0.5, 0.52)),
    ((WIDTH_M, LENGTH_M), (WIDTH_M, 0), WHITE, (0.7, 0.7, 0.66)),
    ((0, 0), (0, LENGTH_M), (0.86, 0.87, 0.9), (0.5, 0.56, 0.68)),
)
BOARDS = (  # where, yaw in degrees, size: posters on the east wall, boards on the north wall
    ((WIDTH_M, 1.15, 1.75), -90, (0.6, 0.85), pictures.poster()),
    ((WIDTH_M, 3.35, 1.8), -90, (0.85, 1.15), pictures.poster()),
    ((WIDTH_M, 4.35, 1.75), -90, (0.6, 0.8), pictures.poster()),
    ((WIDTH_M, 5.1, 1.9), -90, (0.55, 0.4), pictures.poster()),
    ((1.2, LENGTH_M, 1.65), 0, (1.3, 0.95), pictures.noticeboard()),
    ((2.45, LENGTH_M, 1.7), 0, (0.7, 1.0), pictures.poster((0.1, 0.4, 0.75))),
    ((0.3, LENGTH_M, 1.8), 0, (0.35, 0.5), pictures.poster()),
    ((3.15, LENGTH_M, 2.15), 0, (0.36, 0.36), pictures.poster()),
)
DESKS_M = (  # x, y, yaw in degrees
    (0.55, 2.3, 90), (0.55, 4.3, 90), (0.55, 5.7, 90),
    (4.6, 3.35, -90), (4.6, 4.85, -90), (1.9, 6.2, 0),
)  # fmt: skip
PAGES_M = (  # x, y, z, yaw in degrees
    *((WIDTH_M, y, z, -90) for y, z in ((2.6, 1.95), (2.85, 1.5), (4.0, 1.95), (4.75, 2.05))),
    *((x, LENGTH_M, z, 0) for x, z in ((2.0, 2.3), (2.95, 1.5), (0.45, 1.35), (0.6, 2.3))),
    *((0.0, y, z, 90) for y, z in ((2.15, 1.95), (2.4, 1.5), (4.35, 1.9), (6.35, 1.6))),
    *((x, 0.0, z, 180) for x, z in ((2.2, 1.95), (0.72, 1.75), (2.1, 0.95))),
)
CABLES = ((2.2, (0.9, 0.8, 0.1)), (2.3, (0.1, 0.1, 0.1)), (4.35, (0.1, 0.3, 0.8)))
EXTINGUISHER_M = [(0.02, 0.55), (0.03, 0.5), (0.08, 0.45), (0.08, 0.0)]
BIN_M = [(0.11, 0.05), (0.14, 0.35), (0.15, 0.35), (0.11, 0.0)]


def ingredients(seed: int) -> tuple[np.random.Generator, Item, Lighting, Scanner]:
    """Build surfaces and objects to scan; nothing that has a volume sticks out of the room."""
    rng = generator_of("scene", "large_room", seed)
    make = Maker(rng)
    boards = (make.on_wall(*board, 320) for board in BOARDS)
    flat = joined(_shell(make), _windows(make), _south_wall(make), boards)
    parts = (_desks, _storage, _lamps, _fittings, _small_things)
    inside = joined(part(make) for part in parts).clipped(INNER_LOWER_M, INNER_UPPER_M)
    scanner = Scanner(CELL_M, stations(LOWER_M, UPPER_M, (2, 3, 1)), LOWER_M, UPPER_M)
    return rng, joined(flat, inside), _lighting(), scanner


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
    half, top = WINDOW_M[0] / 2, SILL_M + WINDOW_M[1]
    openings = tuple(((0.0, y - half, SILL_M), (0.0, y + half, top)) for y in WINDOWS_Y_M[1:])
    sun = Sun((0.75, -0.42, -0.62), (2.0, 1.6, 1.0), openings)
    return Lighting(LOWER_M, UPPER_M, ambient, [*daylight, *ceiling], sun)


def _shell(make: Maker) -> Item:
    """Build four nearly white walls, each with its own band of colour, floor and ceiling."""
    x, y, z = UPPER_M
    wall = partial(materials.wainscot, grain=0.003, stains=0.006)
    return joined(
        *(
            make.sheet(upright(start, end, 0, z), wall(color, lower), 125)
            for start, end, color, lower in WALLS
        ),
        make.sheet(level((0, x), (0, y), 0), _floor, 180),
        make.sheet(level((0, x), (0, y), z, face_down=True), _ceiling, 100),
    )


def _floor(canvas: Canvas) -> Pixels:
    """Paint grey linoleum, a lane of blue, tape markings and a door mat."""
    image = materials.plaster((0.58, 0.57, 0.54), 0.03, 0.012)(canvas)
    x, y = canvas.coordinates_m()
    y = canvas.size_m[1] - y  # image rows run towards −y
    lane = (x > 3.1) & (y > 2.2)
    blue = materials.plaster((0.28, 0.38, 0.5), 0.03, 0.012)(canvas)
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
    """Paint white mineral tiles, all alike, with a water stain; x and y run against the world's."""
    x, y = canvas.coordinates_m()
    tiles = materials.plaster((0.84, 0.84, 0.81), 0.006, 0.004)(canvas)
    joint = np.minimum(np.abs((x + 0.3) % 0.6 - 0.3), np.abs((y + 0.3) % 0.6 - 0.3)) < 0.005
    tiles[joint] *= np.float32(0.82)
    ragged = 1 + 0.25 * canvas.noise(0.3, 3)
    stain = np.exp(-((np.hypot(x - 1.3, y - 4.9) / 0.5 / np.maximum(ragged, 0.3)) ** 2))
    rust = tiles * np.asarray((0.75, 0.6, 0.4), np.float32)
    return mix(tiles, rust, stain.astype(np.float32))


def _windows(make: Maker) -> Item:
    """Build three equal bays in the west wall: view, sill and radiator."""
    view, middle = pictures.window_view(blind=0.25), (0.0, 0.0, SILL_M + WINDOW_M[1] / 2)
    sill = make.box((WINDOW_M[0] + 0.2, 0.2, 0.04), BEECH, 120).placed(0.1, 0, SILL_M - 0.05, 90)
    outside = make.on_wall(middle, 90, WINDOW_M, view, 230, depth_m=0.05, glow=0.85)
    radiator = make.box((1.2, 0.1, 0.5), RIBS, 100, "flrt").placed(0.08, 0, 0.2, 90)
    bay = joined(outside, sill, radiator)
    return joined(bay.placed(0, y) for y in WINDOWS_Y_M)


def _south_wall(make: Maker) -> Item:
    """Build door with exit sign, whiteboard, notice and extinguisher."""
    door, sign = materials.door((0.15, 0.3, 0.6), window=True), materials.label((0.1, 0.6, 0.25))
    extinguisher = make.turned(EXTINGUISHER_M, painted((0.8, 0.08, 0.06)), 150, 12)
    return joined(
        make.on_wall((1.3, 0, 1.05), 180, (1.0, 2.1), door, 180, 0.04),
        make.on_wall((3.4, 0, 1.55), 180, (2.2, 1.15), pictures.whiteboard(), 280, 0.03),
        make.on_wall((2.1, 0, 1.25), 180, (0.12, 0.16), materials.page(), 250),
        make.on_wall((1.3, 0, 2.36), 180, (0.6, 0.22), sign, 300, 0.03, glow=0.6),
        extinguisher.placed(2.12, 0.12, 0.5),
    )


def _desks(make: Maker) -> Item:
    """Build equal desks with two equal screens and a chair each, and a table with one screen."""
    rng, screen = make.rng, furniture.monitor(make)
    screens = [screen.placed(dx, 0.18, 0.74) for dx in (-0.32, 0.32)]
    desk = joined(furniture.table(make, (1.4, 0.7, 0.74), BEECH), screens)
    chair = furniture.chair(make, (0.15, 0.25, 0.55))
    things = []
    for x, y, yaw in DESKS_M:
        stuff = furniture.on_table(make, 1.2, 0.6).placed(0, 0, 0.74)
        seat = chair.placed(rng.uniform(-0.3, 0.3), -0.6, 0, 180 + rng.uniform(-50, 50))
        things.append(joined(desk, stuff, seat).placed(x, y, 0, yaw))
    table = furniture.table(make, (0.9, 1.9, 0.74), OAK)
    stuff = furniture.on_table(make, 0.8, 1.7).placed(0, 0, 0.74)
    island = joined(table, stuff, screen.placed(0.1, 0.6, 0.74, 25))
    return joined(things, island.placed(2.55, 3.5))


def _storage(make: Maker) -> Item:
    """Build cupboards, a bookcase, cartons, plants: large areas of one colour."""
    cabinet, plant = partial(furniture.cabinet, make), partial(furniture.plant, make)
    east = WIDTH_M - 0.23
    large = make.box((0.5, 0.4, 0.4), materials.label((0.65, 0.48, 0.3)), 200, "fblrt")
    small = make.box((0.38, 0.35, 0.3), materials.label((0.7, 0.55, 0.36)), 200, "fblrt")
    waste = make.turned(BIN_M, painted((0.1, 0.35, 0.3)), 100, 14)
    return joined(
        cabinet((0.9, 0.45, 1.95), (0.82, 0.35, 0.08)).placed(east, 0.5, 0, -90),
        cabinet((1.0, 0.45, 1.2), (0.2, 0.45, 0.3), 2, 3).placed(east, 1.95, 0, -90),
        cabinet((0.9, 0.5, 0.95), (0.72, 0.12, 0.15), 1, 4).placed(4.05, 0.27, 0, 180),
        cabinet((0.6, 0.5, 1.85), (0.35, 0.37, 0.4), 1).placed(0.35, 0.27, 0, 180),
        furniture.bookshelf(make, (1.1, 0.35, 2.05)).placed(3.95, LENGTH_M - 0.18),
        large.placed(4.72, 1.8, 1.2, -80),
        small.placed(4.77, 0.5, 1.95, -95),
        waste.placed(3.1, 6.3),
        plant(1.1, (0.6, 0.3, 0.2), 110).placed(4.75, 5.95),
        plant(0.5, (0.85, 0.85, 0.8), 60).placed(0.2, 3.3, 0.94),
    )


def _lamps(make: Maker) -> Item:
    """Build six ceiling lamps; a dark one looks dark."""
    z, things = HEIGHT_M - 0.06, []
    for (x, y), strength in zip(LAMPS_M, LAMP_STRENGTHS, strict=True):
        frame = make.box((0.3, 1.2, 0.06), painted(WHITE), 60, "fblr")
        panel = level((x - 0.15, x + 0.15), (y - 0.6, y + 0.6), z, face_down=True)
        shining = make.sheet(panel, DIFFUSER, 120, glow=0.95 if strength > 0.1 else 0.1)
        things += [frame.placed(x, y, z), shining]
    return joined(things)


def _fittings(make: Maker) -> Item:
    """Build a pillar, a red pipe, a cable tray with cables that hang from it."""
    y, z = LENGTH_M, HEIGHT_M
    tray = make.box((0.2, y, 0.08), painted((0.3, 0.32, 0.35)), 60, "lru")
    cables = []
    for at, color in CABLES:
        sag = [(0.55, at, z - 0.28), (0.3, at + 0.04, 2.3), (0.04, at, 1.9), (0.04, at, 0.75)]
        cables.append(make.tube(sag, 0.015, painted(color), 60, 5))
    pipe = [(4.7, at, z - 0.2) for at in (0, y / 2, y)]
    return joined(
        make.tube(pipe, 0.07, painted((0.75, 0.15, 0.1)), 80, 10),
        cables,
        make.box((0.3, 0.3, z), CONCRETE, 200, "fblr").placed(1.55, 4.6),
        make.box((0.31, 0.31, 0.4), HAZARD, 200, "fblrt").placed(1.55, 4.6, 0.9),
        tray.placed(0.6, y / 2, z - 0.3),
    )


def _small_things(make: Maker) -> Item:
    """Build shelves of bottles, pinned sheets of paper, coats, files on cupboards, more plants."""
    files, plant = partial(furniture.books, make), partial(furniture.plant, make)
    return joined(
        *(furniture.pinned_page(make).placed(x, y, z, yaw) for x, y, z, yaw in PAGES_M),
        furniture.wall_shelf(make, 1.2, 11).placed(WIDTH_M, 4.85, 1.42, -90),
        furniture.wall_shelf(make, 0.9, 8).placed(1.9, LENGTH_M, 1.25),
        furniture.coat(make, (0.2, 0.22, 0.28)).placed(0.68, 0.0, 1.65, 180),
        furniture.coat(make, (0.92, 0.92, 0.9)).placed(2.35, 0.0, 1.6, 180),
        files(0.9, 0.25, 0.3).placed(WIDTH_M - 0.2, 2.05, 1.2, -90),
        files(0.5, 0.25, 0.32).placed(0.35, 0.25, 1.85, 180),
        files(0.8, 0.28, 0.3).placed(2.55, 4.3, 0.74, 180),
        plant(0.55, (0.3, 0.35, 0.6), 70).placed(2.5, 2.75, 0.74),
        plant(0.5, (0.7, 0.4, 0.25), 60).placed(4.3, 0.35, 0.95),
        plant(0.6, (0.5, 0.5, 0.5), 70).placed(0.15, 1.0, 0.94),
    )
