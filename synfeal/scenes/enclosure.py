"""What surrounds a room when light is baked, and the ambient light within."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synfeal.scenes.canvas import Colour
from synfeal.scenes.patches import Block

THICKNESS_M = 0.2


def shell_blocks(lower_m: ArrayLike, upper_m: ArrayLike) -> list[Block]:
    """Six slabs around a box, which darken the corners of the room in it."""
    lower, upper = np.asarray(lower_m, float), np.asarray(upper_m, float)
    slabs = []
    for axis in range(3):
        for side, bound in ((-1, lower), (1, upper)):
            centre = (lower + upper) / 2
            half = (upper - lower) / 2 + THICKNESS_M
            centre[axis] = bound[axis] + side * THICKNESS_M / 2
            half[axis] = THICKNESS_M / 2
            slabs.append(Block(centre, half))
    return slabs


def ambient_corners(
    near_left: Colour, far_left: Colour, near_right: Colour, far_right: Colour, top: float
) -> NDArray[np.float32]:
    """Ambient light (2, 2, 2, 3) by x, y, z from the colours at the corners of the floor.

    ``left`` and ``right`` are low and high x, ``near`` and ``far`` low and high y; the light at the
    ceiling is ``top`` times that at the floor.
    """
    floor = np.array([[near_left, far_left], [near_right, far_right]], np.float32)
    return np.stack([floor, np.float32(top) * floor], axis=2)
