"""The stand-in for the paper's *Large Room*: a laboratory of 5.0 × 6.6 × 2.71 m = 89.4 m³.

White, weakly textured walls and repeated desks, lamps and window bays, as in the original; posters,
boards, cabinets and light that differs from wall to wall make every pose decidable.
"""

from __future__ import annotations

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes.ambient import ambient_corners
from synfeal.scenes.bake import scanned_mesh
from synfeal.scenes.large_room.boards import SILL_M, WINDOW_M, WINDOWS_Y_M, boards
from synfeal.scenes.large_room.contents import LAMP_STRENGTHS, LAMPS_M, contents
from synfeal.scenes.large_room.shell import HEIGHT_M, LENGTH_M, WIDTH_M, shell
from synfeal.scenes.lighting import Lamp, Lighting, Sun
from synfeal.scenes.patches import Item, joined
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
