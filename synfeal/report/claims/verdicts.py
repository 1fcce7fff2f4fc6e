"""The rules that turn samples into verdicts. There is no other way to a verdict.

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
=================================== ====================================================

A claim of several conditions holds when all do. It is refuted by one that is decided otherwise at
the level corrected for their number (Bonferroni); then the verdict is that condition's, or *mixed*
where others hold or are refuted in another way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from synfeal.bootstrap import Array, limits
from synfeal.report.claims.model import (
    HOLDS,
    MIXED,
    NO_EFFECT,
    OPPOSITE,
    SMALLER,
    UNDECIDED,
    Verdict,
)

# Percent. The paper prints 0.01 m, which is 5 % of its median cell, 0.20 m: it resolves no less.
SMALLEST = 5.0
ENOUGH = 2 / 3
REFUTED = (SMALLER, NO_EFFECT, OPPOSITE)


class Condition(NamedTuple):
    """One effect that a claim asserts.

    Attributes:
        name: in the reason of the verdict.
        effect: sample, percent, positive in the claimed direction.
        published: its size in print, percent; 0 where the paper claims a direction alone.
        smallest: effect below which there is none; 0 for a mere order.
    """

    name: str
    effect: Array
    published: float = 0.0
    smallest: float = SMALLEST


def verdict_of(condition: Condition, comparisons: int = 1) -> Verdict:
    """The region an effect's interval lies in; ``comparisons``: conditions it is one of."""
    low, high = limits(condition.effect, comparisons)
    smallest = condition.smallest
    enough = max(ENOUGH * abs(condition.published), smallest)
    if low >= enough and low > 0:
        return HOLDS
    if high <= -smallest and high < 0:
        return OPPOSITE
    if -smallest <= low and high <= smallest:
        return NO_EFFECT
    return SMALLER if smallest <= low and high <= enough else UNDECIDED


def all_of(conditions: Sequence[Condition]) -> tuple[Verdict, str]:
    """The verdict of a claim that all conditions make, and how each of them came out."""
    parts = [verdict_of(condition) for condition in conditions]
    corrected = [verdict_of(condition, len(conditions)) for condition in conditions]
    refuted = {part for part in corrected if part in REFUTED}
    if all(part == HOLDS for part in parts):
        verdict: Verdict = HOLDS
    elif not refuted:
        verdict = UNDECIDED
    else:
        verdict = MIXED if len(refuted) > 1 or HOLDS in parts else next(iter(refuted))
    return verdict, _parts_text(conditions, parts)


def at_least(sample: Array, number: float) -> Verdict:
    """Holds: interval starts at ``number`` or above. Opposite: it ends below it."""
    low, high = limits(sample)
    return HOLDS if low >= number else OPPOSITE if high < number else UNDECIDED


def _parts_text(conditions: Sequence[Condition], parts: Sequence[Verdict]) -> str:
    """Each condition by name where they are few, else how many came out in which way."""
    if len(conditions) <= 2:
        texts = [f"{c.name}: {part}" for c, part in zip(conditions, parts, strict=True)]
        return ", ".join(texts)
    counts = Counter(parts).most_common()
    return f"of {len(parts)} conditions " + ", ".join(f"{n} {part}" for part, n in counts)
