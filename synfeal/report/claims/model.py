"""A claim of the paper, and what a run has to say about it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

from synfeal.frames import read_records
from synfeal.report.cells import FOLDER

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
