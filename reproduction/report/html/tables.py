"""Sortable tables of the page: side tables, tables 2 to 7 in both scores, the claims."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby, product
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from reproduction.claims.effects import Against
from reproduction.claims.tables import ClaimTables, parts_in
from reproduction.claims.verdicts import GROUPS, MEANINGS, Verdict, published_claims
from reproduction.design.experiments import FROM_SCRATCH
from reproduction.design.side_tables import SIDE_TABLES
from reproduction.report.claim_lines import part_label, part_text
from reproduction.tables.columns import SCORES, Column, SideLayout, cells_of
from reproduction.tables.layouts import CHANGE
from reproduction.tables.sheet import PAPER, Line, Value, footnotes
from reproduction.tables.write import one_run_remarks, sheet_of
from synfeal.records.tables import records_of

ENVIRONMENT = Environment(
    loader=PackageLoader("reproduction.report.html"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def render(template: str, **values: Any) -> Markup:
    """Fill a template of the folder ``templates`` with values."""
    return Markup(ENVIRONMENT.get_template(template).render(**values))


def side_html(table: SideLayout) -> Markup:
    """Format a side table, a row per row."""
    rows = [
        {"style": row.get("style", ""), "cells": [cells_of(row, c) for c in table.columns]}
        for row in records_of(table.rows)
    ]
    switched = any(row["style"] in SCORES for row in rows) or any(c.scored for c in table.columns)
    title = table_title(table.name)
    return render("side_table.html", table=table, title=title, rows=rows, switched=switched)


# The switch's two scores: kinds of lines. Where labels are the truth, there is one for both.
STYLES = {"labels": "labels", "true": "truth"}
SAME = "All labels of this table are true poses, so both scores are the same numbers."


def score_table(name: str, cells: pd.DataFrame) -> Markup:
    """Format one of tables 2 to 7 from what :func:`reproduction.tables.cells.read_cells` read."""
    sheet = sheet_of(name, cells)
    one_truth = not any(line.kind == "truth" for line in sheet.lines)
    label = Column(sheet.headings[0])
    block = Column("Noise in" if "table3" in name else "Scene")
    titles = sheet.headings[2:]
    rows: list[dict[str, Any]] = []
    for (title, _), lines in groupby(sheet.lines, key=lambda line: (line.block, line.row)):
        # The first row of those that compete for bold has a rule above.
        first = not rows or title != rows[-1]["block"]
        rows.append({"block": title, "first": first, **_row([*lines])})
    return render(
        "score_table.html",
        name=name,
        title=table_title(name),
        text=sheet.caption,
        marks=footnotes(sheet),
        remarks=[
            *([SAME] if one_truth else []),
            *([CHANGE] if name == FROM_SCRATCH else []),
            *one_run_remarks(cells),
        ],
        labels=[block, label] if any(row["block"] for row in rows) else [label],
        titles=titles,
        quantities=[Column(title, form="{}") for _ in titles for title in ("Position", "Orient.")],
        rows=rows,
    )


def _row(lines: Sequence[Line]) -> dict[str, Any]:
    """Return the lines of a row: its label, the paper's values, both scores by number."""
    kinds = {line.kind: line.cells for line in lines}

    def value(kind: str, column: int, place: int) -> Value | None:
        cells = kinds.get(kind) or kinds.get(kind.replace("truth", "labels"))
        values = cells[column] if cells else []
        return values[min(place, len(values) - 1)] if values else None

    def yardstick(kind: str, column: int, place: int) -> Value | None:
        found = value("yardstick", column, place) if kind == "labels" else None
        return found._replace(text=f"yardstick {found.text}", bold=False) if found else None

    numbers = [
        {
            "scores": {
                style: (value(kind, *at), value(f"{kind} change", *at) or yardstick(kind, *at))
                for style, kind in STYLES.items()
            },
            "paper": [value(PAPER, *at), value("paper change", *at)],
        }
        for at in product(range(2, len(lines[0].cells)), (0, 1))
    ]
    return {"label": value("labels", 0, 0), "paper": value(PAPER, 0, 0), "cells": numbers}


def table_title(name: str) -> str:
    """Title a table as in ``Table 4`` or ``Label error``."""
    if name in SIDE_TABLES:
        return SIDE_TABLES[name].title
    found = re.match(r"table(\d+)", name)
    return f"Table {found[1]}" if found else name.replace("_", " ").capitalize()


# A sign, a border and the words themselves tell verdicts apart without colour.
BADGES: Mapping[str, tuple[str, str]] = {
    Verdict.HOLDS: ("✓", "holds"),
    Verdict.SMALLER: ("↘", "partly"),
    Verdict.MIXED: ("±", "partly"),
    Verdict.LESS: ("<", "fails"),
    Verdict.NEGLIGIBLE: ("=", "fails"),
    Verdict.OPPOSITE: ("✗", "fails"),
    Verdict.REFUTED: ("✗", "fails"),
    Verdict.UNDECIDED: ("?", "undecided"),
    Verdict.NOT_LEARNT: ("–", "untestable"),
    Verdict.NOT_TESTABLE: ("–", "untestable"),
    Verdict.BY_CONSTRUCTION: ("·", "untestable"),
}
AGAINST: tuple[Against, ...] = ("labels", "true")  # the switch's two scores
CLAIM_HEADINGS = ("Claim", "The paper says", "Published", "Measured here", "Verdict")


def claims_table(tables: ClaimTables) -> Markup:
    """Format one row per claim; measured values, limits and verdicts follow the switch."""
    parts = {score: parts_in(tables.effects, score) for score in AGAINST}
    rows: list[dict[str, Any]] = [
        {
            "claim": claim,
            "measured": {
                score: [
                    (part_label(part), part_text(part)) for part in own if part.claim == claim.id
                ]
                for score, own in parts.items()
            },
            "verdicts": {score: tables.verdict(claim.id, score) for score in AGAINST},
        }
        for claim in published_claims()
    ]
    columns = [Column(title) for title in CLAIM_HEADINGS]
    judged = [row for row in rows if all(row["verdicts"].values())]
    return render("claims.html", rows=judged, columns=columns, scores=AGAINST, badges=BADGES)


def verdict_table(tables: ClaimTables) -> Markup:
    """Tabulate the claims of each group by verdict, under either score."""
    counts = {score: verdict_counts(tables, score) for score in AGAINST}
    found = {verdict for groups in counts.values() for own in groups.values() for verdict in own}
    return render(
        "verdicts.html",
        badges=BADGES,
        groups=GROUPS,
        verdicts=[verdict for verdict in BADGES if verdict in found],
        counts=counts,
        meanings=MEANINGS,
    )


def verdict_counts(tables: ClaimTables, score: Against) -> dict[str, Counter[str]]:
    """Count the claims of each group by verdict, under a score."""
    counts: dict[str, Counter[str]] = {group: Counter() for group in GROUPS}
    for claim in published_claims():
        found = tables.verdict(claim.id, score)
        if found is not None:
            counts[claim.group][found[0]] += 1
    return counts
