"""Numbers with the unit that suits them."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan

# The largest unit of which there are at least so many.
DURATIONS = ((48 * 3600.0, 86400.0, "d"), (5400.0, 3600.0, "h"), (90.0, 60.0, "min"), (0, 1.0, "s"))
SIZES = ((1e9, 1e9, "GB"), (0, 1e6, "MB"))


def duration(seconds: float) -> str:
    """Format seconds in the unit that suits them; nothing where they are not known."""
    return "" if isnan(seconds) else scaled(seconds, DURATIONS)


def scaled(value: float, units: Sequence[tuple[float, float, str]]) -> str:
    """Format a value in the first unit of which there are enough."""
    _, unit, name = next(u for u in units if value >= u[0])
    return f"{number(value / unit)} {name}"


def number(value: float) -> str:
    """Format two or three figures, without an exponent."""
    if value == 0:
        return "0"
    if value < 0.001:
        return "<0.001"
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2g}"
