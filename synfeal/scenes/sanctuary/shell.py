"""Walls, vault and floor of the nave."""

from __future__ import annotations

from functools import partial

import numpy as np

from synfeal.scenes import materials, murals
from synfeal.scenes.canvas import Canvas, Painter, Pixels
from synfeal.scenes.patches import Item, Points, paint
from synfeal.scenes.primitives import level, upright

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
