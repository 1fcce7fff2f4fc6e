"""The rules that turn samples into verdicts. There is no other way to a verdict.

A claim often consists of several conditions, all of which have to be met. It *holds* when the 95 %
interval of every condition does; it *does not hold* when one condition is refuted, at the level
corrected for their number (Bonferroni), which keeps the risk of a false refutation near 5 %. No
correction is needed for *holds*: all conditions have to pass. Everything else is undecided.
"""

from __future__ import annotations

from collections.abc import Sequence

from synfeal.bootstrap import Array, limits
from synfeal.report.claims.model import FAILS, HOLDS, UNDECIDED, Verdict

MARGIN = 0.2
# Half a unit of the last printed digit of a published percentage.
ROUNDING = 0.5


def all_of(parts: Sequence[Verdict]) -> Verdict:
    """Of conditions that must all be met: refuted by one, borne out only by all."""
    if FAILS in parts:
        return FAILS
    return HOLDS if all(part == HOLDS for part in parts) else UNDECIDED


def below_zero(sample: Array, comparisons: int = 1) -> Verdict:
    """Holds: interval wholly below 0. Does not hold: wholly above. ``comparisons``: conditions."""
    if limits(sample)[1] < 0:
        return HOLDS
    return FAILS if limits(sample, comparisons)[0] > 0 else UNDECIDED


def reaches(change: Array, published: float, comparisons: int = 1) -> Verdict:
    """Whether a change of the published sign is as large as published, or larger.

    Holds: the interval lies wholly on the published side of 0, and reaches the published change or
    goes beyond it. Does not hold: it ends short of the published change. Undecided: it holds both
    the published change and none at all. Both in percent; the published one is a whole number, so
    half a percent short of it still reaches it.
    """
    sign = 1 if published > 0 else -1
    wanted = sign * published - ROUNDING
    if limits(sign * change, comparisons)[1] < wanted:
        return FAILS
    low, high = limits(sign * change)
    return HOLDS if low > 0 and high >= wanted else UNDECIDED


def near(sample: Array, published: float, comparisons: int = 1) -> Verdict:
    """Holds: interval wholly within 20 % of the published value. Does not hold: wholly outside."""
    bounds = published * (1 - MARGIN), published * (1 + MARGIN)
    low, high = limits(sample)
    if bounds[0] <= low and high <= bounds[1]:
        return HOLDS
    low, high = limits(sample, comparisons)
    return FAILS if high < bounds[0] or bounds[1] < low else UNDECIDED


def at_least(sample: Array, number: float) -> Verdict:
    """Holds: interval starts at ``number`` or above. Does not hold: it ends below it."""
    low, high = limits(sample)
    if low >= number:
        return HOLDS
    return FAILS if high < number else UNDECIDED
