"""The table of reference methods and localizers, sortable."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from synfeal.report.html.markup import Column, number_cell, plain_table, text_cell
from synfeal.report.layouts import scene_title
from synfeal.report.references import (
    LOCALIZER,
    NAME,
    WITHIN,
    label_title,
    read_references,
)
from synfeal.report.stats import MEASURES

CAPTION = (
    "<b>References.</b> Image retrieval, the nearest training pose and structure-based poses beside"
    " the localizers, all from the labels of the data set. Within: share of the test frames within"
    " 5 cm and 5°. Seconds of one processor core, without what is done once for all label sets."
)


def references_table(path: Path) -> str:
    """A row per data set and method; localizers in grey."""
    titles = [f"{u}, {a}" for a in ("labels", "true poses") for u in ("m", "°")]
    titles += [f"Within, %, {a}" for a in ("labels", "true poses")] + ["Failed", "s per frame"]
    columns = [Column(title) for title in ("Data set", "Labels", "Method")]
    columns += [Column(title, True) for title in titles]
    body = [_row(record) for record in read_references(path).to_dict("records")]
    return plain_table(NAME, CAPTION, columns, body)


def _row(record: dict[Any, Any]) -> str:
    cells = [
        text_cell(f"{scene_title(record['scene'])}, {record['size']}"),
        text_cell(label_title(record["labels"])),
        text_cell(record["title"]),
        *(_number(record[measure], ".3g") for measure in MEASURES),
        *(_number(100 * record[share], ".0f") for share in WITHIN),
        _number(record["failed"], ".0f"),
        _number(record["seconds_per_frame"], ".2g"),
    ]
    grey = ' class="localizer"' if record["kind"] == LOCALIZER else ""
    return f"<tr{grey}>{''.join(cells)}</tr>"


def _number(value: float, form: str) -> str:
    return number_cell(None, "–") if pd.isna(value) else number_cell(value, f"{value:{form}}")
