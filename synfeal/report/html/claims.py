"""The section on the paper's claims: what was measured, and whether each claim holds."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from synfeal.errors import InputError
from synfeal.frames import TEXT, read_frame, records_of
from synfeal.report.claims import model
from synfeal.report.claims.table import COLUMNS
from synfeal.report.html.render import SCORES, Column, render

# A sign, a border and the words themselves tell verdicts apart without colour.
BADGES: Mapping[str, tuple[str, str]] = {
    model.HOLDS: ("✓", "holds"),
    model.SMALLER: ("↘", "partly"),
    model.MIXED: ("±", "partly"),
    model.LESS: ("<", "fails"),
    model.NO_EFFECT: ("=", "fails"),
    model.OPPOSITE: ("✗", "fails"),
    model.UNDECIDED: ("?", "undecided"),
    model.NOT_LEARNT: ("–", "untestable"),
    model.NOT_TESTABLE: ("–", "untestable"),
}
HEADINGS = ("Claim", "The paper says", "Published", "Measured here", "Verdict")
Claims = Sequence[Mapping[str, str]]


def read_claims(path: Path) -> Claims:
    """The rows of ``claims.csv``."""
    rows = records_of(read_frame(path, dict.fromkeys(COLUMNS, TEXT)))
    for row in rows:
        for score in SCORES:
            if row[f"verdict_{score}"] not in BADGES:
                raise InputError(
                    f"{path}: claim '{row['id']}': verdict_{score} must be one of {list(BADGES)}"
                )
    return rows


def claims_table(claims: Claims) -> Markup:
    """One row per claim; measured values, limits and verdicts follow the switch."""
    columns = [Column(title) for title in HEADINGS]
    values = {"claims": claims, "columns": columns, "scores": list(SCORES), "badges": BADGES}
    return render("claims.html", **values, reason=reason_of)


def verdict_counts(claims: Claims) -> Markup:
    """How many claims got each verdict, under either score."""
    verdicts = pd.DataFrame(claims)[[f"verdict_{score}" for score in SCORES]]
    counts = {verdict: (verdicts == verdict).sum().tolist() for verdict in BADGES}
    return render("verdicts.html", badges=BADGES, counts=counts)


def reason_of(reason: str, score: str) -> str:
    """The reason of a verdict; where the two scores have their own, that of ``score``."""
    found = re.fullmatch(r"labels: (?P<labels>.*); true: (?P<true>.*)", reason)
    return found[score] if found else reason
