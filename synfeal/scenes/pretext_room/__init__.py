"""A loft with a cut corner and a sloping ceiling, on which backbones are pretrained.

It shares neither shape nor colours with the two scenes of the paper.
"""

from __future__ import annotations

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes.ambient import ambient_corners
from synfeal.scenes.bake import scanned_mesh
from synfeal.scenes.lighting import Lamp, Lighting, Sun
from synfeal.scenes.patches import joined
from synfeal.scenes.pretext_room.contents import (
    SKYLIGHT_X_M,
    SKYLIGHT_Y_M,
    kitchen,
    living,
    structure,
    wall_hangings,
)
from synfeal.scenes.pretext_room.shell import HIGH_M, SIDE_M, ceiling_m, shell
from synfeal.scenes.scan import Scanner, stations
from synfeal.seeds import generator_of

LOWER_M, UPPER_M = (0.0, 0.0, 0.0), (SIDE_M, SIDE_M, HIGH_M)
CELL_M = 0.08  # nobody compares this one with a scan, so it may be coarser


def build(seed: int) -> TexturedMesh:
    """The loft; x, y 0 – 5 with one corner cut off, z 0 – 3.1 m."""
    rng = generator_of("scene", "pretext_room", seed)
    parts = [shell(rng), wall_hangings(rng), kitchen(rng), living(rng), structure(rng)]
    inside = joined(parts).clipped(LOWER_M, UPPER_M)
    scanner = Scanner(CELL_M, stations(LOWER_M, UPPER_M, (2, 2, 1)), LOWER_M, UPPER_M)
    return scanned_mesh(rng, inside, _lighting(), scanner)


def _lighting() -> Lighting:
    lamps = [
        *(Lamp((4.35 - s, 4.2 + s, 1.6), (-0.76, -0.65, 0), (1.3, 1.4, 1.5)) for s in (-0.3, 0.3)),
        *(Lamp((0.75, 4.4, 1.55), (0, 0, axis), (0.9, 0.6, 0.3)) for axis in (1, -1)),
        *(Lamp((0.4, y, 2.0), (0.3, 0, -0.95), (0.6, 0.58, 0.5)) for y in (1.2, 2.6)),
        Lamp((2.4, 1.9, 2.2), (0, 0, -1), (0.9, 0.7, 0.42)),
        Lamp((2.9, 0.4, 0.4), (0, 0.95, 0.31), (0.9, 0.35, 0.1)),
    ]
    ambient = ambient_corners(
        (0.3, 0.34, 0.4), (0.5, 0.36, 0.24), (0.42, 0.3, 0.26), (0.44, 0.46, 0.46), top=1.2
    )
    (x0, x1), (y0, y1), height = SKYLIGHT_X_M, SKYLIGHT_Y_M, ceiling_m(sum(SKYLIGHT_Y_M) / 2)
    sun = Sun((-0.2, -0.75, -0.8), (1.2, 1.0, 0.7), (((x0, y0, height), (x1, y1, height)),))
    return Lighting(LOWER_M, UPPER_M, ambient, lamps, sun)
