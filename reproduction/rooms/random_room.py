"""Rooms drawn from a seed, on which backbones are pretrained: no two alike, none of the paper's.

Size, walls, floor, what hangs and what stands in a room, its colours and its light are all random,
so that a backbone trained on several of them learns what rooms have in common.
"""

from __future__ import annotations

import colorsys
from typing import NamedTuple

import numpy as np

from reproduction.rooms import furniture, pictures
from reproduction.rooms.lighting import Lamp, Lighting, ambient_corners
from reproduction.rooms.scan import Scanner, stations
from synfeal.objects import materials
from synfeal.objects.canvas import Color, Painter
from synfeal.objects.patches import Item, Maker, joined, level, upright
from synfeal.records.provenance import generator_of

Generator = np.random.Generator
Size = tuple[float, float, float]
CELL_M = 0.1  # nobody compares these rooms with a scan, so they may be coarse
PX_PER_M = 60  # for images of 100 pixels: a pixel covers 1 cm at 1 m
GAP_M = (0.15, 0.6)  # between two things along a wall


class Wall(NamedTuple):
    """One wall: its left end as seen from inside, the way it runs, and how an item is turned."""

    start_m: tuple[float, float]
    along: tuple[float, float]
    length_m: float
    yaw_deg: float

    def place(self, item: Item, at_m: float, off_m: float, z_m: float = 0.0) -> Item:
        """Place an item at the wall, its front to the room.

        Args:
            item: Item with its back towards +y.
            at_m: Place of its origin along the wall, from the left end, metres.
            off_m: Distance of its origin from the wall, into the room, metres.
            z_m: Height of its origin, metres.
        """
        (x, y), (ax, ay) = self.start_m, self.along
        x, y = x + at_m * ax + off_m * ay, y + at_m * ay - off_m * ax
        return item.placed(x, y, z_m, self.yaw_deg)


def ingredients(seed: int) -> tuple[Generator, Item, Lighting, Scanner]:
    """Furnish a room of 12 to 50 square metres with its corner at the origin."""
    rng = generator_of("scene", "random_room", seed)
    size = (rng.uniform(3.4, 6.5), rng.uniform(3.6, 7.5), rng.uniform(2.4, 3.6))
    make, walls, lower = Maker(rng), _walls(size[0], size[1]), (0.0, 0.0, 0.0)
    shell, inner = _shell(make, size, walls), _free_standing(make, size)
    along = [thing for wall in walls for thing in _along(make, wall, size[2])]
    scanner = Scanner(CELL_M, stations(lower, size, (2, 2, 1)), lower, size)
    return rng, joined(shell, inner, along).clipped(lower, size), _lighting(rng, size), scanner


def _walls(x_m: float, y_m: float) -> tuple[Wall, ...]:
    return (
        Wall((0.0, y_m), (1.0, 0.0), x_m, 0.0),
        Wall((x_m, y_m), (0.0, -1.0), y_m, -90.0),
        Wall((x_m, 0.0), (-1.0, 0.0), x_m, 180.0),
        Wall((0.0, 0.0), (0.0, 1.0), y_m, 90.0),
    )


def _color(rng: Generator, least: float = 0.25, most: float = 0.95) -> Color:
    # Mostly pale, sometimes vivid, as rooms are.
    return colorsys.hsv_to_rgb(rng.random(), 0.85 * rng.random() ** 2, rng.uniform(least, most))


def _palette(rng: Generator, count: int) -> tuple[Color, ...]:
    return tuple(_color(rng) for _ in range(count))


def _surface(rng: Generator) -> Painter:
    """Draw the material of a wall, a floor or a ceiling."""
    palette, color, other = _palette(rng, int(rng.integers(1, 5))), _color(rng), _color(rng)
    blocks = (rng.uniform(0.1, 0.9), rng.uniform(0.06, 0.3))
    masonry = materials.masonry(palette, block_m=blocks, joint=_color(rng))
    choices: list[Painter] = [
        masonry,
        masonry,
        materials.plaster(color),
        materials.damask(color, motif=other, pitch_m=rng.uniform(0.15, 0.5)),
        materials.wood(color, contrast=rng.uniform(0.1, 0.3)),
        materials.marble(color, vein=other, scale_m=rng.uniform(0.2, 0.8)),
        materials.wainscot(color, lower=other, height_m=rng.uniform(0.5, 1.4)),
    ]
    return choices[int(rng.integers(len(choices)))]


def _shell(make: Maker, size: Size, walls: tuple[Wall, ...]) -> Item:
    x, y, z = size
    sheets = [level((0, x), (0, y), 0.0), level((0, x), (0, y), z, face_down=True)]
    for wall in walls:
        end = np.array(wall.start_m) + wall.length_m * np.array(wall.along)
        sheets.append(upright(wall.start_m, (end[0], end[1]), 0.0, z))
    return joined(make.sheet(sheet, _surface(make.rng), PX_PER_M) for sheet in sheets)


def _along(make: Maker, wall: Wall, high_m: float) -> list[Item]:
    """Place things along a wall and above it, from its left end to its right one."""
    rng, things = make.rng, list[Item]()
    at = rng.uniform(*GAP_M)
    while True:
        wide = rng.uniform(0.5, 1.6)
        if at + wide > wall.length_m - 0.1:
            return things
        middle = at + wide / 2
        if rng.random() < 0.45:
            item, deep, tall = _standing(make, wide)
            things.append(wall.place(item, middle, deep / 2 + 0.01))
        else:
            tall = 0.6
        room_m = high_m - tall - 0.3
        if room_m > 0.5 and rng.random() < 0.85:
            hung = rng.uniform(0.4, min(room_m, 1.4))
            z = tall + 0.15 + rng.uniform(hung / 2, room_m - hung / 2)
            painter = _picture(rng)
            glow = rng.uniform(0.4, 0.9) if rng.random() < 0.2 else 0.0
            hanging = make.on_wall((0, 0, 0), 0, (wide, hung), painter, 150, 0.03, glow)
            things.append(wall.place(hanging, middle, 0.0, z))
        at += wide + rng.uniform(*GAP_M)


def _picture(rng: Generator) -> Painter:
    choices: list[Painter] = [
        pictures.painting(_palette(rng, 4), frame=_color(rng)),
        pictures.poster(),
        pictures.whiteboard(),
        pictures.noticeboard(_color(rng)),
        pictures.window_view(panes=(int(rng.integers(1, 4)), int(rng.integers(1, 4)))),
        pictures.stained_glass(_palette(rng, 5), cells=60),
        pictures.mural(_color(rng), sky=_color(rng), figures=3),
        materials.door(_color(rng), window=bool(rng.random() < 0.5)),
        materials.screen(),
        materials.rug(_palette(rng, 4)),
    ]
    return choices[int(rng.integers(len(choices)))]


def _standing(make: Maker, wide_m: float) -> tuple[Item, float, float]:
    """Build something with its back to a wall; also return its depth and its height."""
    rng = make.rng
    deep, tall = rng.uniform(0.3, 0.6), rng.uniform(0.5, 2.1)
    cloth = materials.fabric(_color(rng), stripe=_color(rng))
    doors, rows = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    match int(rng.integers(4)):
        case 0:
            size = (wide_m, deep, tall)
            return furniture.cabinet(make, size, _color(rng), doors, rows), deep, tall
        case 1:
            shelves = max(2, round(tall / 0.4))
            return furniture.bookshelf(make, (wide_m, 0.3, tall), shelves), 0.3, tall
        case 2:
            return furniture.sofa(make, max(wide_m, 1.0), cloth), 0.8, 0.8
        case _:
            return furniture.plant(make, min(tall, 1.4), _color(rng), 30), 0.5, 1.4


def _free_standing(make: Maker, size: Size) -> Item:
    """Build rugs, tables with what lies on them, and chairs, away from the walls."""
    rng, things = make.rng, list[Item]()
    for _ in range(int(rng.integers(1, 4))):
        x, y = rng.uniform((1.1, 1.1), (size[0] - 1.1, size[1] - 1.1))
        yaw, tall = rng.uniform(0, 360), rng.uniform(0.4, 0.78)
        wide, deep = rng.uniform(0.7, 1.5), rng.uniform(0.6, 0.9)
        top = materials.wood(_color(rng), contrast=0.18)
        table = furniture.table(make, (wide, deep, tall), top, _color(rng))
        stuff = furniture.on_table(make, wide, deep).placed(0, 0, tall)
        seats = []
        for _ in range(int(rng.integers(0, 3))):
            seat = furniture.chair(make, _color(rng))
            at_x, at_y, turn = rng.uniform((-0.9, -0.9, 0), (0.9, 0.9, 360))
            seats.append(seat.placed(at_x, at_y, 0, turn))
        things.append(joined(table, stuff, seats).placed(x, y, 0, yaw))
    half = rng.uniform(0.6, 1.2, 2)
    x, y = rng.uniform((1.2, 1.2), (size[0] - 1.2, size[1] - 1.2))
    rug = materials.rug(_palette(rng, 4))
    spread = level((x - half[0], x + half[0]), (y - half[1], y + half[1]), 0.012)
    things.append(make.sheet(spread, rug, PX_PER_M))
    post = make.box((0.2, 0.2, size[2]), _surface(rng), PX_PER_M, "fblr")
    if rng.random() < 0.3:
        things.append(post.placed(*rng.uniform((1, 1), (size[0] - 1, size[1] - 1))))
    return joined(things)


def _lighting(rng: Generator, size: Size) -> Lighting:
    def scaled(share: float) -> Color:
        warm = rng.uniform(0.75, 1.25)
        return (share * warm, share, share * (2.0 - warm))

    lamps = []
    for _ in range(int(rng.integers(2, 6))):
        x, y = rng.uniform((0.5, 0.5), (size[0] - 0.5, size[1] - 0.5))
        lamps.append(Lamp((x, y, size[2] - 0.1), (0, 0, -1), scaled(rng.uniform(0.4, 1.4))))
    a, b, c, d = (scaled(rng.uniform(0.2, 0.55)) for _ in range(4))
    ambient = ambient_corners(a, b, c, d, top=rng.uniform(0.8, 1.3))
    return Lighting((0.0, 0.0, 0.0), size, ambient, lamps, None)
