"""The rules that single runs were judged by: their history.

``rules.csv`` has a row for every set of rules that was ever in force; ``docs/rules.md`` says what
each of them said of the numbers of its time and why it changed. Runs are judged by the rules of
replications now (:mod:`reproduction.claims.judge`), which were announced before the first of those.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

from synfeal.records.tables import read_records

RULES = Path(__file__).with_name("rules.csv")


class Rules(NamedTuple):
    """One set of rules."""

    tag: str  # its date, and a letter where a day had several
    commit: str  # that put it into force; empty for the last one
    digest: str  # hash of texts and code; empty for rules from before they were frozen
    change: str  # against the one before


@cache
def rules_history() -> tuple[Rules, ...]:
    """Read every set of rules, oldest first."""
    return tuple(Rules(**row) for _, row in read_records(RULES, Rules._fields))


def frozen_rules() -> Rules:
    """Return the last of the rules that single runs were judged by."""
    return rules_history()[-1]
