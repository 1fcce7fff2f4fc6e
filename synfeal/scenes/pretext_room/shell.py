"""Walls, floor and sloping ceiling of the loft."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import materials
from synfeal.scenes.canvas import Painter
from synfeal.scenes.patches import Item, paint
from synfeal.scenes.primitives import sheet, upright

SIDE_M = 5.0
CUT_X_M, CUT_Y_M = 3.9, 3.7  # the corner at (5, 5) is cut off between (5, 3.7) and (3.9, 5)
PLAN_M = ((0.0, 0.0), (SIDE_M, 0.0), (SIDE_M, CUT_Y_M), (CUT_X_M, SIDE_M), (0.0, SIDE_M))
LOW_M, HIGH_M = 2.3, 3.1  # ceiling at y = 0 and at y = 5
BRICK: Painter = partial(
    materials.masonry,
    palette=((0.58, 0.24, 0.16), (0.66, 0.32, 0.2), (0.5, 0.2, 0.15), (0.7, 0.42, 0.3)),
    block_m=(0.22, 0.075),
    joint_m=0.012,
    joint=(0.7, 0.66, 0.6),
)
WALLPAPER: Painter = partial(materials.damask, colour=(0.18, 0.34, 0.26), motif=(0.5, 0.55, 0.32))
CREAM: Painter = partial(materials.plaster, colour=(0.88, 0.84, 0.72))
BOARDS: Painter = partial(
    materials.masonry,
    palette=((0.62, 0.42, 0.22), (0.7, 0.48, 0.26), (0.55, 0.36, 0.2)),
    block_m=(2.0, 0.14),
    joint=(0.2, 0.12, 0.06),
)
AZULEJO: Painter = partial(
    materials.masonry,
    palette=((0.85, 0.88, 0.9), (0.3, 0.5, 0.75), (0.8, 0.84, 0.88), (0.15, 0.3, 0.55)),
    block_m=(0.15, 0.15),
    stagger=0,
)
PARQUET: Painter = partial(
    materials.masonry,
    palette=((0.52, 0.33, 0.19), (0.6, 0.4, 0.24), (0.45, 0.28, 0.16)),
    block_m=(0.9, 0.11),
    joint_m=0.004,
    joint=(0.15, 0.1, 0.06),
    stagger=0.37,
)
PANELLING: Painter = partial(
    materials.masonry,
    palette=((0.86, 0.82, 0.74), (0.9, 0.87, 0.8)),
    block_m=(SIDE_M, 0.2),
    joint_m=0.012,
    spread=0.03,
)
WALLS = (BRICK, WALLPAPER, CREAM, BOARDS, AZULEJO)  # of the plan's edges in their order


def ceiling_m(y_m: float) -> float:
    """Height of the sloping ceiling."""
    return LOW_M + (HIGH_M - LOW_M) * y_m / SIDE_M


def shell(rng: np.random.Generator) -> Item:
    """Five different walls; floor and ceiling in a rectangle and a trapezium each."""
    patches = []
    for index, painter in enumerate(WALLS):
        right, left = PLAN_M[index], PLAN_M[(index + 1) % len(PLAN_M)]
        points = upright(left, right, 0, ceiling_m(left[1]), ceiling_m(right[1]))
        patches.append(paint(rng, points, painter, 130))
    for near_x, far_x, near_y, far_y in (
        (SIDE_M, SIDE_M, 0.0, CUT_Y_M),
        (SIDE_M, CUT_X_M, CUT_Y_M, SIDE_M),
    ):
        ground = [(0, far_y, 0), (far_x, far_y, 0), (near_x, near_y, 0), (0, near_y, 0)]
        low, high = ceiling_m(near_y), ceiling_m(far_y)
        roof = [(far_x, far_y, high), (0, far_y, high), (0, near_y, low), (near_x, near_y, low)]
        patches.append(paint(rng, sheet(ground), PARQUET, 150))
        patches.append(paint(rng, sheet(roof), PANELLING, 100))
    return Item(tuple(patches))
