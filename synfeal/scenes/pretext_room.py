"""A loft with a cut corner and a sloping ceiling, on which backbones are pretrained.

It shares neither shape nor colours with the two scenes of the paper.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes import fronts, furniture, materials, pictures
from synfeal.scenes.atlas import baked_mesh
from synfeal.scenes.canvas import Colour, Painter
from synfeal.scenes.lighting import Lamp, Lighting, Sun
from synfeal.scenes.patches import Item, joined, paint
from synfeal.scenes.primitives import box, bumpy, level, on_wall, sheet, tube, turned, upright
from synfeal.scenes.shell import shell_blocks
from synfeal.seeds import generator_of

Generator = np.random.Generator
SIDE_M = 5.0
PLAN_M = ((0.0, 0.0), (5.0, 0.0), (5.0, 3.7), (3.9, 5.0), (0.0, 5.0))  # counter-clockwise
LOW_M, HIGH_M = 2.3, 3.1  # ceiling at y = 0 and at y = 5
CELL_M = 0.09
PINE: Painter = partial(materials.wood, colour=(0.75, 0.5, 0.26), contrast=0.16)
WALNUT: Painter = partial(materials.wood, colour=(0.34, 0.2, 0.12), contrast=0.2)


def build(seed: int) -> TexturedMesh:
    """The loft; x, y 0 – 5 with one corner cut off, z 0 – 3.1 m."""
    rng = generator_of("scene", "pretext_room", seed)
    groups = {
        "shell": _shell(rng),
        "pictures": joined([_pictures(rng), _openings(rng)]),
        "furniture": joined([_kitchen(rng), _living(rng), _structure(rng)]),
    }
    blocks = [block for item in groups.values() for block in item.blocks]
    return baked_mesh({name: item.patches for name, item in groups.items()}, blocks, _lighting())


def ceiling_m(y_m: float) -> float:
    """Height of the sloping ceiling."""
    return LOW_M + (HIGH_M - LOW_M) * y_m / SIDE_M


def _lighting() -> Lighting:
    window = [Lamp((4.35 - s, 4.2 + s, 1.6), (-0.76, -0.65, 0), (1.3, 1.4, 1.5)) for s in (-0.3, 0.3)]
    floor_lamp = [Lamp((0.75, 4.4, 1.55), (0, 0, axis), (0.9, 0.6, 0.3)) for axis in (1, -1)]
    kitchen = [Lamp((0.4, y, 2.0), (0.3, 0, -0.95), (0.6, 0.58, 0.5)) for y in (1.2, 2.6)]
    pendant = [Lamp((2.4, 1.9, 2.2), (0, 0, -1), (0.9, 0.7, 0.42))]
    fire = [Lamp((2.9, 0.4, 0.4), (0, 0.95, 0.31), (0.9, 0.35, 0.1))]
    ambient = np.empty((2, 2, 2, 3), np.float32)
    ambient[0, 0], ambient[0, 1] = (0.3, 0.34, 0.4), (0.5, 0.36, 0.24)
    ambient[1, 0], ambient[1, 1] = (0.42, 0.3, 0.26), (0.44, 0.46, 0.46)
    ambient[:, :, 1] *= 1.2
    sun = Sun((-0.2, -0.75, -0.8), (1.2, 1.0, 0.7), (((1.6, 2.2, 2.7), (2.8, 3.6, 2.7)),))
    lower, upper = (0.0, 0.0, 0.0), (SIDE_M, SIDE_M, HIGH_M)
    lamps = [*window, *floor_lamp, *kitchen, *pendant, *fire]
    return Lighting(lower, upper, ambient, lamps, sun, shell_blocks(lower, upper))


def _shell(rng: Generator) -> Item:
    bricks = ((0.58, 0.24, 0.16), (0.66, 0.32, 0.2), (0.5, 0.2, 0.15), (0.7, 0.42, 0.3))
    azulejo = ((0.85, 0.88, 0.9), (0.3, 0.5, 0.75), (0.8, 0.84, 0.88), (0.15, 0.3, 0.55))
    boards = ((0.62, 0.42, 0.22), (0.7, 0.48, 0.26), (0.55, 0.36, 0.2))
    painters: tuple[Painter, ...] = (
        partial(materials.masonry, palette=bricks, block_m=(0.22, 0.075), joint_m=0.012, joint=(0.7, 0.66, 0.6)),
        partial(materials.damask, colour=(0.18, 0.34, 0.26), motif=(0.5, 0.55, 0.32)),
        partial(materials.plaster, colour=(0.88, 0.84, 0.72)),
        partial(materials.masonry, palette=boards, block_m=(2.0, 0.14), joint_m=0.006, joint=(0.2, 0.12, 0.06)),
        partial(materials.masonry, palette=azulejo, block_m=(0.15, 0.15), joint_m=0.006, stagger=0),
    )
    patches = []
    for index, painter in enumerate(painters):
        end, start = PLAN_M[index], PLAN_M[(index + 1) % len(PLAN_M)]
        points = upright(start, end, 0, ceiling_m(start[1]), CELL_M, ceiling_m(end[1]))
        patches.append(paint(rng, bumpy(rng, points, 0.008), painter, 130))
    floor = partial(
        materials.masonry, palette=((0.52, 0.33, 0.19), (0.6, 0.4, 0.24), (0.45, 0.28, 0.16)),
        block_m=(0.9, 0.11), joint_m=0.004, joint=(0.15, 0.1, 0.06), stagger=0.37,
    )  # fmt: skip
    ceiling = partial(materials.masonry, palette=((0.86, 0.82, 0.74), (0.9, 0.87, 0.8)), block_m=(5.0, 0.2), spread=0.03)
    for (x0, x1), (x2, x3), (y0, y1) in (((0, 5.0), (0, 5.0), (0, 3.7)), ((0, 5.0), (0, 3.9), (3.7, 5.0))):
        z0, z1 = ceiling_m(y0), ceiling_m(y1)
        ground = sheet([(x2, y1, 0), (x3, y1, 0), (x1, y0, 0), (x0, y0, 0)], CELL_M)
        roof = sheet([(x3, y1, z1), (x2, y1, z1), (x0, y0, z0), (x1, y0, z0)], CELL_M)
        patches.append(paint(rng, bumpy(rng, ground, 0.003), floor, 150))
        patches.append(paint(rng, bumpy(rng, roof, 0.008), ceiling, 100))
    return Item(tuple(patches))


def _pictures(rng: Generator) -> Item:
    """Paintings on the wallpaper, posters on brick and boards."""
    sea: tuple[Colour, ...] = ((0.1, 0.3, 0.6), (0.2, 0.6, 0.7), (0.85, 0.8, 0.6), (0.9, 0.45, 0.2))
    return joined([
        on_wall(rng, (5, 0.8, 1.6), -90, (0.9, 0.7), pictures.painting, 330, 0.04),
        on_wall(rng, (5, 2.0, 1.7), -90, (1.1, 1.0), partial(pictures.painting, palette=sea), 330, 0.04),
        on_wall(rng, (5, 3.1, 1.5), -90, (0.6, 0.9), pictures.painting, 330, 0.04),
        on_wall(rng, (1.2, 0, 1.5), 180, (0.7, 1.0), pictures.poster, 330),
        on_wall(rng, (4.3, 0, 1.6), 180, (0.6, 0.6), partial(pictures.painting, frame=(0.1, 0.1, 0.1)), 330),
        on_wall(rng, (1.9, 5, 1.9), 0, (1.3, 0.9), partial(pictures.painting, frame=(0.8, 0.8, 0.8)), 300, 0.04),
        on_wall(rng, (0, 4.1, 1.7), 90, (0.8, 0.6), pictures.noticeboard, 300),
    ])  # fmt: skip


def _openings(rng: Generator) -> Item:
    """The large window in the cut corner with curtains, the roof light and the door."""
    view = partial(pictures.window_view, panes=(3, 2))
    curtain = partial(materials.fabric, colour=(0.75, 0.2, 0.3), stripe=(0.5, 0.1, 0.2), pitch_m=0.06)
    drapes = [box(rng, (0.25, 0.08, 2.1), curtain, 130, "flr").placed(dx, -0.06, 0.25) for dx in (-0.72, 0.72)]
    bay = joined([on_wall(rng, (0, 0, 1.35), 0, (1.25, 1.6), view, 230, 0.03, 0.85), *drapes])
    z0, z1 = ceiling_m(2.2) - 0.02, ceiling_m(3.6) - 0.02
    light = sheet([(2.8, 3.6, z1), (1.6, 3.6, z1), (1.6, 2.2, z0), (2.8, 2.2, z0)])
    sky = partial(pictures.window_view, panes=(2, 3), blind=0.3)
    door = on_wall(rng, (3.4, 5, 1.05), 0, (0.9, 2.1), partial(fronts.door, colour=(0.85, 0.65, 0.15), window=True), 180, 0.04)
    return joined([bay.placed(4.45, 4.35, 0, -49.8), Item((paint(rng, light, sky, 180, 0.9),)), door])


def _kitchen(rng: Generator) -> Item:
    """Counters, wall cupboards and a fridge along x = 0."""
    units = [
        furniture.cabinet(rng, (0.8, 0.58, 0.86), colour, 2, rows).placed(0.3, y, 0, 90)
        for y, colour, rows in ((0.95, (0.2, 0.4, 0.5), 1), (1.75, (0.2, 0.4, 0.5), 3), (2.55, (0.85, 0.82, 0.75), 1))
    ]
    top = box(rng, (2.45, 0.62, 0.04), partial(materials.marble, colour=(0.3, 0.3, 0.32), vein=(0.8, 0.8, 0.8)), 180)
    stuff = furniture.clutter(rng, 2.2, 0.5).placed(0.3, 1.75, 0.9, 90)
    hanging = [
        furniture.cabinet(rng, (0.75, 0.32, 0.55), colour, 2).placed(0.17, y, 1.55, 90)
        for y, colour in ((1.0, (0.7, 0.3, 0.15)), (2.4, (0.85, 0.82, 0.75)))
    ]
    fridge = box(rng, (0.6, 0.58, 1.8), partial(fronts.cabinet_front, colour=(0.65, 0.68, 0.7), doors=1, rows=2), 140, "flrt")
    return joined([*units, top.placed(0.32, 1.75, 0.86, 90), stuff, *hanging, fridge.placed(0.31, 3.3, 0, 90)])


def _living(rng: Generator) -> Item:
    """Sofa and rug, dining table, bookcase, fireplace, plants and a lamp."""
    cloth = partial(materials.fabric, colour=(0.7, 0.62, 0.3), stripe=(0.45, 0.4, 0.2), pitch_m=0.12)
    weave = partial(materials.rug, palette=((0.6, 0.12, 0.12), (0.85, 0.75, 0.5), (0.12, 0.2, 0.4), (0.75, 0.45, 0.15)))
    chairs = [
        furniture.chair(rng, colour).placed(x, y, 0, yaw)
        for x, y, yaw, colour in ((2.0, 1.2, 170, (0.2, 0.5, 0.4)), (2.9, 2.6, 10, (0.7, 0.3, 0.1)), (3.5, 1.8, -80, (0.4, 0.2, 0.5)))
    ]
    dining = joined([furniture.table(rng, (1.3, 0.85, 0.75), WALNUT), furniture.clutter(rng, 1.1, 0.75).placed(0, 0, 0.75)])
    shade_cloth = partial(materials.fabric, colour=(0.95, 0.8, 0.55))
    pole = turned(rng, [(0.015, 1.4), (0.015, 0.03), (0.15, 0.03), (0.15, 0)], partial(materials.flat, colour=(0.1, 0.1, 0.1)), 70, 10, False)
    lamp = turned(rng, [(0.12, 1.75), (0.22, 1.4)], shade_cloth, 140, 14, casts=False)
    return joined([
        furniture.sofa(rng, 1.9, cloth).placed(4.5, 2.1, 0, -90),
        level_rug(rng, weave),
        dining.placed(2.45, 1.9),
        *chairs,
        furniture.bookshelf(rng, (1.0, 0.32, 1.9), 5).placed(1.0, 4.83),
        furniture.bookshelf(rng, (0.8, 0.3, 1.1), 3).placed(2.3, 4.84),
        joined([pole, lamp]).placed(0.35, 4.55),
        furniture.plant(rng, 1.3, (0.3, 0.35, 0.6), 46).placed(4.5, 0.5),
        furniture.plant(rng, 0.6, (0.85, 0.5, 0.2), 30).placed(3.85, 4.4),
    ])  # fmt: skip


def level_rug(rng: Generator, weave: Painter) -> Item:
    """A rug 1 cm above the floor boards."""
    return Item((paint(rng, level((2.4, 4.0), (2.9, 4.3), 0.012, 0.2), weave, 220),))


def _structure(rng: Generator) -> Item:
    """Fireplace, a post, beams under the slope and a red stove pipe."""
    stone = partial(materials.masonry, palette=((0.5, 0.5, 0.48), (0.6, 0.58, 0.52), (0.42, 0.42, 0.44)), block_m=(0.3, 0.18), joint_m=0.015)
    ember = partial(materials.marble, colour=(0.08, 0.05, 0.04), vein=(1.0, 0.45, 0.08), scale_m=0.2)
    hearth = box(rng, (1.2, 0.35, 1.1), stone, 190, "flrt").placed(2.9, 0.18, 0, 180)
    fire = on_wall(rng, (2.9, 0.355, 0.4), 180, (0.6, 0.55), ember, 200, 0.01, 0.8)
    mantel = box(rng, (1.4, 0.42, 0.07), WALNUT, 180).placed(2.9, 0.22, 1.1)
    chimney = box(rng, (0.6, 0.3, 1.18), stone, 160, "flr").placed(2.9, 0.16, 1.17, 180)
    post = box(rng, (0.18, 0.18, ceiling_m(3.2)), PINE, 170, "fblr").placed(1.45, 3.2)
    beams = [
        Item((tube(rng, [(x, y, ceiling_m(y) - 0.06) for y in (0.03, 2.5, 4.97)], 0.11, WALNUT, 100, 4),))
        for x in (0.8, 1.45, 3.0, 3.8)
    ]
    return joined([hearth, fire, mantel, chimney, post, *beams])
