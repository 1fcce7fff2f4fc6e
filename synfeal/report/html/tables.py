"""Tables 2 to 6 as HTML: both scores in every cell, of which a switch on the page shows one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd
from markupsafe import Markup

from synfeal.config.experiments import FROM_SCRATCH
from synfeal.frames import rows_of
from synfeal.report.html.render import Column, render
from synfeal.report.layouts import (
    CHANGE,
    HEADINGS,
    REFERENCES,
    TITLES,
    UNITS,
    printed_values,
    published_labels,
    row_label,
    scene_title,
    sheet_of,
)
from synfeal.report.sheet import PAPER, footnotes

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
            _cell(cell, title, start, place, values)
            for title, cell, start in numbers
            for place in range(len(UNITS))
        ],
    }


def _cell(cell: Any, title: str, start: str, place: int, values: Values) -> dict[str, Any]:
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
