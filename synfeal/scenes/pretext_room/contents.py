"""What hangs and stands in the loft."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import clutter, fronts, furniture, materials, pictures
from synfeal.scenes.canvas import Colour, Painter
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, joined, paint
from synfeal.scenes.pretext_room.shell import SIDE_M, ceiling_m
from synfeal.scenes.primitives import box, level, on_wall, sheet, tube, turned

Generator = np.random.Generator
SKYLIGHT_X_M, SKYLIGHT_Y_M = (1.6, 2.8), (2.2, 3.6)
PINE: Painter = partial(materials.wood, colour=(0.75, 0.5, 0.26), contrast=0.16)
WALNUT: Painter = partial(materials.wood, colour=(0.34, 0.2, 0.12), contrast=0.2)
GRANITE: Painter = partial(materials.marble, colour=(0.3, 0.3, 0.32), vein=(0.8, 0.8, 0.8))
EMBERS: Painter = partial(
    materials.marble, colour=(0.08, 0.05, 0.04), vein=(1.0, 0.45, 0.08), scale_m=0.2
)
FIELDSTONE: Painter = partial(
    materials.masonry,
    palette=((0.5, 0.5, 0.48), (0.6, 0.58, 0.52), (0.42, 0.42, 0.44)),
    block_m=(0.3, 0.18),
    joint_m=0.015,
)
CURTAIN: Painter = partial(
    materials.fabric, colour=(0.75, 0.2, 0.3), stripe=(0.5, 0.1, 0.2), pitch_m=0.06
)
TICKING: Painter = partial(
    materials.fabric, colour=(0.7, 0.62, 0.3), stripe=(0.45, 0.4, 0.2), pitch_m=0.12
)
KILIM: Painter = partial(
    materials.rug,
    palette=((0.6, 0.12, 0.12), (0.85, 0.75, 0.5), (0.12, 0.2, 0.4), (0.75, 0.45, 0.15)),
)
SEA: Painter = partial(
    pictures.painting,
    palette=((0.1, 0.3, 0.6), (0.2, 0.6, 0.7), (0.85, 0.8, 0.6), (0.9, 0.45, 0.2)),
)
PICTURES: tuple[tuple[float, float, float, float, float, float, Painter], ...] = (
    # x, y, z of the centre, yaw in degrees, width, height
    (5, 0.8, 1.6, -90, 0.9, 0.7, pictures.painting),
    (5, 2.0, 1.7, -90, 1.1, 1.0, SEA),
    (5, 3.1, 1.5, -90, 0.6, 0.9, pictures.painting),
    (1.2, 0, 1.5, 180, 0.7, 1.0, pictures.poster),
    (4.3, 0, 1.6, 180, 0.6, 0.6, partial(pictures.painting, frame=(0.1, 0.1, 0.1))),
    (1.9, 5, 1.9, 0, 1.3, 0.9, partial(pictures.painting, frame=(0.8, 0.8, 0.8))),
    (0, 4.1, 1.7, 90, 0.8, 0.6, pictures.noticeboard),
)
CHAIRS: tuple[tuple[float, float, float, Colour], ...] = (  # x, y, yaw in degrees, colour
    (2.0, 1.2, 170, (0.2, 0.5, 0.4)),
    (2.9, 2.6, 10, (0.7, 0.3, 0.1)),
    (3.5, 1.8, -80, (0.4, 0.2, 0.5)),
)


def wall_hangings(rng: Generator) -> Item:
    """Paintings, the large window in the cut corner, the roof light and the door."""
    hung = [
        on_wall(rng, (x, y, z), yaw, (width, height), painter, 320, 0.04)
        for x, y, z, yaw, width, height, painter in PICTURES
    ]
    view = partial(pictures.window_view, panes=(3, 2))
    window = on_wall(rng, (0, 0, 1.35), 0, (1.25, 1.6), view, 230, 0.03, glow=0.85)
    drapes = [
        box(rng, (0.25, 0.08, 2.1), CURTAIN, 130, "flr").placed(x, -0.06, 0.25)
        for x in (-0.72, 0.72)
    ]
    bay = joined([window, *drapes]).placed(4.45, 4.35, 0, -49.8)
    leaf = partial(fronts.door, colour=(0.85, 0.65, 0.15), window=True)
    door = on_wall(rng, (3.4, SIDE_M, 1.05), 0, (0.9, 2.1), leaf, 180, 0.04)
    return joined([*hung, bay, _skylight(rng), door])


def _skylight(rng: Generator) -> Item:
    (x0, x1), (y0, y1) = SKYLIGHT_X_M, SKYLIGHT_Y_M
    low, high = ceiling_m(y0) - 0.02, ceiling_m(y1) - 0.02
    pane = sheet([(x1, y1, high), (x0, y1, high), (x0, y0, low), (x1, y0, low)])
    sky = partial(pictures.window_view, panes=(2, 3), blind=0.3, skyline=False)
    return Item((paint(rng, pane, sky, 180, glow=0.9),))


def kitchen(rng: Generator) -> Item:
    """Counters, wall cupboards and a fridge along x = 0."""
    teal, cream, rust = (0.2, 0.4, 0.5), (0.85, 0.82, 0.75), (0.7, 0.3, 0.15)
    unit, hanging = (0.8, 0.58, 0.86), (0.75, 0.32, 0.55)
    steel = partial(fronts.cabinet_front, colour=(0.65, 0.68, 0.7), doors=1, rows=2)
    return joined(
        [
            furniture.cabinet(rng, unit, teal, 2, 1).placed(0.3, 0.95, 0, 90),
            furniture.cabinet(rng, unit, teal, 2, 3).placed(0.3, 1.75, 0, 90),
            furniture.cabinet(rng, unit, cream, 2, 1).placed(0.3, 2.55, 0, 90),
            furniture.cabinet(rng, hanging, rust).placed(0.17, 1.0, 1.55, 90),
            furniture.cabinet(rng, hanging, cream).placed(0.17, 2.4, 1.55, 90),
            box(rng, (2.45, 0.62, 0.04), GRANITE, 180).placed(0.32, 1.75, 0.86, 90),
            clutter.on_table(rng, 2.2, 0.5).placed(0.3, 1.75, 0.9, 90),
            box(rng, (0.6, 0.58, 1.8), steel, 140, "flrt").placed(0.31, 3.3, 0, 90),
        ]
    )


def living(rng: Generator) -> Item:
    """Sofa and rug, dining table, bookcases, plants and a lamp."""
    chairs = [furniture.chair(rng, colour).placed(x, y, 0, yaw) for x, y, yaw, colour in CHAIRS]
    dining = [
        furniture.table(rng, (1.3, 0.85, 0.75), WALNUT).placed(2.45, 1.9),
        clutter.on_table(rng, 1.1, 0.75).placed(2.45, 1.9, 0.75),
    ]
    return joined(
        [
            *chairs,
            *dining,
            Item((paint(rng, level((2.4, 4.0), (2.9, 4.3), 0.012), KILIM, 220),)),
            furniture.sofa(rng, 1.9, TICKING).placed(4.5, 2.1, 0, -90),
            furniture.bookshelf(rng, (1.0, 0.32, 1.9), 5).placed(1.0, 4.83),
            furniture.bookshelf(rng, (0.8, 0.3, 1.1), 3).placed(2.3, 4.84),
            _floor_lamp(rng).placed(0.35, 4.55),
            clutter.plant(rng, 1.3, (0.3, 0.35, 0.6), 46).placed(4.5, 0.5),
            clutter.plant(rng, 0.6, (0.85, 0.5, 0.2), 30).placed(3.85, 4.4),
        ]
    )


def _floor_lamp(rng: Generator) -> Item:
    foot = [(0.015, 1.4), (0.015, 0.03), (0.15, 0.03), (0.15, 0)]
    cloth = partial(materials.fabric, colour=(0.95, 0.8, 0.55))
    return joined(
        [
            turned(rng, foot, painted((0.1, 0.1, 0.1)), 70, 10),
            turned(rng, [(0.12, 1.75), (0.22, 1.4)], cloth, 140, 14),
        ]
    )


def structure(rng: Generator) -> Item:
    """Fireplace with chimney, a post, beams under the slope."""
    beams = []
    for x in (0.8, 1.45, 3.0, 3.8):
        path = [(x, y, ceiling_m(y) - 0.13) for y in (0.03, SIDE_M / 2, SIDE_M - 0.03)]
        beams.append(tube(rng, path, 0.11, WALNUT, 100, 4))
    post = box(rng, (0.18, 0.18, ceiling_m(3.2)), PINE, 170, "fblr").placed(1.45, 3.2)
    return joined(
        [
            Item(tuple(beams)),
            post,
            box(rng, (1.2, 0.35, 1.1), FIELDSTONE, 190, "flrt").placed(2.9, 0.18, 0, 180),
            on_wall(rng, (2.9, 0.355, 0.4), 180, (0.6, 0.55), EMBERS, 200, 0.01, glow=0.8),
            box(rng, (1.4, 0.42, 0.07), WALNUT, 180).placed(2.9, 0.22, 1.1),
            box(rng, (0.6, 0.3, 1.18), FIELDSTONE, 160, "flr").placed(2.9, 0.16, 1.17, 180),
        ]
    )
