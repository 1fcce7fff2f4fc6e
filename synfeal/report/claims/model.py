"""A claim of the paper, what a run has to say about it, and samples as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache

from synfeal.bootstrap import Array, limits
from synfeal.frames import read_records
from synfeal.report.cells import FOLDER


class Verdict(StrEnum):
    """What a run makes of a claim; ``verdicts.py`` has the rules."""

    HOLDS = "holds"
    SMALLER = "same direction but smaller"
    MIXED = "mixed"
    NO_EFFECT = "no effect"
    LESS = "smaller than published"
    OPPOSITE = "opposite"
    UNDECIDED = "undecided"
    NOT_LEARNT = "not learnt at this scale"
    NOT_TESTABLE = "not testable here"


@dataclass(frozen=True)
class Claim:
    """One claim as printed."""

    id: str  # ``C1`` to ``C16``
    section: str  # of the paper
    statement: str  # the claim in our words
    published: str  # its figures, as printed
    numbers: tuple[float, ...]  # those of the figures that the test compares with
    test: str  # how it is tested and by which rule it is decided
    footnote: str  # what is wrong or unclear in print, else empty


@dataclass(frozen=True)
class Outcome:
    """What a run says about a claim, under one of the two scores."""

    verdict: Verdict  # decided by the rule of the claim's test
    measured: str = ""  # the statistic, as text
    interval: str = ""  # its 95 % limits, as text; empty where it has none
    reason: str = ""  # why the verdict is not the other one


class Missing(Exception):  # noqa: N818 - not an error: it ends in the verdict `not testable here`
    """The profile does not make what a test needs; the message says what."""


@cache
def published_claims() -> tuple[Claim, ...]:
    """The claims of the paper, in its order."""
    rows = [row for _, row in read_records(FOLDER / "claims.csv")]
    return tuple(
        Claim(numbers=tuple(map(float, row.pop("numbers").split())), **row) for row in rows
    )


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
    """A value; infinite where a run failed, unknown where two did."""
    if math.isfinite(value):
        return form.format(value)
    name = form.partition("{")[0]
    return f"{name}unknown" if math.isnan(value) else f"{name}{'+' if value > 0 else '-'}infinite"
