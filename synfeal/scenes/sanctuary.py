"""The stand-in for the paper's *Sanctuary*: a vaulted nave of 5.5 × 8.5 × 3.92 m = 183.18 m³.

Painted vault and walls, columns, pews, a gilded altar piece: rich in texture, and large.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.mesh.model import TexturedMesh
from synfeal.scenes import fronts, furniture, materials, murals, pictures
from synfeal.scenes.atlas import baked_mesh
from synfeal.scenes.canvas import Canvas, Colour, Painter, Pixels
from synfeal.scenes.lighting import Lamp, Lighting, Sun
from synfeal.scenes.patches import Item, Points, joined, paint
from synfeal.scenes.primitives import box, bumpy, level, on_wall, tube, turned, upright
from synfeal.scenes.shell import shell_blocks
from synfeal.seeds import generator_of

Generator = np.random.Generator
HALF_X_M, HALF_Y_M = 2.75, 4.25
CROWN_M = 183.18 / (4 * HALF_X_M * HALF_Y_M)
SPRING_M = 2.55  # where walls end and the vault begins
CELL_M = 0.11
BAYS_Y_M = (-2.75, 0.0, 2.55)
COLUMNS_Y_M = (-1.4, 1.3)
COLUMN_X_M = 1.8
OAK: Painter = partial(materials.wood, colour=(0.42, 0.27, 0.16), contrast=0.2)
STONE: Painter = partial(materials.marble, colour=(0.74, 0.7, 0.62), vein=(0.5, 0.44, 0.38))
ROSE: Painter = partial(materials.marble, colour=(0.6, 0.33, 0.28), vein=(0.8, 0.65, 0.55))


def build(seed: int) -> TexturedMesh:
    """The nave; altar at y = +4.25, portal at y = −4.25, x ±2.75, z 0 – 3.92 m."""
    rng = generator_of("scene", "sanctuary", seed)
    groups = {
        "walls": _walls(rng),
        "vault_and_floor": _vault_and_floor(rng),
        "murals": joined([_side_walls(rng), _portal_wall(rng)]),
        "altar": _altar(rng),
        "furniture": joined([_pews(rng), _columns(rng), _statues(rng), _chandelier(rng)]),
    }
    blocks = [block for item in groups.values() for block in item.blocks]
    return baked_mesh({name: item.patches for name, item in groups.items()}, blocks, _lighting())


def _lighting() -> Lighting:
    candles = [Lamp((x, 3.1, 1.9), (0, 0, -1), (0.35, 0.24, 0.1)) for x in (-0.9, 0.9)]
    altar = [Lamp((0, 1.6, 2.6), (0, 0.94, -0.34), (1.5, 1.15, 0.65))]
    windows = [Lamp((-HALF_X_M + 0.15, y, 1.9), (1, 0, 0), (0.9, 1.05, 1.2)) for y in BAYS_Y_M[:2]]
    rose = [Lamp((0, -HALF_Y_M + 0.15, 3.1), (0, 0.95, -0.31), (0.6, 0.7, 1.1))]
    chandelier = [
        Lamp((0, -0.3, 2.9), (0, 0, side), (0.9 * s, 0.75 * s, 0.5 * s)) for side, s in ((1, 0.35), (-1, 0.8))
    ]
    ambient = np.empty((2, 2, 2, 3), np.float32)
    ambient[0, 0], ambient[0, 1] = (0.36, 0.48, 0.66), (0.55, 0.47, 0.32)
    ambient[1, 0], ambient[1, 1] = (0.55, 0.42, 0.42), (0.68, 0.48, 0.26)
    ambient[:, :, 1] *= 1.25
    openings = tuple(((-HALF_X_M, y - 0.5, 1.05), (-HALF_X_M, y + 0.5, 2.45)) for y in BAYS_Y_M[:2])
    sun = Sun((0.8, 0.3, -0.5), (1.3, 1.0, 0.6), openings)
    lower, upper = (-HALF_X_M, -HALF_Y_M, 0.0), (HALF_X_M, HALF_Y_M, CROWN_M)
    lamps = [*candles, *altar, *windows, *rose, *chandelier]
    return Lighting(lower, upper, ambient, lamps, sun, shell_blocks(lower, upper))


def _arc(inset_m: float = 0.0, n: int = 41) -> Points:
    """The vault's profile (n, 2): x and z from the west spring over the crown to the east one."""
    angle = np.linspace(np.pi, 0, n)
    x = (HALF_X_M - inset_m) * np.cos(angle)
    z = SPRING_M + (CROWN_M - SPRING_M - inset_m) * np.sin(angle)
    return np.stack([x, z], axis=-1)


def _vault() -> Points:
    arc = _arc()
    y = np.linspace(HALF_Y_M, -HALF_Y_M, round(2 * HALF_Y_M / CELL_M) + 1)
    points = np.empty((len(arc), len(y), 3))
    points[..., 0], points[..., 1], points[..., 2] = arc[:, :1], y, arc[:, 1:]
    return points


def _end_wall(y_m: float) -> Points:
    """A wall under the vault: its rows are bent like the vault."""
    arc = _arc() if y_m > 0 else _arc()[::-1]
    share = np.linspace(1, 0, 31)[:, None]
    points = np.empty((len(share), len(arc), 3))
    points[..., 0], points[..., 1], points[..., 2] = arc[:, 0], y_m, share * arc[:, 1]
    return points


def _walls(rng: Generator) -> Item:
    x, y = HALF_X_M, HALF_Y_M
    west = partial(materials.wainscot, colour=(0.45, 0.58, 0.5), lower=(0.3, 0.32, 0.36), height_m=1.0, grain=0.03)
    east = partial(materials.wainscot, colour=(0.78, 0.5, 0.32), lower=(0.42, 0.2, 0.16), height_m=1.0, grain=0.03)
    altar = partial(murals.mural, ground=(0.5, 0.36, 0.2), sky=(0.75, 0.6, 0.3), figures=6)
    ashlar = ((0.62, 0.56, 0.48), (0.55, 0.5, 0.45), (0.66, 0.62, 0.55))
    portal = partial(materials.masonry, palette=ashlar, block_m=(0.5, 0.26))
    surfaces = (
        (upright((-x, -y), (-x, y), 0, SPRING_M, CELL_M), west),
        (upright((x, y), (x, -y), 0, SPRING_M, CELL_M), east),
        (_end_wall(y), altar),
        (_end_wall(-y), portal),
    )
    return Item(tuple(paint(rng, bumpy(rng, points, 0.008), p, 120) for points, p in surfaces))


def _vault_and_floor(rng: Generator) -> Item:
    vault = partial(murals.starry_vault, first=(0.62, 0.3, 0.22), second=(0.14, 0.24, 0.55))
    floor = level((-HALF_X_M, HALF_X_M), (-HALF_Y_M, HALF_Y_M), 0, CELL_M)
    return Item((
        paint(rng, bumpy(rng, _vault(), 0.012), vault, 130),
        paint(rng, bumpy(rng, floor, 0.003), _floor, 150),
    ))  # fmt: skip


def _floor(canvas: Canvas) -> Pixels:
    """Chequered marble, darker towards the portal, with a red runner and two tomb slabs."""
    x, y = canvas.coordinates_m()
    light = materials.marble(canvas, (0.74, 0.7, 0.62), (0.5, 0.45, 0.4))
    dark = materials.marble(canvas, (0.3, 0.2, 0.18), (0.6, 0.5, 0.45))
    check = (np.floor(x / 0.5) + np.floor(y / 0.5)) % 2
    image = np.where((check > 0)[..., None], light, dark)
    joint = np.minimum(np.abs((x + 0.25) % 0.5 - 0.25), np.abs((y + 0.25) % 0.5 - 0.25)) < 0.005
    image[joint] *= np.float32(0.5)
    runner = np.abs(x - HALF_X_M) < 0.28
    red = materials.rug(canvas, ((0.55, 0.08, 0.1), (0.75, 0.55, 0.2), (0.45, 0.05, 0.08)))
    image = np.where(np.broadcast_to(runner[..., None], image.shape), red, image)
    for slab_x, slab_y in ((0.75, 6.2), (4.8, 3.4)):
        slab = (np.abs(x - slab_x) < 0.4) & (np.abs(y - slab_y) < 0.8)
        image[slab] *= np.float32((0.75, 0.85, 0.95))
    return np.asarray(image, np.float32)


def _side_walls(rng: Generator) -> Item:
    """Six bays between pilasters: two windows and four frescoes."""
    scenes: tuple[tuple[Colour, Colour], ...] = (
        ((0.3, 0.42, 0.2), (0.55, 0.7, 0.85)), ((0.55, 0.25, 0.15), (0.9, 0.75, 0.45)),
        ((0.2, 0.3, 0.45), (0.8, 0.82, 0.85)), ((0.45, 0.38, 0.15), (0.35, 0.5, 0.75)),
    )  # fmt: skip
    things = []
    for (x, y, yaw), (ground, sky) in zip(
        ((HALF_X_M, BAYS_Y_M[0], -90), (HALF_X_M, BAYS_Y_M[1], -90), (HALF_X_M, BAYS_Y_M[2], -90),
         (-HALF_X_M, BAYS_Y_M[2], 90)), scenes, strict=True,
    ):  # fmt: skip
        fresco = partial(murals.mural, ground=ground, sky=sky)
        things.append(on_wall(rng, (x, y, 1.77), yaw, (2.1, 1.4), fresco, 270))
    for y in BAYS_Y_M[:2]:
        things.append(on_wall(rng, (-HALF_X_M, y, 1.75), 90, (1.0, 1.4), pictures.stained_glass, 260, 0.03, 0.85))
    for x, yaw in ((-HALF_X_M, 90), (HALF_X_M, -90)):
        for y in (-4.1, *COLUMNS_Y_M, 3.9):
            pilaster = box(rng, (0.3, 0.12, SPRING_M), STONE, 120, "flr")
            things.append(pilaster.placed(x - np.sign(x) * 0.06, y, 0, yaw))
    return joined(things)


def _portal_wall(rng: Generator) -> Item:
    """Portal, rose window, confessional and font at the far end."""
    y = -HALF_Y_M
    frame = [box(rng, (0.22, 0.14, 2.3), ROSE, 140, "flrt").placed(x, y + 0.07, 0, 180) for x in (-0.95, 0.95)]
    lintel = box(rng, (2.3, 0.2, 0.25), ROSE, 140, "fblrtu").placed(0, y + 0.1, 2.3, 180)
    leaves = [
        on_wall(rng, (x, y, 1.15), 180, (0.84, 2.3), partial(fronts.door, colour=(0.32, 0.18, 0.09)), 180, 0.05)
        for x in (-0.42, 0.42)
    ]
    booth = furniture.cabinet(rng, (1.1, 0.6, 2.05), (0.4, 0.2, 0.1), 3).placed(-1.95, y + 0.31, 0, 180)
    basin = [(0.05, 0.9), (0.22, 0.95), (0.25, 0.92), (0.08, 0.75), (0.07, 0.2), (0.2, 0.08), (0.2, 0)]
    font = turned(rng, basin, STONE, 150, 18).placed(1.7, y + 0.5)
    notices = on_wall(rng, (1.95, y, 1.6), 180, (0.8, 0.9), pictures.noticeboard, 250)
    return joined([*frame, lintel, *leaves, booth, font, notices, _rose_window(rng, y + 0.03, 3.15, 0.55)])


def _rose_window(rng: Generator, y_m: float, z_m: float, radius_m: float) -> Item:
    """A round window: a polar grid, so the glass cells spread from its middle."""
    angle = np.linspace(0, -2 * np.pi, 25)
    points = np.empty((6, 25, 3))
    for row, radius in enumerate(np.linspace(radius_m, 0.01, 6)):
        points[row] = np.stack(
            [-radius * np.cos(angle), np.full(25, y_m), z_m + radius * np.sin(angle)], axis=-1
        )
    glass = partial(pictures.stained_glass, cells=90)
    rim = [(radius_m * np.cos(a), y_m + 0.02, z_m + radius_m * np.sin(a)) for a in angle]
    return Item((paint(rng, points, glass, 200, 0.85), tube(rng, rim, 0.05, STONE, 120)))


def _altar(rng: Generator) -> Item:
    """Steps, table, candles and a gilded altar piece with three painted panels."""
    gold, cloth = fronts.gilded, partial(materials.fabric, colour=(0.9, 0.88, 0.8), stripe=(0.75, 0.6, 0.2))
    steps = [
        box(rng, (3.4, 1.2, 0.14), ROSE, 140, "flrt").placed(0, 3.65),
        box(rng, (2.6, 0.9, 0.14), STONE, 140, "flrt").placed(0, 3.8, 0.14),
    ]
    table = box(rng, (1.5, 0.5, 0.75), cloth, 160, "flrt").placed(0, 3.65, 0.28)
    back = box(rng, (3.1, 0.12, 2.75), gold, 130, "flrt").placed(0, 4.18, 0.28)
    panels = [
        on_wall(rng, (x, 4.12, z), 0, size, partial(murals.mural, ground=ground, sky=sky, figures=n), 300, 0.03)
        for x, z, size, ground, sky, n in (
            (-1.05, 1.75, (0.75, 1.7), (0.5, 0.15, 0.15), (0.8, 0.6, 0.3), 1),
            (0.0, 1.95, (1.05, 1.9), (0.1, 0.2, 0.45), (0.55, 0.75, 0.95), 3),
            (1.05, 1.75, (0.75, 1.7), (0.15, 0.35, 0.2), (0.9, 0.8, 0.5), 1),
        )
    ]
    shaft = [(0.12, 2.75), (0.12, 2.68), (0.07, 2.6), (0.085, 1.7), (0.07, 0.95), (0.12, 0.85), (0.12, 0.3)]
    posts = [turned(rng, shaft, gold, 130, 12).placed(x, 4.0) for x in (-1.5, -0.6, 0.6, 1.5)]
    crown = box(rng, (3.3, 0.22, 0.16), gold, 140).placed(0, 4.1, 2.85)
    top = on_wall(rng, (0, 4.2, 3.3), 0, (0.9, 0.55), partial(murals.mural, ground=(0.7, 0.5, 0.2), sky=(0.95, 0.85, 0.5), figures=1), 260, 0.06)
    wax = partial(materials.flat, colour=(0.95, 0.92, 0.8))
    candles = [
        turned(rng, [(0.006, 0.36), (0.02, 0.32), (0.02, 0.0)], wax, 80, 8, casts=False).placed(x, 3.75, 1.03)
        for x in (-0.6, -0.4, -0.2, 0.2, 0.4, 0.6)
    ]
    flowers = [furniture.plant(rng, 0.45, (0.75, 0.6, 0.25), 30).placed(x, 3.3, 0.14) for x in (-1.25, 1.2)]
    return joined([*steps, table, back, *panels, *posts, crown, top, *candles, *flowers])


def _pews(rng: Generator) -> Item:
    rows = np.linspace(-2.9, 1.6, 6)
    return joined(furniture.pew(rng, 1.15).placed(x, y) for y in rows for x in (-0.98, 0.98))


def _columns(rng: Generator) -> Item:
    """Four free columns under two beams, and ribs across the vault."""
    profile = [
        (0.2, 2.6), (0.2, 2.5), (0.13, 2.4), (0.125, 1.8), (0.13, 1.1), (0.135, 0.35), (0.19, 0.25), (0.21, 0.0),
    ]  # fmt: skip
    paints = (STONE, ROSE, partial(materials.marble, colour=(0.3, 0.42, 0.36), vein=(0.75, 0.78, 0.7)),
              partial(materials.marble, colour=(0.28, 0.3, 0.4), vein=(0.7, 0.7, 0.75)))  # fmt: skip
    places = [(x, y) for x in (-COLUMN_X_M, COLUMN_X_M) for y in COLUMNS_Y_M]
    columns = [turned(rng, profile, p, 170, 18).placed(x, y) for p, (x, y) in zip(paints, places, strict=True)]
    frieze = partial(materials.masonry, palette=murals.ROBES, block_m=(0.25, 0.11), joint=murals.GOLD, joint_m=0.02)
    beams = [box(rng, (2 * HALF_Y_M, 0.24, 0.22), frieze, 130).placed(x, 0, 2.6, 90) for x in (-COLUMN_X_M, COLUMN_X_M)]
    arc = _arc(0.09)
    ribs = [
        Item((tube(rng, np.stack([arc[:, 0], np.full(len(arc), y), arc[:, 1]], axis=-1), 0.09, STONE, 100),))
        for y in (-4.1, *COLUMNS_Y_M, 3.9)
    ]
    return joined([*columns, *beams, *ribs])


def _statues(rng: Generator) -> Item:
    """Robed figures on pedestals beside the altar and near the portal."""
    body = [
        (0.01, 1.08), (0.07, 1.04), (0.08, 0.96), (0.05, 0.9), (0.16, 0.84), (0.17, 0.7), (0.13, 0.5), (0.2, 0.0),
    ]  # fmt: skip
    things = []
    for x, y, colour in ((-2.3, 3.4, (0.2, 0.3, 0.65)), (2.3, 3.4, (0.65, 0.15, 0.15)), (2.45, -1.4, (0.8, 0.78, 0.7))):
        robe = partial(materials.fabric, colour=colour, stripe=murals.GOLD, pitch_m=0.25)
        things.append(turned(rng, body, robe, 170, 16).placed(x, y, 0.8))
        things.append(box(rng, (0.42, 0.42, 0.8), STONE, 140, "fblrt").placed(x, y))
    return joined(things)


def _chandelier(rng: Generator) -> Item:
    angle = np.linspace(0, 2 * np.pi, 17)
    brass = partial(materials.flat, colour=(0.75, 0.58, 0.22))
    ring = tube(rng, np.stack([0.4 * np.cos(angle), 0.4 * np.sin(angle) - 0.3, np.full(17, 2.85)], -1), 0.03, brass, 90)
    chain = tube(rng, [(0, -0.3, CROWN_M - 0.02), (0, -0.3, 3.3), (0, -0.3, 2.85)], 0.015, brass, 60, 6)
    spokes = [tube(rng, [(0.4 * c, 0.4 * s - 0.3, 2.85), (0.2 * c, 0.2 * s - 0.3, 3.05), (0, -0.3, 3.3)], 0.012, brass, 60, 5) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    return Item((ring, chain, *spokes))
