"""Tables of the page, to be sorted: side tables, tables 2 to 7 in both scores, the claims."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from synfeal.config.experiments import FROM_SCRATCH
from synfeal.errors import InputError
from synfeal.frames import TEXT, read_frame, records_of, rows_of
from synfeal.report.claims.model import Verdict
from synfeal.report.claims.table import COLUMNS
from synfeal.report.columns import SCORES, Column, SideTable, cells_of
from synfeal.report.layouts import (
    CHANGE,
    HEADINGS,
    REFERENCES,
    TITLES,
    UNITS,
    published_labels,
    row_label,
    scene_title,
)
from synfeal.report.sheet import PAPER, footnotes
from synfeal.report.tables import printed_values, sheet_of

ENVIRONMENT = Environment(
    loader=PackageLoader("synfeal.report.html"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def render(template: str, **values: Any) -> Markup:
    """A template of the folder ``templates`` with its values."""
    return Markup(ENVIRONMENT.get_template(template).render(**values))


def side_html(table: SideTable) -> Markup:
    """A side table, a row per row."""
    rows = [
        {"style": row.get("style", ""), "cells": [cells_of(row, c) for c in table.columns]}
        for row in records_of(table.rows)
    ]
    switched = any(row["style"] in SCORES for row in rows) or any(c.scored for c in table.columns)
    title = table_title(table.name)
    return render("side_table.html", table=table, title=title, rows=rows, switched=switched)


# The switch's two scores: kind of line, and how names of its columns end.
STYLES = {"labels": ("labels", ""), "true": ("truth", "_true")}
SAME = "All labels of this table are true poses, so both scores are the same numbers."
Values = Mapping[tuple[int, str, str, int], Any]  # by row, kind of line, heading, place in cell


def score_table(name: str, cells: pd.DataFrame) -> Markup:
    """One of tables 2 to 7, from what :func:`synfeal.report.cells.read_cells` read for it."""
    sheet = sheet_of(name, cells)
    printed = rows_of(printed_values(name, cells))
    values = {(v.row, v.kind, v.column, v.place): v for v in printed}
    labels = published_labels(name, cells)
    one_truth = (cells.labels == "synfeal").all()
    titles = [*TITLES.values(), *REFERENCES.values()]
    return render(
        "score_table.html",
        name=name,
        title=table_title(name),
        text=sheet.caption,
        marks=footnotes(sheet),
        remarks=[*([SAME] if one_truth else []), *([CHANGE] if name == FROM_SCRATCH else [])],
        labels=[Column("Noise in" if "table3" in name else "Scene"), Column(HEADINGS[name])],
        titles=titles,
        quantities=[Column(title, form="{}") for _ in titles for title in ("Position", "Orient.")],
        # The first row of those that compete for bold has a rule above.
        rows=[
            {"first": place == 0, "paper": labels.get(number), **_row(name, row, values)}
            for _, group in cells.groupby(["block", "scene"], sort=False)
            for place, (number, row) in enumerate(group.groupby("row", sort=False))
        ],
    )


def table_title(name: str) -> str:
    """As in ``Table 4`` or ``Label error``."""
    found = re.match(r"table(\d+)", name)
    return f"Table {found[1]}" if found else name.replace("_", " ").capitalize()


def _row(name: str, row: pd.DataFrame, values: Values) -> dict[str, Any]:
    """A row of five localizers: scene or block, what tells it from its neighbours, its cells."""
    models = rows_of(row)
    lead, label = models[0], row_label(name, models[0])
    key: object = lead.n_train
    if lead.block:
        key = f"{1000 * lead.noise_m + lead.noise_deg:g}"
    elif name == "table2_ground_truth":
        key = label
    numbers = [(TITLES[cell.model], cell, "") for cell in models]
    numbers += [(title, lead, f"{start}_") for start, title in REFERENCES.items()]
    return {
        "block": lead.block or scene_title(lead.scene),
        "label": label,
        "key": key,
        "note": lead.published_row_note,
        "cells": [
            _score_cell(cell, title, start, place, values)
            for title, cell, start in numbers
            for place in range(len(UNITS))
        ],
    }


def _score_cell(cell: Any, title: str, start: str, place: int, values: Values) -> dict[str, Any]:
    """Both scores of a localizer, or of an answer without training, and the paper's below."""

    def value(kind: str) -> Any:
        return values.get((cell.row, kind, title, place))

    scores = []
    for style, (kind, end) in STYLES.items():
        score = f"{start}{[*UNITS][place]}{end}"
        sort = getattr(cell, score, 0.0)  # truth is the truth
        low, high = (getattr(cell, f"{score}_{which}", float("nan")) for which in ("low", "high"))
        upper = "∞" if pd.isna(high) else f"{high:.2f}"  # too many failed to know it
        limits = "" if pd.isna(low) else f"{low:.2f}–{upper}"
        shown = {"value": value(kind), "change": value(f"{kind} change"), "limits": limits}
        scores.append({"style": style, "sort": "" if pd.isna(sort) else sort, **shown})
    return {"scores": scores, "paper": value(PAPER), "paper_change": value("paper change")}


# A sign, a border and the words themselves tell verdicts apart without colour.
BADGES: Mapping[str, tuple[str, str]] = {
    Verdict.HOLDS: ("✓", "holds"),
    Verdict.SMALLER: ("↘", "partly"),
    Verdict.MIXED: ("±", "partly"),
    Verdict.LESS: ("<", "fails"),
    Verdict.NO_EFFECT: ("=", "fails"),
    Verdict.OPPOSITE: ("✗", "fails"),
    Verdict.UNDECIDED: ("?", "undecided"),
    Verdict.NOT_LEARNT: ("–", "untestable"),
    Verdict.NOT_TESTABLE: ("–", "untestable"),
}
CLAIM_HEADINGS = ("Claim", "The paper says", "Published", "Measured here", "Verdict")
Claims = Sequence[Mapping[str, str]]


def read_claims(path: Path) -> Claims:
    """The rows of ``claims.csv``."""
    rows = records_of(read_frame(path, dict.fromkeys(COLUMNS, TEXT)))
    for row in rows:
        for score in SCORES:
            if row[f"verdict_{score}"] not in BADGES:
                where = f"{path}: claim '{row['id']}': verdict_{score}"
                raise InputError(f"{where} must be one of {', '.join(BADGES)}")
    return rows


def claims_table(claims: Claims) -> Markup:
    """One row per claim; measured values, limits and verdicts follow the switch."""
    columns = [Column(title) for title in CLAIM_HEADINGS]
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
