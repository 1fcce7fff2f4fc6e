"""Claims, and the rules that turn samples into verdicts.

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
within ± `smallest`                 negligible
at or below -`smallest`             opposite
below 2/3 of the published alone    smaller than published
=================================== ====================================================

The last is coarser than those above it, and takes what none of them does: the published effect is
not replicated, and whether there is a smaller one stays open (an informative failure, as Simonsohn
calls it in "Small Telescopes", Psychological Science 2015). It needs a published size.

*Negligible* says that an effect is smaller than anybody cares for, not that there is none.

A claim of several conditions holds when all do. It is refuted by one that is decided otherwise at
the level corrected for their number (Bonferroni); then the verdict is that condition's, *smaller
than published* where one is that and the others are refuted too, none as opposite, else *mixed*.

A claim about every localizer is judged by the mean effect over the localizers, which a few runs
can settle; that of a single localizer can refute the claim, at the corrected level, and only that.
Asking all of 30 single intervals to exclude no effect would leave true and false claims undecided
alike at any number of runs that somebody can pay for.

A claim that one thing is the best of all holds when it is better than every other, and is *refuted*
by one that is better than it, at the level corrected for their number.

The numbers among the rules (:class:`Thresholds`) are our choice. Each claim is judged with others,
too, and says which of them would turn its verdict.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from typing import NamedTuple

from reproduction.statistics.seeds import Layout, limits
from reproduction.tables.cells import FOLDER
from synfeal.evaluation.bootstrap import Array
from synfeal.records.tables import read_records


class Verdict(StrEnum):
    """Judgement of a claim by a run; :func:`verdict_of` has the rules."""

    HOLDS = "holds"
    SMALLER = "same direction but smaller"
    MIXED = "mixed"
    NEGLIGIBLE = "negligible"
    LESS = "smaller than published"
    OPPOSITE = "opposite"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    NOT_LEARNT = "not learnt at this scale"
    NOT_TESTABLE = "not testable here"
    BY_CONSTRUCTION = "holds by construction"


# For a reader who has not read the rules.
MEANINGS = {
    Verdict.HOLDS: "the effect is as the paper says: at least two thirds of the printed size",
    Verdict.SMALLER: "there is such an effect, certainly below two thirds of the printed size",
    Verdict.MIXED: "part of the claim is borne out, part of it is not",
    Verdict.LESS: "certainly smaller than printed; whether there is an effect at all stays open",
    Verdict.NEGLIGIBLE: "if there is an effect, it is certainly smaller than 5 %",
    Verdict.OPPOSITE: "there certainly is an effect, the other way round",
    Verdict.REFUTED: "something else is certainly better than what is claimed to be the best",
    Verdict.UNDECIDED: "these runs cannot tell",
    Verdict.NOT_LEARNT: "the localizers have learnt too little for the question to make sense",
    Verdict.NOT_TESTABLE: "this set-up cannot answer the question",
    Verdict.BY_CONSTRUCTION: "true because it was built that way; nothing was found out",
}
# What the claims are about, and how verdict counts call them.
GROUPS = {
    "localization": "about localization",
    "labels": "about labels",
    "set-up": "about the set-up",
}


@dataclass(frozen=True)
class Claim:
    """One claim as printed."""

    id: str  # ``C1`` to ``C16``
    section: str  # of the paper
    group: str  # of ``GROUPS``
    statement: str  # the claim in our words
    published: str  # its figures, as printed
    numbers: tuple[float, ...]  # those of the figures that the test compares with
    test: str  # how it is tested and by which rule it is decided
    footnote: str  # what is wrong or unclear in print, else empty


@dataclass(frozen=True)
class Outcome:
    """Findings of a run about a claim, under one of the two scores."""

    verdict: Verdict  # decided by the rule of the claim's test
    measured: str = ""  # the statistic, as text
    interval: str = ""  # its 95 % limits, as text; empty where it has none
    reason: str = ""  # why the verdict is not the other one
    # By key of ``ALTERNATIVES``, the verdict where it would be another.
    turned: Mapping[str, Verdict] = field(default_factory=dict)
    dose: str = ""  # how large the compared labels' errors are, against those of the localizers


class Missing(Exception):  # noqa: N818 - not an error: it ends in the verdict `not testable here`
    """The profile does not make what a test needs; the message says what."""


@cache
def published_claims() -> tuple[Claim, ...]:
    """Read the claims of the paper, in its order."""
    rows = [row for _, row in read_records(FOLDER / "claims.csv")]
    return tuple(
        Claim(numbers=tuple(map(float, row.pop("numbers").split())), **row) for row in rows
    )


PERCENT = ("p {:+.1f} %", "o {:+.1f} %")
# Positions in the paper's unit, the root mean square over the axes.
ERRORS = ("p {:.2f} m RMS", "o {:.2f}°")


def values_text(forms: Sequence[str], samples: Iterable[Array]) -> str:
    """Format observed values, e.g. ``p -55.0 %, o -60.0 %``."""
    return ", ".join(_print(form, float(s[0])) for form, s in zip(forms, samples, strict=True))


def limits_text(forms: Sequence[str], samples: Iterable[Array], layout: Layout) -> str:
    """Format 95 % limits, e.g. ``p -60.1 % to -40.2 %, o -70.0 % to -50.0 %``.

    Args:
        forms: Format of each value with its name before it, such as ``PERCENT``.
        samples: One sample (B,) per format.
        layout: Layout of the samples.
    """
    pairs = [limits(sample, layout) for sample in samples]
    ends = [
        (_print(form, low), _print(form.partition(" ")[2], high))
        for form, (low, high) in zip(forms, pairs, strict=True)
    ]
    return ", ".join(f"{low} to {high}" for low, high in ends)


def _print(form: str, value: float) -> str:
    """Format a value; infinite where a run failed, unknown where two did."""
    if math.isfinite(value):
        return form.format(value)
    name = form.partition("{")[0]
    return f"{name}unknown" if math.isnan(value) else f"{name}{'+' if value > 0 else '-'}infinite"


class Thresholds(NamedTuple):
    """The numbers that verdicts depend on and the paper does not give."""

    # Percent. The paper prints 0.01 m, 5 % of its median cell, 0.20 m: it resolves no less.
    smallest: float = 5.0
    enough: float = 2 / 3  # share of the published effect that replicates it
    few: float = 1 / 3  # of the batches (C4)
    not_coping: float = 1 / 2  # of the batches (C15)


RULE = Thresholds()
# What a reader may prefer: if the verdict differs there, it hangs on the threshold.
ALTERNATIVES = {
    "smallest effect 2.5 %": RULE._replace(smallest=2.5),
    "smallest effect 10 %": RULE._replace(smallest=10.0),
    "replicated from 1/2": RULE._replace(enough=1 / 2),
    "replicated from 3/4": RULE._replace(enough=3 / 4),
    "few: a quarter": RULE._replace(few=1 / 4),
    "few: a half": RULE._replace(few=1 / 2),
    "not able to deal: a third": RULE._replace(not_coping=1 / 3),
    "not able to deal: two thirds": RULE._replace(not_coping=2 / 3),
}
DECIDED_AGAINST = (Verdict.SMALLER, Verdict.NEGLIGIBLE, Verdict.LESS, Verdict.OPPOSITE)


class Condition(NamedTuple):
    """One effect that a claim asserts."""

    name: str  # in the reason of the verdict
    effect: Array  # sample, percent, positive in the claimed direction
    layout: Layout  # of the sample
    published: float = 0.0  # its size in print, percent; 0 where the paper claims a direction alone
    is_order: bool = False  # by however little: no effect is too small


def verdict_of(condition: Condition, comparisons: int = 1) -> Verdict:
    """Judge an effect by where its interval lies beside no effect and the published one.

    Args:
        condition: Effect that a claim asserts.
        comparisons: Number of conditions it is one of, for Bonferroni's correction.

    Returns:
        The verdict; undecided where the interval spans several regions.
    """
    return _region(condition, limits(condition.effect, condition.layout, comparisons), RULE)


def _region(condition: Condition, interval: tuple[float, float], thresholds: Thresholds) -> Verdict:
    low, high = interval
    smallest = 0.0 if condition.is_order else thresholds.smallest
    enough = max(thresholds.enough * abs(condition.published), smallest)
    if low >= enough and low > 0:
        return Verdict.HOLDS
    if high <= -smallest and high < 0:
        return Verdict.OPPOSITE
    if -smallest <= low and high <= smallest:
        return Verdict.NEGLIGIBLE
    if smallest <= low and high <= enough:
        return Verdict.SMALLER
    return Verdict.LESS if condition.published and high <= enough else Verdict.UNDECIDED


class Judgement(NamedTuple):
    """A verdict, and what it hangs on."""

    verdict: Verdict
    reason: str
    turned: Mapping[str, Verdict] = {}  # by key of ``ALTERNATIVES``, where it would be another


def all_of(conditions: Sequence[Condition], each: Sequence[Condition] = ()) -> Judgement:
    """Judge a claim that holds if all conditions do, and say how each of them came out.

    Args:
        conditions: Conditions that all have to hold.
        each: Single effects that the conditions are means of: none may be decided otherwise.
    """
    levels = [(conditions, 1), (conditions, len(conditions)), (each, len(each))]
    intervals = [
        [limits(condition.effect, condition.layout, comparisons) for condition in of_level]
        for of_level, comparisons in levels
    ]

    def regions(thresholds: Thresholds) -> list[list[Verdict]]:
        return [
            [_region(c, span, thresholds) for c, span in zip(of_level, spans, strict=True)]
            for (of_level, _), spans in zip(levels, intervals, strict=True)
        ]

    parts, corrected, single = regions(RULE)
    verdict = _all_of(parts, corrected, single)
    others = {name: _all_of(*regions(other)) for name, other in ALTERNATIVES.items()}
    against = "".join(
        f"; single ones {part}: {', '.join(names)}"
        for part, names in _by_part(each, single)
        if part in DECIDED_AGAINST
    )
    turned = {name: other for name, other in others.items() if other != verdict}
    return Judgement(verdict, _parts_text(conditions, parts) + against, turned)


def _all_of(
    parts: Sequence[Verdict], corrected: Sequence[Verdict], single: Sequence[Verdict]
) -> Verdict:
    """Combine verdicts of conditions at 95 %, at the corrected level, and of single ones."""
    refuted = {part for part in (*corrected, *single) if part in DECIDED_AGAINST}
    if refuted:
        return Verdict.MIXED if Verdict.HOLDS in (*parts, *single) else _together(refuted)
    return Verdict.HOLDS if {*parts} == {Verdict.HOLDS} else Verdict.UNDECIDED


def _together(refuted: set[Verdict]) -> Verdict:
    """Combine the verdicts of conditions that are refuted, each in its way."""
    if len(refuted) == 1:
        return next(iter(refuted))
    less = Verdict.LESS in refuted and Verdict.OPPOSITE not in refuted
    return Verdict.LESS if less else Verdict.MIXED


def best_of(rivals: Sequence[Condition]) -> Judgement:
    """Judge a claim that one thing is better than every other.

    Args:
        rivals: For each of the others, by how much the one is better.
    """
    orders = [rival._replace(is_order=True) for rival in rivals]
    parts = [verdict_of(rival) for rival in orders]
    better = [r.name for r in orders if verdict_of(r, len(orders)) == Verdict.OPPOSITE]
    counts = Counter(parts)
    text = (
        f"better than {counts[Verdict.HOLDS]} of {len(parts)}, worse than"
        f" {counts[Verdict.OPPOSITE]}"
    )
    if better:
        return Judgement(Verdict.REFUTED, f"{text}; certainly worse than {'; '.join(better)}")
    holds = counts[Verdict.HOLDS] == len(parts)
    return Judgement(Verdict.HOLDS if holds else Verdict.UNDECIDED, text)


def compared(low: float, high: float, number: float) -> Verdict:
    """Compare an interval with a number that the paper says is reached.

    Args:
        low: Lower end of the interval.
        high: Its upper end.
        number: The number, in the unit of the interval.

    Returns:
        ``holds`` where the whole interval reaches it, ``opposite`` where all of it is below, else
        ``undecided``.
    """
    if low >= number:
        return Verdict.HOLDS
    return Verdict.OPPOSITE if high < number else Verdict.UNDECIDED


def _parts_text(conditions: Sequence[Condition], parts: Sequence[Verdict]) -> str:
    """List the outcomes of the conditions by name, or count them where they have none."""
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
    """Name the conditions that came out in each way."""
    pairs = list(zip(conditions, parts, strict=True))
    return [(part, [c.name for c, own in pairs if own == part]) for part in dict.fromkeys(parts)]
