"""Samples as text: values and limits of a claim's row, position before orientation."""

from __future__ import annotations

import math
from collections.abc import Sequence

from synfeal.bootstrap import Array, limits
from synfeal.report.claims.model import FAILS, HOLDS, Claim, Verdict

PERCENT = ("p {:+.1f} %", "o {:+.1f} %")
ERRORS = ("p {:.2f} m", "o {:.2f}°")


def values_text(forms: Sequence[str], samples: Sequence[Array]) -> str:
    """Observed values, e.g. ``p -55.0 %, o -60.0 %``."""
    return ", ".join(_print(form, float(s[0])) for form, s in zip(forms, samples, strict=True))


def limits_text(forms: Sequence[str], samples: Sequence[Array]) -> str:
    """95 % limits, e.g. ``p -60.1 % to -40.2 %, o -70.0 % to -50.0 %``."""
    pairs = [limits(sample) for sample in samples]
    ends = [
        (_print(form, low), _print(form.partition(" ")[2], high))
        for form, (low, high) in zip(forms, pairs, strict=True)
    ]
    return ", ".join(f"{low} to {high}" for low, high in ends)


def conditions_text(parts: Sequence[Verdict]) -> str:
    """How many conditions of a claim came out in which way."""
    borne_out, refuted = parts.count(HOLDS), parts.count(FAILS)
    undecided = len(parts) - borne_out - refuted
    return (
        f"of {len(parts)} conditions {borne_out} borne out, {refuted} refuted, "
        f"{undecided} undecided"
    )


def reached_text(changes: Sequence[Array], claim: Claim, parts: Sequence[Verdict]) -> str:
    """How position and orientation stand against the published figures, and against no change."""
    whole = zip(("position", "orientation"), changes, claim.numbers, parts, strict=True)
    return ", ".join(f"{name} {_reached(change, n, part)}" for name, change, n, part in whole)


def _reached(change: Array, published: float, part: Verdict) -> str:
    if part == HOLDS:
        return "as published or more"
    low, high = limits(change if published > 0 else -change)
    direction = " and the other way" if high < 0 else " and not told from no change"
    size = "short of the published" if part == FAILS else "not told from the published"
    return size + ("" if low > 0 else direction)


def _print(form: str, value: float) -> str:
    return form.format(value) if math.isfinite(value) else _unmeasured(form, value)


def _unmeasured(form: str, value: float) -> str:
    """A value that is no number: infinite where a run failed, unknown where two did."""
    name = form.partition("{")[0]
    if math.isnan(value):
        return f"{name}unknown"
    return f"{name}{'+' if value > 0 else '-'}infinite"
