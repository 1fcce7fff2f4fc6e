"""The section on the paper's claims: what was measured, and whether each claim holds."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from synfeal.errors import InputError
from synfeal.report.claims.model import (
    HOLDS,
    MIXED,
    NO_EFFECT,
    NOT_LEARNT,
    NOT_TESTABLE,
    OPPOSITE,
    SMALLER,
    UNDECIDED,
)
from synfeal.report.claims.table import COLUMNS
from synfeal.report.html.markup import Column, plain_table
from synfeal.report.html.tables import SCORE_TAGS
from synfeal.report.results import read_table

# A sign, a border and the words themselves tell verdicts apart without colour.
BADGES = {
    HOLDS: ("✓", "holds"),
    SMALLER: ("↘", "partly"),
    MIXED: ("±", "partly"),
    NO_EFFECT: ("=", "fails"),
    OPPOSITE: ("✗", "fails"),
    UNDECIDED: ("?", "undecided"),
    NOT_LEARNT: ("–", "untestable"),
    NOT_TESTABLE: ("–", "untestable"),
}
SCORES = ("labels", "true")
HEADINGS = ("Claim", "The paper says", "Published", "Measured here", "Verdict")
Claims = Sequence[Mapping[str, str]]


def read_claims(path: Path) -> Claims:
    """The rows of ``claims.csv``.

    Raises:
        InputError: it cannot be read, lacks a column, or holds a verdict that is none.
    """
    rows = read_table(path, COLUMNS)
    for row in rows:
        for score in SCORES:
            if row[f"verdict_{score}"] not in BADGES:
                raise InputError(
                    f"{path}: claim '{row['id']}': verdict_{score} must be one of {list(BADGES)}"
                )
    return rows


def claims_table(claims: Claims) -> str:
    """One row per claim; measured values, limits and verdicts follow the switch."""
    columns = [Column(title) for title in HEADINGS]
    caption = (
        "The claims of the paper, and what this run says about them; p is the position error, o the"
        f" orientation error. {SCORE_TAGS}"
    )
    return plain_table("claims-table", caption, columns, [_row(claim) for claim in claims])


def verdict_counts(claims: Claims) -> str:
    """How many claims got each verdict, under either score."""
    counts = {score: Counter(claim[f"verdict_{score}"] for claim in claims) for score in SCORES}
    rows = [
        f'<tr><th scope="row">{badge(verdict)}</th>'
        + "".join(f'<td class="number">{counts[score][verdict]}</td>' for score in SCORES)
        + "</tr>"
        for verdict in BADGES
    ]
    head = "<th>Claims of the paper</th><th>against the labels</th><th>against the true poses</th>"
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    return f'<table class="counts">{body}</table>'


def badge(verdict: str) -> str:
    """A verdict as a badge."""
    sign, style = BADGES[verdict]  # type: ignore[index]
    return f'<span class="badge {style}"><span aria-hidden="true">{sign}</span> {verdict}</span>'


def _row(claim: Mapping[str, str]) -> str:
    place = f'<td data-sort="{escape(claim["id"].lstrip("C"))}">{escape(claim["id"])}'
    place += f"<small>section {escape(claim['section'])}</small></td>"
    measured = "".join(
        f'<div class="{score}">{_lines(claim[f"measured_{score}"]) or "–"}'
        f"{_small('95 %: ', claim[f'interval_{score}'])}</div>"
        for score in SCORES
    )
    badges = "".join(
        f'<div class="{score}">{badge(claim[f"verdict_{score}"])}'
        f"{_small('', reason_of(claim, score))}</div>"
        for score in SCORES
    )
    keys = " ".join(f'data-{score}="{escape(claim[f"verdict_{score}"])}"' for score in SCORES)
    return (
        f'<tr>{place}<td class="wide">{escape(claim["statement"])}{_more(claim)}</td>'
        f'<td data-title="Published: ">{escape(claim["published"])}</td>'
        f'<td class="wide" data-title="Measured: ">{measured}</td><td {keys}>{badges}</td></tr>'
    )


def _more(claim: Mapping[str, str]) -> str:
    """What is wrong in print, the rule of the test and the files it read."""
    files = "".join(f"<li>{escape(name)}</li>" for name in claim["evidence"].split(";") if name)
    files = f'<p>Files read:</p><ul class="files">{files}</ul>' if files else ""
    details = f"<details><summary>How it is tested</summary><p>{escape(claim['test'])}</p>{files}"
    return f"<small>{escape(claim['footnote'])}</small>{details}</details>"


def reason_of(claim: Mapping[str, str], score: str) -> str:
    """The reason of a verdict; where the two scores have their own, that of ``score``."""
    found = re.fullmatch(r"labels: (?P<labels>.*); true: (?P<true>.*)", claim["reason"])
    return found[score] if found else claim["reason"]


def _lines(text: str) -> str:
    return escape(text).replace("; ", ";<br>")


def _small(lead: str, text: str) -> str:
    return f"<small>{lead}{_lines(text)}</small>" if text else ""
