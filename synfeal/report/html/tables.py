"""Tables of the page, to be sorted: side tables, tables 2 to 7 in both scores, the claims."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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


# The score that the switch on the page shows, and how names of its columns end.
SCORES = {"labels": "", "true": "_true"}


@dataclass(frozen=True)
class Column:
    """A column of a table on the page."""

    title: str  # its heading
    name: str = ""  # of the frame's column that it shows
    form: str = ""  # how its numbers are written, for :meth:`str.format`; empty for text
    factor: float = 1.0  # so many times the number is shown
    text: str = ""  # column of the frame that says how a number is written, in place of ``form``
    paper: str = ""  # column with the paper's number, set below
    small: str = ""  # column with more text, set small below
    bad: str = ""  # column that says whether a number is marked as bad
    # There are two numbers, against the labels and the true poses (``<name>_true``), with 95 %
    # limits (``_low``, ``_high``).
    scored: bool = False

    @property
    def is_number(self) -> bool:
        """Set to the right, digits aligned."""
        return bool(self.form or self.text)


def sortable(name: str, caption: str, columns: Sequence[Column], frame: pd.DataFrame) -> Markup:
    """A table with a row per row of a frame; ``caption`` is HTML.

    A column ``style`` of the frame, where there is one, names a class for each row.
    """
    rows = [
        {"style": row.get("style", ""), "cells": [_cell(row, column) for column in columns]}
        for row in frame.to_dict("records")
    ]
    values = {"name": name, "caption": Markup(caption), "columns": columns}
    return render("plain_table.html", **values, rows=rows)


NOTHING = {"scores": [], "is_number": False, "sort": "", "paper": "", "bad": False}


def _cell(row: dict[Any, Any], column: Column) -> dict[str, Any]:
    small = row[column.small] if column.small else ""
    if column.scored:
        return NOTHING | {"scores": [_score(row, column, style) for style in SCORES]}
    value = row[column.name]
    if not column.is_number:
        return NOTHING | {"text": value, "small": small}
    return {
        "scores": [],
        "is_number": True,
        "sort": "" if pd.isna(value) else value,
        "text": row[column.text] if column.text else shown(value, column),
        "paper": shown(row[column.paper], column, "") if column.paper else "",
        "small": small,
        "bad": bool(column.bad) and row[column.bad],
    }


def _score(row: dict[Any, Any], column: Column, style: str) -> dict[str, Any]:
    """One of two scores with its limits."""
    name = f"{column.name}{SCORES[style]}"
    number = column.form.partition("}")[0] + "}"  # without its unit
    value, low, high = (row[f"{name}{end}"] for end in ("", "_low", "_high"))
    limits = (
        ""
        if pd.isna([low, high]).any()
        else "–".join(number.format(column.factor * limit) for limit in (low, high))
    )
    sort = "" if pd.isna(value) else value
    return {"style": style, "sort": sort, "text": shown(value, column), "small": limits}


def shown(value: float, column: Column, missing: str = "–") -> str:
    """A number as a column writes it."""
    return missing if pd.isna(value) else column.form.format(column.factor * value)


# The switch's two scores: kind of line, and how names of its columns end.
STYLES = {"labels": ("labels", ""), "true": ("truth", "_true")}
SAME = "All labels of this table are true poses, so both scores are the same numbers."
# Numbers by row, kind of line, heading and place in the cell.
Values = Mapping[tuple[int, str, str, int], Any]


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
        labels=[
            Column("Noise in" if name.startswith("table3") else "Scene"),
            Column(HEADINGS[name]),
        ],
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
    """As in ``Table 4``."""
    return f"Table {name.split('_')[0].removeprefix('table')}"


def interval(low: Any, high: Any) -> str:
    """The 95 % limits as printed below a score; without an upper one they reach to infinity."""
    if pd.isna(low):
        return ""
    return f"{low:.2f}–{'∞' if pd.isna(high) else f'{high:.2f}'}"


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
        ends = [getattr(cell, f"{score}_{which}", float("nan")) for which in ("low", "high")]
        shown = {"value": value(kind), "change": value(f"{kind} change"), "limits": interval(*ends)}
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
