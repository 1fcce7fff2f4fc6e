"""The stand-in for the paper's *Sanctuary*: a vaulted nave of 5.5 × 8.5 × 3.92 m = 183.18 m³.

Painted vault and walls, columns, pews, a gilded altar piece: rich in texture, and large.
"""

from __future__ import annotations

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes.ambient import ambient_corners
from synfeal.scenes.bake import scanned_mesh
from synfeal.scenes.lighting import Lamp, Lighting, Sun
from synfeal.scenes.patches import Item, joined
from synfeal.scenes.sanctuary.contents import CHANDELIER_M, altar, furnishing
from synfeal.scenes.sanctuary.shell import CROWN_M, HALF_X_M, HALF_Y_M, vault_and_floor, walls
from synfeal.scenes.sanctuary.walls import BAYS_Y_M, portal_wall, side_walls
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
