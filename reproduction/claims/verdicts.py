"""The claims of the paper, and the verdicts there are on them.

Every part of a claim is an effect, the logarithm of a ratio, positive in the direction the paper
claims. Two thirds of a printed effect are so of its logarithm: of a fall by 55 %, a fall by 41 %.
So it does not matter which of two errors is the base. Its 95 % limits are compared with four
regions, as in equivalence testing (Lakens, "Equivalence Tests", Social Psychological and
Personality Science 2017): an effect smaller than the smallest of interest is none; at least two
thirds of the published one is a replication. The verdict is the region the whole interval lies in,
and *undecided* where it lies in none, so that a narrower interval can only be nearer to the right
verdict: two one-sided tests at 2.5 % each.

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
not replicated, and whether there is a smaller one the limits tell (an informative failure, as
Simonsohn calls it in "Small Telescopes", Psychological Science 2015). It needs a published size.

*Negligible* says that an effect is smaller than anybody cares for, not that there is none.

A claim of several parts holds when all do. It is refuted by one that is decided otherwise at the
level corrected for their number (Bonferroni). Where all parts are so decided, and alike, the
verdict is theirs; *smaller than published* where they are not alike and none is opposite. Else it
is *mixed* where another part holds, and *refuted* where none does. A claim about every localizer is
judged by the mean effect over the localizers.

A claim that one thing is the best of all holds when it is better than every other, and is *refuted*
by one that is better than it, at the level corrected for their number. A claim about three of five
localizers holds when the third surest is sure at the level corrected for three.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cache

from reproduction.tables.cells import FOLDER
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
    Verdict.LESS: "certainly smaller than printed; the limits tell whether there is any",
    Verdict.NEGLIGIBLE: "if there is an effect, it is certainly smaller than 5 %",
    Verdict.OPPOSITE: "there certainly is an effect, the other way round",
    Verdict.REFUTED: "part of the claim is certainly not so, and no part is borne out",
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
# The numbers among the rules are our choice. Percent: the paper prints 0.01 m, 5 % of its median
# cell, 0.20 m, and resolves no less.
SMALLEST = 5.0
ENOUGH = 2 / 3  # share of the published effect that replicates it
FEW = 1 / 3  # of the batches (C4)
NOT_COPING = 1 / 2  # of the batches (C15)
DECIDED_AGAINST = (Verdict.SMALLER, Verdict.NEGLIGIBLE, Verdict.LESS, Verdict.OPPOSITE)


@dataclass(frozen=True)
class Claim:
    """One claim as printed."""

    id: str  # ``C1`` to ``C16``
    section: str  # of the paper
    group: str  # of ``GROUPS``
    title: str  # the claim in a few words
    statement: str  # the claim in our words
    published: str  # its figures, as printed
    numbers: tuple[float, ...]  # those of the figures that the test compares with
    test: str  # how it is tested and by which rule it is decided
    footnote: str  # what is wrong or unclear in print, else empty


@cache
def published_claims() -> tuple[Claim, ...]:
    """Read the claims of the paper, in its order."""
    rows = [row for _, row in read_records(FOLDER / "claims.csv")]
    return tuple(
        Claim(numbers=tuple(map(float, row.pop("numbers").split())), **row) for row in rows
    )
