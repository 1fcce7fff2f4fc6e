"""What hangs on or leans against the walls of the nave: frescoes, windows, portal."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import fronts, furniture, materials, murals, pictures
from synfeal.scenes.canvas import Colour, Painter
from synfeal.scenes.patches import Item, joined, paint
from synfeal.scenes.primitives import box, on_wall, tube, turned
from synfeal.scenes.sanctuary.shell import HALF_X_M, HALF_Y_M, SPRING_M

Generator = np.random.Generator
BAYS_Y_M = (-2.75, 0.0, 2.55)
COLUMNS_Y_M = (-1.4, 1.3)
RIBS_Y_M = (-4.1, *COLUMNS_Y_M, 3.9)
WINDOW_M = (1.0, 1.4)
STONE: Painter = partial(materials.marble, colour=(0.74, 0.7, 0.62), vein=(0.5, 0.44, 0.38))
ROSE: Painter = partial(materials.marble, colour=(0.6, 0.33, 0.28), vein=(0.8, 0.65, 0.55))
FRESCOES: tuple[tuple[float, float, float, Colour, Colour], ...] = (  # x, y, yaw, ground, sky
    (HALF_X_M, BAYS_Y_M[0], -90, (0.3, 0.42, 0.2), (0.55, 0.7, 0.85)),
    (HALF_X_M, BAYS_Y_M[1], -90, (0.55, 0.25, 0.15), (0.9, 0.75, 0.45)),
    (HALF_X_M, BAYS_Y_M[2], -90, (0.2, 0.3, 0.45), (0.8, 0.82, 0.85)),
    (-HALF_X_M, BAYS_Y_M[2], 90, (0.45, 0.38, 0.15), (0.35, 0.5, 0.75)),
)


def side_walls(rng: Generator) -> Item:
    """Six bays between pilasters: two windows and four frescoes."""
    things = []
    for x, y, yaw, ground, sky in FRESCOES:
        fresco = partial(murals.mural, ground=ground, sky=sky)
        things.append(on_wall(rng, (x, y, 1.77), yaw, (2.1, 1.4), fresco, 270))
    things += [_window(rng).placed(-HALF_X_M, y, 1.75, 90) for y in BAYS_Y_M[:2]]
    for x, yaw in ((-HALF_X_M, 90), (HALF_X_M, -90)):
        for y in RIBS_Y_M:
            pilaster = box(rng, (0.3, 0.12, SPRING_M), STONE, 120, "flr")
            things.append(pilaster.placed(x - np.sign(x) * 0.06, y, 0, yaw))
    return joined(things)


def _window(rng: Generator) -> Item:
    """Stained glass in a stone frame, around the origin."""
    width, height = WINDOW_M
    glass = on_wall(rng, (0, 0, 0), 0, WINDOW_M, pictures.stained_glass, 260, 0.03, glow=0.85)
    jambs = [
        box(rng, (0.14, 0.1, height + 0.28), STONE, 120, "flrt").placed(
            x, -0.05, -height / 2 - 0.14
        )
        for x in (-width / 2 - 0.07, width / 2 + 0.07)
    ]
    beams = [
        box(rng, (width, 0.1, 0.14), STONE, 120, "ftu").placed(0, -0.05, z)
        for z in (-height / 2 - 0.14, height / 2)
    ]
    return joined([glass, *jambs, *beams])


def portal_wall(rng: Generator) -> Item:
    """Portal, rose window, confessional and font at the far end."""
    y = -HALF_Y_M
    jamb = partial(box, rng, (0.22, 0.14, 2.3), ROSE, 140, "flrt")
    leaf = partial(fronts.door, colour=(0.38, 0.23, 0.12))
    basin = [
        (0.05, 0.9),
        (0.22, 0.95),
        (0.25, 0.92),
        (0.08, 0.75),
        (0.07, 0.2),
        (0.2, 0.08),
        (0.2, 0),
    ]
    booth = furniture.cabinet(rng, (1.1, 0.6, 2.05), (0.45, 0.24, 0.12), 3)
    return joined(
        [
            *(jamb().placed(x, y + 0.07, 0, 180) for x in (-0.95, 0.95)),
            box(rng, (2.3, 0.2, 0.25), ROSE, 140).placed(0, y + 0.1, 2.3, 180),
            *(on_wall(rng, (x, y, 1.15), 180, (0.84, 2.3), leaf, 180, 0.05) for x in (-0.42, 0.42)),
            booth.placed(-1.95, y + 0.31, 0, 180),
            turned(rng, basin, STONE, 150, 18).placed(1.7, y + 0.5),
            on_wall(rng, (1.95, y, 1.6), 180, (0.8, 0.9), pictures.noticeboard, 250),
            _rose_window(rng, y + 0.03, 3.15, 0.55),
        ]
    )


def _rose_window(rng: Generator, y_m: float, z_m: float, radius_m: float) -> Item:
    """A round window: a polar grid, so that the glass cells spread from its middle."""
    angle = np.linspace(0, 2 * np.pi, 25)
    circle = np.stack([-np.cos(angle), np.zeros(25), -np.sin(angle)], axis=-1)
    centre = np.array([0, y_m, z_m])
    points = centre + np.linspace(radius_m, 0.01, 6)[:, None, None] * circle
    glass = partial(pictures.stained_glass, cells=90)
    rim = tube(rng, centre + radius_m * circle + (0, 0.02, 0), 0.05, STONE, 120)
    return Item((paint(rng, points, glass, 200, glow=0.85), rim))
