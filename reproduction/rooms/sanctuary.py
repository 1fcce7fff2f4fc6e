"""The stand-in for the paper's *Sanctuary*: a vaulted nave of 5.5 × 8.5 × 3.92 m = 183.18 m³.

Painted vault and walls, columns, pews, a gilded altar piece: rich in texture, and large. Altar at
y = +4.25, portal at y = −4.25, x ±2.75, z 0 – 3.92 m.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from reproduction.rooms import furniture, pictures
from reproduction.rooms.lighting import Lamp, Lighting, Sun, ambient_corners
from reproduction.rooms.scan import Scanner, stations
from synfeal.objects import materials
from synfeal.objects.canvas import Canvas, Color, Pixels
from synfeal.objects.materials import painted
from synfeal.objects.patches import Item, Maker, Points, joined, level, upright
from synfeal.records.provenance import generator_of

HALF_X_M, HALF_Y_M = 2.75, 4.25
CROWN_M = 183.18 / (4 * HALF_X_M * HALF_Y_M)  # the volume the paper prints
SPRING_M = 2.55  # where walls end and the vault begins
LOWER_M, UPPER_M = (-HALF_X_M, -HALF_Y_M, 0.0), (HALF_X_M, HALF_Y_M, CROWN_M)
CELL_M = 0.0399  # gives the paper's number of faces
BAYS_Y_M = (-2.75, 0.0, 2.55)
COLUMNS_Y_M = (-1.4, 1.3)
RIBS_Y_M = (-4.1, *COLUMNS_Y_M, 3.9)
WINDOW_M = (1.0, 1.4)
COLUMN_X_M = 1.8
CHANDELIER_M = (0.0, -0.3, 2.85)

WEST = materials.wainscot((0.45, 0.58, 0.5), lower=(0.3, 0.32, 0.36), grain=0.03)
EAST = materials.wainscot((0.78, 0.5, 0.32), lower=(0.42, 0.2, 0.16), grain=0.03)
ALTAR = pictures.mural((0.5, 0.36, 0.2), sky=(0.75, 0.6, 0.3), figures=6)
ASHLAR = materials.masonry(
    ((0.62, 0.56, 0.48), (0.55, 0.5, 0.45), (0.66, 0.62, 0.55)), block_m=(0.5, 0.26)
)
VAULT = pictures.starry_vault((0.62, 0.3, 0.22), second=(0.14, 0.24, 0.55))
STONE = materials.marble((0.74, 0.7, 0.62), vein=(0.5, 0.44, 0.38))
ROSE = materials.marble((0.6, 0.33, 0.28), vein=(0.8, 0.65, 0.55))
GREEN_MARBLE = materials.marble((0.3, 0.42, 0.36), vein=(0.75, 0.78, 0.7))
BLUE_MARBLE = materials.marble((0.28, 0.3, 0.4), vein=(0.7, 0.7, 0.75))
CLOTH = materials.fabric((0.9, 0.88, 0.8), stripe=(0.75, 0.6, 0.2))
FRIEZE = materials.masonry(pictures.ROBES, block_m=(0.25, 0.11), joint=pictures.GOLD, joint_m=0.02)

# Profiles of what is turned: radius and height, metres.
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
BASIN = (
    (0.05, 0.9), (0.22, 0.95), (0.25, 0.92), (0.08, 0.75), (0.07, 0.2), (0.2, 0.08), (0.2, 0),
)  # fmt: skip
CANDLE = ((0.006, 0.36), (0.02, 0.32), (0.02, 0.0))

# Where a mural is, which way it faces, its size, what is on it, texels per metre and rim.
FRESCOES = tuple(
    ((x, y, 1.77), yaw, (2.1, 1.4), pictures.mural(ground, sky), 270, 0.02)
    for x, y, yaw, ground, sky in (
        (HALF_X_M, BAYS_Y_M[0], -90, (0.3, 0.42, 0.2), (0.55, 0.7, 0.85)),
        (HALF_X_M, BAYS_Y_M[1], -90, (0.55, 0.25, 0.15), (0.9, 0.75, 0.45)),
        (HALF_X_M, BAYS_Y_M[2], -90, (0.2, 0.3, 0.45), (0.8, 0.82, 0.85)),
        (-HALF_X_M, BAYS_Y_M[2], 90, (0.45, 0.38, 0.15), (0.35, 0.5, 0.75)),
    )
)
PANELS = tuple(
    ((x, 4.12, z), 0, size, pictures.mural(ground, sky, figures), 300, 0.03)
    for x, z, size, ground, sky, figures in (
        (-1.05, 1.75, (0.75, 1.7), (0.5, 0.15, 0.15), (0.8, 0.6, 0.3), 1),
        (0.0, 1.95, (1.05, 1.9), (0.1, 0.2, 0.45), (0.55, 0.75, 0.95), 3),
        (1.05, 1.75, (0.75, 1.7), (0.15, 0.35, 0.2), (0.9, 0.8, 0.5), 1),
        (0.0, 3.3, (0.9, 0.55), (0.7, 0.5, 0.2), (0.95, 0.85, 0.5), 1),
    )
)
STATUES: tuple[tuple[float, float, Color], ...] = (  # x, y and robe
    (-2.3, 3.4, (0.2, 0.3, 0.65)), (2.3, 3.4, (0.65, 0.15, 0.15)), (2.45, -1.4, (0.8, 0.78, 0.7)),
)  # fmt: skip


def ingredients(seed: int) -> tuple[np.random.Generator, Item, Lighting, Scanner]:
    """Build surfaces and objects to scan."""
    rng = generator_of("scene", "sanctuary", seed)
    parts = (_shell, _side_walls, _portal_wall, _altar, _pews, _columns, _statues, _chandelier)
    everything = joined(part(Maker(rng)) for part in parts)
    scanner = Scanner(CELL_M, stations(LOWER_M, UPPER_M, (2, 3, 2)), LOWER_M, UPPER_M)
    return rng, everything, _lighting(), scanner


def _lighting() -> Lighting:
    west, windows = -HALF_X_M, BAYS_Y_M[:2]
    lamps = [
        *(Lamp((side, 3.1, 1.9), (0, 0, -1), (0.35, 0.24, 0.1)) for side in (-0.9, 0.9)),
        Lamp((0, 1.6, 2.6), (0, 0.94, -0.34), (1.5, 1.15, 0.65)),
        *(Lamp((west + 0.15, y, 1.9), (1, 0, 0), (0.9, 1.05, 1.2), "daylight") for y in windows),
        Lamp((0, -HALF_Y_M + 0.15, 3.1), (0, 0.95, -0.31), (0.6, 0.7, 1.1), "daylight"),
        Lamp(CHANDELIER_M, (0, 0, 1), (0.32, 0.26, 0.17)),
        Lamp(CHANDELIER_M, (0, 0, -1), (0.72, 0.6, 0.4)),
    ]
    ambient = ambient_corners(
        (0.36, 0.48, 0.66), (0.55, 0.47, 0.32), (0.55, 0.42, 0.42), (0.68, 0.48, 0.26), top=1.25
    )
    openings = tuple(((west, y - 0.5, 1.05), (west, y + 0.5, 2.45)) for y in windows)
    sun = Sun((0.8, 0.3, -0.42), (1.8, 1.4, 0.8), openings)
    return Lighting(LOWER_M, UPPER_M, ambient, lamps, sun)


def _arc(inset_m: float = 0.0, n: int = 41) -> Points:
    """Return the vault's profile (n, 2), x and z, from the west spring to the east one."""
    angle = np.linspace(np.pi, 0, n)
    x = (HALF_X_M - inset_m) * np.cos(angle)
    z = SPRING_M + (CROWN_M - SPRING_M - inset_m) * np.sin(angle)
    return np.stack([x, z], axis=-1)


def _shell(make: Maker) -> Item:
    """Build west, east, altar (+y) and portal wall (−y), painted barrel vault and marble floor."""
    x, y = HALF_X_M, HALF_Y_M
    surfaces = (
        (upright((-x, -y), (-x, y), 0, SPRING_M), WEST, 120),
        (upright((x, y), (x, -y), 0, SPRING_M), EAST, 120),
        (_end_wall(y), ALTAR, 120),
        (_end_wall(-y), ASHLAR, 120),
        (np.stack([np.insert(_arc(), 1, at, axis=1) for at in (y, -y)], axis=1), VAULT, 130),
        (level((-x, x), (-y, y), 0), _floor, 150),
    )
    return joined(make.sheet(*surface) for surface in surfaces)


def _end_wall(y_m: float) -> Points:
    """Return a wall under the vault: its rows are bent like the vault, so that no gap is left."""
    profile = _arc() if y_m > 0 else _arc()[::-1]
    share = np.linspace(1, 0, 31)[:, None]
    columns = np.broadcast_arrays(profile[:, 0], y_m, share * profile[:, 1])
    return np.stack(columns, axis=-1)


def _floor(canvas: Canvas) -> Pixels:
    """Paint chequered marble with a red runner and two tomb slabs."""
    x, y = canvas.coordinates_m()
    light = materials.marble((0.74, 0.7, 0.62), (0.5, 0.45, 0.4))(canvas)
    dark = materials.marble((0.3, 0.2, 0.18), (0.6, 0.5, 0.45))(canvas)
    check = (np.floor(x / 0.5) + np.floor(y / 0.5)) % 2
    image = np.where((check > 0)[..., None], light, dark)
    joint = np.minimum(np.abs((x + 0.25) % 0.5 - 0.25), np.abs((y + 0.25) % 0.5 - 0.25)) < 0.005
    image[joint] *= np.float32(0.5)
    runner = np.abs(x[0] - HALF_X_M) < 0.28
    red = materials.rug(((0.55, 0.08, 0.1), (0.75, 0.55, 0.2), (0.45, 0.05, 0.08)))(canvas)
    image[:, runner] = red[:, runner]
    for slab_x, slab_y in ((0.75, 6.2), (4.8, 3.4)):
        slab = (np.abs(x - slab_x) < 0.4) & (np.abs(y - slab_y) < 0.8)
        image[slab] *= np.asarray((0.75, 0.85, 0.95), np.float32)
    return image


def _side_walls(make: Maker) -> Item:
    """Build six bays between pilasters: two windows and four frescoes."""
    pilaster = partial(make.box, (0.3, 0.12, SPRING_M), STONE, 120, "flr")
    return joined(
        (make.on_wall(*fresco) for fresco in FRESCOES),
        (_window(make).placed(-HALF_X_M, y, 1.75, 90) for y in BAYS_Y_M[:2]),
        (pilaster().placed(0.06 - HALF_X_M, y, 0, 90) for y in RIBS_Y_M),
        (pilaster().placed(HALF_X_M - 0.06, y, 0, -90) for y in RIBS_Y_M),
    )


def _window(make: Maker) -> Item:
    """Build stained glass in a stone frame, around the origin."""
    width, height = WINDOW_M
    jamb = partial(make.box, (0.14, 0.1, height + 0.28), STONE, 120, "flrt")
    beam = partial(make.box, (width, 0.1, 0.14), STONE, 120, "ftu")
    side, low = width / 2 + 0.07, -height / 2 - 0.14
    return joined(
        make.on_wall((0, 0, 0), 0, WINDOW_M, pictures.stained_glass(), 260, 0.03, glow=0.85),
        (jamb().placed(x, -0.05, low) for x in (-side, side)),
        (beam().placed(0, -0.05, z) for z in (low, height / 2)),
    )


def _portal_wall(make: Maker) -> Item:
    """Build portal, rose window, confessional and font at the far end."""
    y = -HALF_Y_M
    jamb = partial(make.box, (0.22, 0.14, 2.3), ROSE, 140, "flrt")
    leaf = materials.door((0.38, 0.23, 0.12))
    booth = furniture.cabinet(make, (1.1, 0.6, 2.05), (0.45, 0.24, 0.12), 3)
    return joined(
        *(jamb().placed(x, y + 0.07, 0, 180) for x in (-0.95, 0.95)),
        make.box((2.3, 0.2, 0.25), ROSE, 140).placed(0, y + 0.1, 2.3, 180),
        *(make.on_wall((x, y, 1.15), 180, (0.84, 2.3), leaf, 180, 0.05) for x in (-0.42, 0.42)),
        booth.placed(-1.95, y + 0.31, 0, 180),
        make.turned(BASIN, STONE, 150, 18).placed(1.7, y + 0.5),
        make.on_wall((1.95, y, 1.6), 180, (0.8, 0.9), pictures.noticeboard(), 250),
        _rose_window(make, y + 0.03, 3.15, 0.55),
    )


def _circle(n: int) -> Points:
    """Return points (n, 3) of the unit circle about z, the last the first."""
    angle = np.linspace(0, 2 * np.pi, n)
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)


def _rose_window(make: Maker, y_m: float, z_m: float, radius_m: float) -> Item:
    """Build a round window: a polar grid, so that the glass cells spread from its middle."""
    circle, centre = -_circle(25)[:, [0, 2, 1]], np.array([0, y_m, z_m])
    points = centre + np.linspace(radius_m, 0.01, 6)[:, None, None] * circle
    glass = pictures.stained_glass(cells=90)
    rim = make.tube(centre + radius_m * circle + (0, 0.02, 0), 0.05, STONE, 120)
    return joined(make.sheet(points, glass, 200, glow=0.85), rim)


def _altar(make: Maker) -> Item:
    """Build steps, table, candles and a gilded altar piece with painted panels."""
    slender = partial(make.turned, SLENDER, materials.gilded(), 130, 12)
    candle = partial(make.turned, CANDLE, painted((0.95, 0.92, 0.8)), 80, 8)
    flowers = partial(furniture.plant, make, 0.45, (0.75, 0.6, 0.25), 30)
    return joined(
        make.box((3.4, 1.2, 0.14), ROSE, 140, "flrt").placed(0, 3.65),
        make.box((2.6, 0.9, 0.14), STONE, 140, "flrt").placed(0, 3.8, 0.14),
        make.box((1.5, 0.5, 0.75), CLOTH, 160, "flrt").placed(0, 3.65, 0.28),
        make.box((3.1, 0.12, 2.75), materials.gilded(), 130, "flrt").placed(0, 4.18, 0.28),
        make.box((3.3, 0.22, 0.16), materials.gilded(), 140).placed(0, 4.1, 2.85),
        (slender().placed(x, 4.0) for x in (-1.5, -0.6, 0.6, 1.5)),
        (candle().placed(x, 3.75, 1.03) for x in (-0.6, -0.4, -0.2, 0.2, 0.4, 0.6)),
        (flowers().placed(x, 3.3, 0.14) for x in (-1.25, 1.2)),
        (make.on_wall(*panel) for panel in PANELS),
    )


def _pews(make: Maker) -> Item:
    rows = np.linspace(-2.9, 1.6, 6)
    return joined(furniture.pew(make, 1.15).placed(x, y) for y in rows for x in (-0.98, 0.98))


def _columns(make: Maker) -> Item:
    """Build four free columns of different stone under two beams, and ribs across the vault."""
    sides, beam = (-COLUMN_X_M, COLUMN_X_M), (2 * HALF_Y_M, 0.24, 0.22)
    places = [(x, y) for x in sides for y in COLUMNS_Y_M]
    stones = zip((STONE, ROSE, GREEN_MARBLE, BLUE_MARBLE), places, strict=True)
    ribs = (np.insert(_arc(inset_m=0.09), 1, y, axis=1) for y in RIBS_Y_M)
    return joined(
        (make.turned(SHAFT, stone, 170, 18).placed(*place) for stone, place in stones),
        (make.box(beam, FRIEZE, 130).placed(x, 0, 2.6, 90) for x in sides),
        (make.tube(rib, 0.09, STONE, 100) for rib in ribs),
    )


def _statues(make: Maker) -> Item:
    """Build robed figures on pedestals, two beside the altar and one at the east wall."""
    things = []
    for x, y, color in STATUES:
        robe = materials.fabric(color, stripe=pictures.GOLD, pitch_m=0.25)
        things.append(make.turned(FIGURE, robe, 170, 16).placed(x, y, 0.8))
        things.append(make.box((0.42, 0.42, 0.8), STONE, 140, "fblrt").placed(x, y))
    return joined(things)


def _chandelier(make: Maker) -> Item:
    circle, brass, rise = _circle(17), painted((0.75, 0.58, 0.22)), np.array([0, 0, 0.45])
    spokes = [
        make.tube([0.4 * circle[k], 0.2 * circle[k] + 0.6 * rise, rise], 0.012, brass, 60, 5)
        for k in (0, 4, 8, 12)
    ]
    ring = make.tube(0.4 * circle, 0.03, brass, 90)
    top = [(0, 0, CROWN_M - 0.02 - CHANDELIER_M[2]), (0, 0, 0.7), (0, 0, 0)]
    chain = make.tube(top, 0.015, brass, 60, 6)
    return joined(ring, chain, spokes).placed(*CHANDELIER_M)
