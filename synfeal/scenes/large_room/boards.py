"""What hangs on the walls of the laboratory: windows, boards, posters, the door."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import fronts, materials, pictures
from synfeal.scenes.canvas import Painter
from synfeal.scenes.large_room.shell import LENGTH_M, WIDTH_M
from synfeal.scenes.patches import Item, joined
from synfeal.scenes.primitives import box, on_wall, turned

Generator = np.random.Generator
WINDOWS_Y_M = (1.25, 3.3, 5.35)  # centres of the bays in the west wall
WINDOW_M = (1.5, 1.25)
SILL_M = 0.95
BLIND = 0.25
BEECH: Painter = partial(materials.wood, colour=(0.8, 0.68, 0.5), contrast=0.08)
RIBS: Painter = partial(
    materials.masonry, palette=((0.86, 0.86, 0.84),), block_m=(0.06, 1.0), joint_m=0.012
)


def boards(rng: Generator) -> Item:
    """Everything flat on the four walls."""
    return joined([_windows(rng), _south(rng), _east(rng), _north(rng)])


def _windows(rng: Generator) -> Item:
    """Three equal bays in the west wall: view, sill and radiator."""
    view = partial(pictures.window_view, blind=BLIND)
    centre = (0.0, 0.0, SILL_M + WINDOW_M[1] / 2)
    sill = box(rng, (WINDOW_M[0] + 0.2, 0.2, 0.04), BEECH, 120)
    bay = joined(
        [
            on_wall(rng, centre, 90, WINDOW_M, view, 230, depth_m=0.05, glow=0.85),
            sill.placed(0.1, 0, SILL_M - 0.05, 90),
            box(rng, (1.2, 0.1, 0.5), RIBS, 100, "flrt").placed(0.08, 0, 0.2, 90),
        ]
    )
    return joined(bay.placed(0, y) for y in WINDOWS_Y_M)


def _south(rng: Generator) -> Item:
    """Door with exit sign, whiteboard, notice and extinguisher."""
    door = partial(fronts.door, colour=(0.15, 0.3, 0.6), window=True)
    sign = partial(fronts.label, colour=(0.1, 0.6, 0.25))
    profile = [(0.02, 0.55), (0.03, 0.5), (0.08, 0.45), (0.08, 0.0)]
    extinguisher = turned(rng, profile, materials.painted((0.8, 0.08, 0.06)), 150, 12)
    return joined(
        [
            on_wall(rng, (1.3, 0, 1.05), 180, (1.0, 2.1), door, 180, 0.04),
            on_wall(rng, (3.4, 0, 1.55), 180, (2.2, 1.15), pictures.whiteboard, 280, 0.03),
            on_wall(rng, (2.1, 0, 1.25), 180, (0.12, 0.16), fronts.page, 250),
            on_wall(rng, (1.3, 0, 2.36), 180, (0.6, 0.22), sign, 300, 0.03, glow=0.6),
            extinguisher.placed(2.12, 0.12, 0.5),
        ]
    )


def _east(rng: Generator) -> Item:
    """Posters between the cabinets and above the desks."""
    places = (
        (1.15, 1.75, 0.6, 0.85),
        (3.35, 1.8, 0.85, 1.15),
        (4.35, 1.75, 0.6, 0.8),
        (5.1, 1.9, 0.55, 0.4),
    )
    return joined(
        on_wall(rng, (WIDTH_M, y, z), -90, (width, height), pictures.poster, 320)
        for y, z, width, height in places
    )


def _north(rng: Generator) -> Item:
    """Notice board, a large blue poster and small ones."""
    blue = partial(pictures.poster, ground=(0.1, 0.4, 0.75))
    places: tuple[tuple[float, float, float, float, Painter], ...] = (
        (1.2, 1.65, 1.3, 0.95, pictures.noticeboard),
        (2.45, 1.7, 0.7, 1.0, blue),
        (0.3, 1.8, 0.35, 0.5, pictures.poster),
        (3.15, 2.15, 0.36, 0.36, pictures.poster),
    )
    return joined(
        on_wall(rng, (x, LENGTH_M, z), 0, (width, height), painter, 320)
        for x, z, width, height, painter in places
    )
