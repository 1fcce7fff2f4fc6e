"""The ambient light within a room."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from synfeal.scenes.canvas import Colour


def ambient_corners(
    near_left: Colour, far_left: Colour, near_right: Colour, far_right: Colour, top: float
) -> NDArray[np.float32]:
    """Ambient light (2, 2, 2, 3) by x, y, z from the colours at the corners of the floor.

    ``left`` and ``right`` are low and high x, ``near`` and ``far`` low and high y; the light at the
    ceiling is ``top`` times that at the floor.
    """
    floor = np.array([[near_left, far_left], [near_right, far_right]], np.float32)
    return np.stack([floor, np.float32(top) * floor], axis=2)
