"""Walls, vault and floor of the nave, and what hangs on or leans against them."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import fronts, furniture, materials, murals, pictures
from synfeal.scenes.canvas import Canvas, Colour, Painter, Pixels
from synfeal.scenes.patches import (
    Item,
    Points,
    box,
    joined,
    level,
    on_wall,
    paint,
    tube,
    turned,
    upright,
)

HALF_X_M, HALF_Y_M = 2.75, 4.25
CROWN_M = 183.18 / (4 * HALF_X_M * HALF_Y_M)  # the volume the paper prints
SPRING_M = 2.55  # where walls end and the vault begins
WEST: Painter = partial(
    materials.wainscot, colour=(0.45, 0.58, 0.5), lower=(0.3, 0.32, 0.36), grain=0.03
)
EAST: Painter = partial(
    materials.wainscot, colour=(0.78, 0.5, 0.32), lower=(0.42, 0.2, 0.16), grain=0.03
)
ALTAR: Painter = partial(murals.mural, ground=(0.5, 0.36, 0.2), sky=(0.75, 0.6, 0.3), figures=6)
ASHLAR: Painter = partial(
    materials.masonry,
    palette=((0.62, 0.56, 0.48), (0.55, 0.5, 0.45), (0.66, 0.62, 0.55)),
    block_m=(0.5, 0.26),
)
VAULT: Painter = partial(murals.starry_vault, first=(0.62, 0.3, 0.22), second=(0.14, 0.24, 0.55))


def arc(inset_m: float = 0.0, n: int = 41) -> Points:
    """The vault's profile (n, 2): x and z from the west spring over the crown to the east one."""
    angle = np.linspace(np.pi, 0, n)
    x = (HALF_X_M - inset_m) * np.cos(angle)
    z = SPRING_M + (CROWN_M - SPRING_M - inset_m) * np.sin(angle)
    return np.stack([x, z], axis=-1)


def walls(rng: np.random.Generator) -> Item:
    """West and east wall, altar wall (+y) and portal wall (−y)."""
    x, y = HALF_X_M, HALF_Y_M
    surfaces = (
        (upright((-x, -y), (-x, y), 0, SPRING_M), WEST),
        (upright((x, y), (x, -y), 0, SPRING_M), EAST),
        (_end_wall(y), ALTAR),
        (_end_wall(-y), ASHLAR),
    )
    return Item(tuple(paint(rng, points, p, 120) for points, p in surfaces))


def vault_and_floor(rng: np.random.Generator) -> Item:
    """The painted barrel vault and the marble floor."""
    floor = level((-HALF_X_M, HALF_X_M), (-HALF_Y_M, HALF_Y_M), 0)
    return Item(
        (
            paint(rng, _vault(), VAULT, 130),
            paint(rng, floor, _floor, 150),
        )
    )


def _vault() -> Points:
    profile = arc()
    y = np.array([HALF_Y_M, -HALF_Y_M])
    points = np.empty((len(profile), len(y), 3))
    points[..., 0], points[..., 1], points[..., 2] = profile[:, :1], y, profile[:, 1:]
    return points


def _end_wall(y_m: float) -> Points:
    """A wall under the vault: its rows are bent like the vault, so that no gap is left."""
    profile = arc() if y_m > 0 else arc()[::-1]
    share = np.linspace(1, 0, 31)[:, None]
    points = np.empty((len(share), len(profile), 3))
    points[..., 0], points[..., 1], points[..., 2] = profile[:, 0], y_m, share * profile[:, 1]
    return points


def _floor(canvas: Canvas) -> Pixels:
    """Chequered marble with a red runner and two tomb slabs."""
    x, y = canvas.coordinates_m()
    light = materials.marble(canvas, (0.74, 0.7, 0.62), (0.5, 0.45, 0.4))
    dark = materials.marble(canvas, (0.3, 0.2, 0.18), (0.6, 0.5, 0.45))
    check = (np.floor(x / 0.5) + np.floor(y / 0.5)) % 2
    image = np.where((check > 0)[..., None], light, dark)
    joint = np.minimum(np.abs((x + 0.25) % 0.5 - 0.25), np.abs((y + 0.25) % 0.5 - 0.25)) < 0.005
    image[joint] *= np.float32(0.5)
    runner = np.abs(x[0] - HALF_X_M) < 0.28
    red = materials.rug(canvas, ((0.55, 0.08, 0.1), (0.75, 0.55, 0.2), (0.45, 0.05, 0.08)))
    image[:, runner] = red[:, runner]
    for slab_x, slab_y in ((0.75, 6.2), (4.8, 3.4)):
        slab = (np.abs(x - slab_x) < 0.4) & (np.abs(y - slab_y) < 0.8)
        image[slab] *= np.asarray((0.75, 0.85, 0.95), np.float32)
    return image


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
