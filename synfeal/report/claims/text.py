"""Samples as text: values and limits of a claim's row, position before orientation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from synfeal.bootstrap import Array, limits

PERCENT = ("p {:+.1f} %", "o {:+.1f} %")
# Positions in the paper's unit, the root mean square over the axes.
ERRORS = ("p {:.2f} m RMS", "o {:.2f}°")


def values_text(forms: Sequence[str], samples: Iterable[Array]) -> str:
    """Observed values, e.g. ``p -55.0 %, o -60.0 %``."""
    return ", ".join(_print(form, float(s[0])) for form, s in zip(forms, samples, strict=True))


def limits_text(forms: Sequence[str], samples: Iterable[Array]) -> str:
    """95 % limits, e.g. ``p -60.1 % to -40.2 %, o -70.0 % to -50.0 %``."""
    pairs = [limits(sample) for sample in samples]
    ends = [
        (_print(form, low), _print(form.partition(" ")[2], high))
        for form, (low, high) in zip(forms, pairs, strict=True)
    ]
    return ", ".join(f"{low} to {high}" for low, high in ends)


def _print(form: str, value: float) -> str:
    return form.format(value) if math.isfinite(value) else _unmeasured(form, value)


def _unmeasured(form: str, value: float) -> str:
    """A value that is no number: infinite where a run failed, unknown where two did."""
    name = form.partition("{")[0]
    if math.isnan(value):
        return f"{name}unknown"
    return f"{name}{'+' if value > 0 else '-'}infinite"
