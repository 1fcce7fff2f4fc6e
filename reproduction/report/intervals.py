"""Numbers of tables with 95 % limits, and how they are written.

Limits of published cells that were combined from several training runs by the normal distribution
are widened to Student's t here.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from reproduction.statistics.limits import PATHS_AND_SEEDS
from reproduction.statistics.seeds import borrowed_deviations, half_width

NORMAL_95 = 1.96  # what limits were combined with before `limits_of` was a column


class Interval(NamedTuple):
    """A value and its 95 % limits."""

    value: float
    low: float
    high: float

    def __truediv__(self, other: Interval) -> Interval:
        """Divide as if both were independent and log-normal."""
        value = self.value / other.value
        below = math.hypot(math.log(self.value / self.low), math.log(other.high / other.value))
        above = math.hypot(math.log(self.high / self.value), math.log(other.value / other.low))
        return Interval(value, value * math.exp(-below), value * math.exp(above))


def cell_interval(row: Any, measure: str) -> Interval:
    """Return a cell of a published table with limits over test paths and training runs.

    Args:
        row: Row of one of tables 2 to 7, or of a reference method, which trains nothing.
        measure: Name of its error.
    """
    value, low, high, sd = (
        float(getattr(row, f"{measure}{end}", math.nan)) for end in ("", "_low", "_high", "_sd")
    )
    below, above = value - low, high - value
    n_seeds = int(row.n_seeds)
    if getattr(row, "model", "") == "" or getattr(row, "limits_of", "") == PATHS_AND_SEEDS:
        return Interval(value, low, high)
    if n_seeds > 1:
        error, degrees = sd / math.sqrt(n_seeds), float(n_seeds - 1)
        normal = NORMAL_95 * error
        below, above = (math.sqrt(max(d**2 - normal**2, 0.0)) for d in (below, above))
    else:
        lent = borrowed_deviations()[row.model, measure]
        error, degrees = lent.relative_sd * value, float(lent.degrees_of_freedom)
    low, high = value - half_width(below, error, degrees), value + half_width(above, error, degrees)
    return Interval(value, low, high)


def change_text(factor: float) -> str:
    """Format a factor as a change in percent; none of a number that is not finite."""
    if not math.isfinite(factor):
        return "unknown"
    change = round(100 * (factor - 1))  # an integer has no minus zero
    return f"{change:+d} %".replace("-", "−") if change else "0 %"


def signed(number: float) -> str:
    """Format a number with its sign, to two digits."""
    return f"{number:+.2f}".replace("-", "−")


def percent(interval: Interval) -> str:
    """Format a factor with its limits as a change in percent."""
    value, low, high = map(change_text, interval)
    return f"{value} ({low.removesuffix(' %')} to {high})"
