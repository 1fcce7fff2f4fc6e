"""A claim of the paper, and what a run has to say about it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

from synfeal.frames import read_records
from synfeal.report.published import FOLDER

Verdict = Literal[
    "holds",
    "same direction but smaller",
    "mixed",
    "no effect",
    "smaller than published",
    "opposite",
    "undecided",
    "not learnt at this scale",
    "not testable here",
]
HOLDS: Verdict = "holds"
SMALLER: Verdict = "same direction but smaller"
MIXED: Verdict = "mixed"
NO_EFFECT: Verdict = "no effect"
LESS: Verdict = "smaller than published"
OPPOSITE: Verdict = "opposite"
UNDECIDED: Verdict = "undecided"
NOT_LEARNT: Verdict = "not learnt at this scale"
NOT_TESTABLE: Verdict = "not testable here"
DECIDED = (HOLDS, SMALLER, MIXED, NO_EFFECT, LESS, OPPOSITE)


@dataclass(frozen=True)
class Claim:
    """One claim as printed.

    Attributes:
        id: ``C1`` to ``C16``.
        section: of the paper.
        statement: the claim in our words.
        published: its figures, as printed.
        numbers: those of the figures that the test compares with.
        test: how it is tested and by which rule it is decided.
        footnote: what is wrong or unclear in print, else empty.
    """

    id: str
    section: str
    statement: str
    published: str
    numbers: tuple[float, ...]
    test: str
    footnote: str


@dataclass(frozen=True)
class Outcome:
    """What a run says about a claim, under one of the two scores.

    Attributes:
        verdict: decided by the rule of the claim's test.
        measured: the statistic, as text.
        interval: its 95 % limits, as text; empty where it has none.
        reason: why the verdict is not the other one.
    """

    verdict: Verdict
    measured: str = ""
    interval: str = ""
    reason: str = ""


class Missing(Exception):  # noqa: N818 - not an error: it ends in the verdict `not testable here`
    """The profile does not make what a test needs; the message says what."""


@cache
def published_claims() -> tuple[Claim, ...]:
    """The claims of the paper, in its order."""
    return tuple(_claim(row) for _, row in read_records(FOLDER / "claims.csv"))


def _claim(row: dict[str, str]) -> Claim:
    numbers = tuple(map(float, row.pop("numbers").split()))
    return Claim(numbers=numbers, **row)
