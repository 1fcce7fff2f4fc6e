"""The table of label errors: how far re-estimated labels are from the true poses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from synfeal.report import label_error
from synfeal.report.assistance import TOTAL
from synfeal.report.html.markup import Column, number_cell, plain_table, text_cell
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.report.results import read_table

# Columns of the file whose cells hold numbers, and those that are empty where nothing moved.
NUMBERS = (
    *label_error.ABSOLUTE,
    *("share_within_5cm_5deg", "share_filled", "seconds_per_frame", "peak_memory_mb"),
)
DRIFT = ("relative_25_m_per_m", "relative_25_deg_per_m")
CAPTION = (
    "<b>Label errors.</b> Re-estimated labels of both splits against the true poses, without"
    " alignment. Before assistance: what the labels were had no last pose been replaced. Drift:"
    " errors of the motion over 25 frames, by the metre travelled; a replaced pose adds to it."
    " Along the sequence: <a href='#figures'>the figures</a> of camera paths and of label errors."
)


def label_error_table(path: Path) -> str:
    """A row before and a row after assistance for every method and data set."""
    rows = read_table(path, label_error.COLUMNS, NUMBERS, DRIFT)
    columns = [Column(title) for title in ("Labels from", "Data set", "Assistance")]
    errors = [f"{which}, {unit}" for unit in ("m", "°") for which in ("Median", "RMSE", "Max")]
    titles = (*errors, "Drift, %", "Drift, °/m", "Within 5 cm, 5°, %", "Filled, %")
    columns += [Column(title, True) for title in (*titles, "s per frame", "Memory, MB")]
    body = [_line(row) for row in rows if row["split"] == TOTAL]
    return plain_table(label_error.NAME, CAPTION, columns, body)


def _line(row: Mapping[str, str]) -> str:
    cells = [
        text_cell(SOURCES.get(row["method"], row["method"])),
        text_cell(f"{scene_title(row['scene'])}, {row['size']}"),
        text_cell(row["assistance"]),
        *(_number(row[column], ".3g") for column in label_error.ABSOLUTE),
        _number(row[DRIFT[0]], ".2g", 100),
        _number(row[DRIFT[1]], ".2g"),
        _number(row["share_within_5cm_5deg"], ".0f", 100),
        _number(row["share_filled"], ".1f", 100),
        _number(row["seconds_per_frame"], ".2g"),
        _number(row["peak_memory_mb"], ",.0f"),
    ]
    return f"<tr>{''.join(cells)}</tr>"


def _number(text: str, form: str, factor: float = 1.0) -> str:
    """A cell; a dash where the file has nothing."""
    if not text:
        return number_cell(None, "–")
    value = factor * float(text)
    return number_cell(value, f"{value:{form}}")
