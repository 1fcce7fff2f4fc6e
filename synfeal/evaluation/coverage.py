"""Stated errors: do as many poses lie within their radii as the radii say?

A pose may come with two radii, which are said to hold its error with a probability of 68 and of
95 %. Radii of other levels follow from the Weibull distribution through the two, which is exact for
normal errors in a plane and near to it for those in space; heavier tails have a wider distance
between the two. Stated radii are judged by two numbers at each level: the share of the errors that
they hold, and how wide they are beside the narrowest that would hold as many as they say,
all stretched alike.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Shares of a normal distribution within one standard deviation, and what people ask for.
SD_LEVEL, WIDE_LEVEL = 0.6827, 0.95
LEVELS = (0.5, SD_LEVEL, 0.8, 0.9, WIDE_LEVEL, 0.99)


class Coverage(NamedTuple):
    """Fit of the stated radii of one level to the errors.

    Attributes:
        level: Share of the errors that they are said to hold.
        held: Share that they hold.
        width: Stated over needed: the factor by which they are wider than the narrowest that hold
            this share, all stretched alike; below 1 they are too narrow.
    """

    level: float
    held: float
    width: float


def radii(level: float, sd: Array, wide: Array) -> Array:
    """Compute the radii (N,) of a level from those of 68 and of 95 %.

    Args:
        level: Between 0 and 1.
        sd: Radii (N,) of 68 %.
        wide: Radii (N,) of 95 %.
    """
    depth = [-math.log1p(-share) for share in (level, SD_LEVEL, WIDE_LEVEL)]
    exponent = math.log(depth[0] / depth[2]) / math.log(depth[2] / depth[1])
    return np.asarray(wide * (wide / sd) ** exponent)


def coverage(error: Array, sd: Array, wide: Array) -> list[Coverage]:
    """Compare errors with their stated radii at each of ``LEVELS``.

    Args:
        error: Errors (N,), at least one; infinite where there is no pose.
        sd: Stated radii (N,) of 68 %, above 0.
        wide: Stated radii (N,) of 95 %, above 0.
    """
    found = []
    for level in LEVELS:
        relative = np.sort(error / radii(level, sd, wide))
        needed = float(relative[math.ceil(level * len(relative)) - 1])
        found.append(
            Coverage(
                level=level,
                held=float(np.mean(relative <= 1.0)),
                width=1.0 / needed if needed > 0 else math.inf,
            )
        )
    return found
