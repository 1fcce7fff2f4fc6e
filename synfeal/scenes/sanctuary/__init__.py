"""The stand-in for the paper's *Sanctuary*: a vaulted nave of 5.5 × 8.5 × 3.92 m = 183.18 m³.

Painted vault and walls, columns, pews, a gilded altar piece: rich in texture, and large.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes import clutter, fronts, furniture, materials, murals
from synfeal.scenes.bake import scanned_mesh
from synfeal.scenes.canvas import Colour, Painter
from synfeal.scenes.lighting import Lamp, Lighting, Sun, ambient_corners
from synfeal.scenes.materials import painted
from synfeal.scenes.patches import Item, box, joined, on_wall, tube, turned
from synfeal.scenes.sanctuary.shell import (
    BAYS_Y_M,
    COLUMNS_Y_M,
    CROWN_M,
    HALF_X_M,
    HALF_Y_M,
    RIBS_Y_M,
    ROSE,
    STONE,
    arc,
    portal_wall,
    side_walls,
    vault_and_floor,
    walls,
)
from synfeal.scenes.scan import Scanner, stations
from synfeal.seeds import generator_of

LOWER_M, UPPER_M = (-HALF_X_M, -HALF_Y_M, 0.0), (HALF_X_M, HALF_Y_M, CROWN_M)
CELL_M = 0.0399  # gives the paper's number of faces


def build(seed: int) -> TexturedMesh:
    """The nave; altar at y = +4.25, portal at y = −4.25, x ±2.75, z 0 – 3.92 m."""
    return scanned_mesh(*ingredients(seed))


def ingredients(seed: int) -> tuple[np.random.Generator, Item, Lighting, Scanner]:
    """What it is scanned from."""
    rng = generator_of("scene", "sanctuary", seed)
    fabric = [walls(rng), vault_and_floor(rng), side_walls(rng), portal_wall(rng)]
    everything = joined([*fabric, altar(rng), furnishing(rng)])
    scanner = Scanner(CELL_M, stations(LOWER_M, UPPER_M, (2, 3, 2)), LOWER_M, UPPER_M)
    return rng, everything, _lighting(), scanner


def _lighting() -> Lighting:
    x, y, z = CHANDELIER_M
    lamps = [
        *(Lamp((side, 3.1, 1.9), (0, 0, -1), (0.35, 0.24, 0.1)) for side in (-0.9, 0.9)),
        Lamp((0, 1.6, 2.6), (0, 0.94, -0.34), (1.5, 1.15, 0.65)),
        *(
            Lamp((-HALF_X_M + 0.15, bay, 1.9), (1, 0, 0), (0.9, 1.05, 1.2), "daylight")
            for bay in BAYS_Y_M[:2]
        ),
        Lamp((0, -HALF_Y_M + 0.15, 3.1), (0, 0.95, -0.31), (0.6, 0.7, 1.1), "daylight"),
        Lamp((x, y, z), (0, 0, 1), (0.32, 0.26, 0.17)),
        Lamp((x, y, z), (0, 0, -1), (0.72, 0.6, 0.4)),
    ]
    ambient = ambient_corners(
        (0.36, 0.48, 0.66), (0.55, 0.47, 0.32), (0.55, 0.42, 0.42), (0.68, 0.48, 0.26), top=1.25
    )
    openings = tuple(
        ((-HALF_X_M, bay - 0.5, 1.05), (-HALF_X_M, bay + 0.5, 2.45)) for bay in BAYS_Y_M[:2]
    )
    sun = Sun((0.8, 0.3, -0.42), (1.8, 1.4, 0.8), openings)
    return Lighting(LOWER_M, UPPER_M, ambient, lamps, sun)


Generator = np.random.Generator
COLUMN_X_M = 1.8
CHANDELIER_M = (0.0, -0.3, 2.85)
GREEN_MARBLE: Painter = partial(materials.marble, colour=(0.3, 0.42, 0.36), vein=(0.75, 0.78, 0.7))
BLUE_MARBLE: Painter = partial(materials.marble, colour=(0.28, 0.3, 0.4), vein=(0.7, 0.7, 0.75))
CLOTH: Painter = partial(materials.fabric, colour=(0.9, 0.88, 0.8), stripe=(0.75, 0.6, 0.2))
FRIEZE: Painter = partial(
    materials.masonry, palette=murals.ROBES, block_m=(0.25, 0.11), joint=murals.GOLD, joint_m=0.02
)
SHAFT = (
    (0.2, 2.6), (0.2, 2.5), (0.13, 2.4), (0.125, 1.8), (0.13, 1.1), (0.135, 0.35), (0.19, 0.25),
    (0.21, 0),
)  # fmt: skip
SLENDER = (
    (0.12, 2.75), (0.12, 2.68), (0.07, 2.6), (0.085, 1.7), (0.07, 0.95), (0.12, 0.85), (0.12, 0.3),
)  # fmt: skip
FIGURE = (
    (0.01, 1.08), (0.07, 1.04), (0.08, 0.96), (0.05, 0.9), (0.16, 0.84), (0.17, 0.7), (0.13, 0.5),
    (0.2, 0),
)  # fmt: skip
PANELS: tuple[tuple[float, float, tuple[float, float], Colour, Colour, int], ...] = (
    (-1.05, 1.75, (0.75, 1.7), (0.5, 0.15, 0.15), (0.8, 0.6, 0.3), 1),
    (0.0, 1.95, (1.05, 1.9), (0.1, 0.2, 0.45), (0.55, 0.75, 0.95), 3),
    (1.05, 1.75, (0.75, 1.7), (0.15, 0.35, 0.2), (0.9, 0.8, 0.5), 1),
    (0.0, 3.3, (0.9, 0.55), (0.7, 0.5, 0.2), (0.95, 0.85, 0.5), 1),
)


def altar(rng: Generator) -> Item:
    """Steps, table, candles and a gilded altar piece with painted panels."""
    slender = partial(turned, rng, SLENDER, fronts.gilded, 130, 12)
    candle = partial(turned, rng, ((0.006, 0.36), (0.02, 0.32), (0.02, 0.0)))
    flowers = partial(clutter.plant, rng, 0.45, (0.75, 0.6, 0.25), 30)
    wax = painted((0.95, 0.92, 0.8))
    return joined(
        [
            box(rng, (3.4, 1.2, 0.14), ROSE, 140, "flrt").placed(0, 3.65),
            box(rng, (2.6, 0.9, 0.14), STONE, 140, "flrt").placed(0, 3.8, 0.14),
            box(rng, (1.5, 0.5, 0.75), CLOTH, 160, "flrt").placed(0, 3.65, 0.28),
            box(rng, (3.1, 0.12, 2.75), fronts.gilded, 130, "flrt").placed(0, 4.18, 0.28),
            box(rng, (3.3, 0.22, 0.16), fronts.gilded, 140).placed(0, 4.1, 2.85),
            *(slender().placed(x, 4.0) for x in (-1.5, -0.6, 0.6, 1.5)),
            *(candle(wax, 80, 8).placed(x, 3.75, 1.03) for x in (-0.6, -0.4, -0.2, 0.2, 0.4, 0.6)),
            *(flowers().placed(x, 3.3, 0.14) for x in (-1.25, 1.2)),
            *_altar_panels(rng),
        ]
    )


def _altar_panels(rng: Generator) -> list[Item]:
    panels = []
    for x, z, size, ground, sky, figures in PANELS:
        saints = partial(murals.mural, ground=ground, sky=sky, figures=figures)
        panels.append(on_wall(rng, (x, 4.12, z), 0, size, saints, 300, 0.03))
    return panels


def furnishing(rng: Generator) -> Item:
    """Pews in six rows, columns, statues, chandelier."""
    rows = np.linspace(-2.9, 1.6, 6)
    pews = [furniture.pew(rng, 1.15).placed(x, y) for y in rows for x in (-0.98, 0.98)]
    return joined([*pews, _columns(rng), _statues(rng), _chandelier(rng)])


def _columns(rng: Generator) -> Item:
    """Four free columns of different stone under two beams, and ribs across the vault."""
    places = [(x, y) for x in (-COLUMN_X_M, COLUMN_X_M) for y in COLUMNS_Y_M]
    columns = [
        turned(rng, SHAFT, stone, 170, 18).placed(x, y)
        for stone, (x, y) in zip((STONE, ROSE, GREEN_MARBLE, BLUE_MARBLE), places, strict=True)
    ]
    beams = [
        box(rng, (2 * HALF_Y_M, 0.24, 0.22), FRIEZE, 130).placed(x, 0, 2.6, 90)
        for x in (-COLUMN_X_M, COLUMN_X_M)
    ]
    profile = arc(inset_m=0.09)
    ribs = []
    for y in RIBS_Y_M:
        path = np.insert(profile, 1, y, axis=1)
        ribs.append(tube(rng, path, 0.09, STONE, 100))
    return joined([*columns, *beams, Item(tuple(ribs))])


def _statues(rng: Generator) -> Item:
    """Robed figures on pedestals, two beside the altar and one at the east wall."""
    places: tuple[tuple[float, float, Colour], ...] = (
        (-2.3, 3.4, (0.2, 0.3, 0.65)),
        (2.3, 3.4, (0.65, 0.15, 0.15)),
        (2.45, -1.4, (0.8, 0.78, 0.7)),
    )
    things = []
    for x, y, colour in places:
        robe = partial(materials.fabric, colour=colour, stripe=murals.GOLD, pitch_m=0.25)
        things.append(turned(rng, FIGURE, robe, 170, 16).placed(x, y, 0.8))
        things.append(box(rng, (0.42, 0.42, 0.8), STONE, 140, "fblrt").placed(x, y))
    return joined(things)


def _chandelier(rng: Generator) -> Item:
    angle = np.linspace(0, 2 * np.pi, 17)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(17)], axis=-1)
    brass, rise = painted((0.75, 0.58, 0.22)), np.array([0, 0, 0.45])
    top = [(0, 0, CROWN_M - 0.02 - CHANDELIER_M[2]), (0, 0, 0.7), (0, 0, 0)]
    spokes = [
        tube(rng, [0.4 * circle[k], 0.2 * circle[k] + 0.6 * rise, rise], 0.012, brass, 60, 5)
        for k in (0, 4, 8, 12)
    ]
    ring, chain = tube(rng, 0.4 * circle, 0.03, brass, 90), tube(rng, top, 0.015, brass, 60, 6)
    return Item((ring, chain, *spokes)).placed(*CHANDELIER_M)
