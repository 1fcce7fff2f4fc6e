"""Claims, and the rules that turn samples into verdicts. There is no other way to a verdict.

Every condition of a claim is an effect in percent, positive in the direction the paper claims. Its
95 % interval is compared with four regions, as in equivalence testing (Lakens, "Equivalence Tests",
Social Psychological and Personality Science 2017): an effect smaller than the smallest of interest
is none; at least two thirds of the published one is a replication. The verdict is the region the
whole interval lies in, and *undecided* where it lies in none, so that a narrower interval can only
be nearer to the right verdict: two one-sided tests at 2.5 % each.

=================================== ====================================================
interval                            verdict
=================================== ====================================================
at or above 2/3 of the published    holds (where no size was published: above `smallest`)
from `smallest` to that             same direction but smaller
within ± `smallest`                 no effect
at or below -`smallest`             opposite
below 2/3 of the published alone    smaller than published
=================================== ====================================================

The last is coarser than those above it, and takes what none of them does: the published effect is
not replicated, and whether there is a smaller one stays open (an informative failure, as Simonsohn
calls it in "Small Telescopes", Psychological Science 2015). It needs a published size.

A claim of several conditions holds when all do. It is refuted by one that is decided otherwise at
the level corrected for their number (Bonferroni); then the verdict is that condition's, *smaller
than published* where one is that and the others are refuted too, none as opposite, else *mixed*.

A claim about every localizer is judged by the mean effect over the localizers, which a few runs
can settle; that of a single localizer can refute the claim, at the corrected level, and only that.
Asking all of 30 single intervals to exclude no effect would leave true and false claims undecided
alike at any number of runs that somebody can pay for.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import NamedTuple

from synfeal.bootstrap import Array, limits
from synfeal.frames import read_records
from synfeal.report.cells import FOLDER


class Verdict(StrEnum):
    """What a run makes of a claim; :func:`verdict_of` has the rules."""

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


# Percent. The paper prints 0.01 m, which is 5 % of its median cell, 0.20 m: it resolves no less.
SMALLEST = 5.0
ENOUGH = 2 / 3
REFUTED = (Verdict.SMALLER, Verdict.NO_EFFECT, Verdict.LESS, Verdict.OPPOSITE)


class Condition(NamedTuple):
    """One effect that a claim asserts."""

    name: str  # in the reason of the verdict
    effect: Array  # sample, percent, positive in the claimed direction
    published: float = 0.0  # its size in print, percent; 0 where the paper claims a direction alone
    smallest: float = SMALLEST  # effect below which there is none; 0 for a mere order


def verdict_of(condition: Condition, comparisons: int = 1) -> Verdict:
    """The region an effect's interval lies in; ``comparisons``: conditions it is one of."""
    low, high = limits(condition.effect, comparisons)
    smallest = condition.smallest
    enough = max(ENOUGH * abs(condition.published), smallest)
    if low >= enough and low > 0:
        return Verdict.HOLDS
    if high <= -smallest and high < 0:
        return Verdict.OPPOSITE
    if -smallest <= low and high <= smallest:
        return Verdict.NO_EFFECT
    if smallest <= low and high <= enough:
        return Verdict.SMALLER
    return Verdict.LESS if condition.published and high <= enough else Verdict.UNDECIDED


def all_of(conditions: Sequence[Condition], each: Sequence[Condition] = ()) -> tuple[Verdict, str]:
    """The verdict of a claim that all conditions make, and how each of them came out.

    Args:
        conditions: all of them have to hold.
        each: what the conditions are means of: none of them may be decided otherwise.
    """
    parts = [verdict_of(condition) for condition in conditions]
    corrected = [verdict_of(condition, len(conditions)) for condition in conditions]
    single = [verdict_of(condition, len(each)) for condition in each]
    refuted = {part for part in (*corrected, *single) if part in REFUTED}
    if refuted:
        verdict = Verdict.MIXED if Verdict.HOLDS in (*parts, *single) else _together(refuted)
    else:
        verdict = Verdict.HOLDS if {*parts} == {Verdict.HOLDS} else Verdict.UNDECIDED
    against = "".join(
        f"; single ones {part}: {', '.join(names)}"
        for part, names in _by_part(each, single)
        if part in REFUTED
    )
    return verdict, _parts_text(conditions, parts) + against


def _together(refuted: set[Verdict]) -> Verdict:
    """One verdict for conditions that are refuted, each in its way."""
    if len(refuted) == 1:
        return next(iter(refuted))
    less = Verdict.LESS in refuted and Verdict.OPPOSITE not in refuted
    return Verdict.LESS if less else Verdict.MIXED


def at_least(sample: Array, number: float) -> Verdict:
    """Whether the interval of a sample lies at ``number`` or above."""
    return compared(*limits(sample), number)


def compared(low: float, high: float, number: float) -> Verdict:
    """Holds: an interval starts at ``number`` or above. Opposite: it ends below it."""
    if low >= number:
        return Verdict.HOLDS
    return Verdict.OPPOSITE if high < number else Verdict.UNDECIDED


def _parts_text(conditions: Sequence[Condition], parts: Sequence[Verdict]) -> str:
    """How the conditions came out: by name, or how many of them where they have none."""
    if len(conditions) <= 2:
        texts = [f"{c.name}: {part}" for c, part in zip(conditions, parts, strict=True)]
        return ", ".join(texts)
    if not all(condition.name for condition in conditions):
        counts = Counter(parts).most_common()
        return f"of {len(parts)} conditions " + ", ".join(f"{n} {part}" for part, n in counts)
    return "; ".join(f"{part}: {', '.join(names)}" for part, names in _by_part(conditions, parts))


def _by_part(
    conditions: Sequence[Condition], parts: Sequence[Verdict]
) -> list[tuple[Verdict, list[str]]]:
    """The names of the conditions that came out in each way."""
    pairs = list(zip(conditions, parts, strict=True))
    return [(part, [c.name for c, own in pairs if own == part]) for part in dict.fromkeys(parts)]
