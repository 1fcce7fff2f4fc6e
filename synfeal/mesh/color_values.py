"""Colours of vertices as files have them: 8 or 16 bits, fractions, and what only looks like one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

# Fractions overshoot 1 where they were interpolated or fitted, but not by that much.
MOST_FRACTION = 2.0


def rgb_of(values: ArrayLike) -> tuple[NDArray[np.uint8], str]:
    """Convert colours (N, 3) to 8 bits.

    Args:
        values: Unsigned integers of 8 bits as they are, everything else by its greatest value:
            fractions up to 1, levels up to 255, or levels up to 65535. NaN becomes white.

    Returns:
        Colours (N, 3), and what they were taken as, empty where there is no doubt.

    Raises:
        ValueError: They are larger than any of these.
    """
    stored = np.asarray(values)
    if stored.dtype == np.uint8:
        return stored, ""
    numbers = stored.astype(np.float64)
    largest = float(np.nanmax(numbers, initial=0.0))
    is_real = stored.dtype.kind == "f"
    if is_real and largest <= MOST_FRACTION:
        scale, taken = 255.0, ""
    elif largest <= 255.0:
        scale, taken = 1.0, "levels from 0 to 255"
    elif largest <= 65535.0:
        scale, taken = 1.0 / 257.0, "" if stored.dtype == np.uint16 else "levels from 0 to 65535"
    else:
        raise ValueError(f"its colours reach {largest:.6g}; write them as 8-bit levels")
    levels = np.nan_to_num(np.round(scale * numbers), nan=255.0)
    return np.clip(levels, 0.0, 255.0).astype(np.uint8), taken
