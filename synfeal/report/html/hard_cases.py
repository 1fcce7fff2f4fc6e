"""The table of hard cases: what first thoughts get wrong stands out."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from html import escape
from itertools import pairwise
from pathlib import Path

from synfeal.report.hard_cases.table import COLUMNS, NAME
from synfeal.report.hard_cases.text import Row, error_text, judged, short
from synfeal.report.html.markup import Column, number_cell, plain_table, text_cell
from synfeal.report.results import read_table

FIRST = ' class="first"'
CAPTION = (
    "<b>Hard cases.</b> Errors against exact answers: of the formula somebody would write first,"
    " and of the function this project uses. <b class='worse'>✗</b> marks errors above the bound"
    " that ours promises; “none” is no answer or no number. Cases without one right answer are to"
    " be refused. Times are those of one call, medians, and differ between runs."
)


def hard_cases_table(path: Path) -> str:
    """Every case with both errors, the bound, and the times."""
    rows = read_table(path, COLUMNS)
    columns = [Column("What"), Column("Case")]
    columns += [Column(title, True) for title in ("First thought", "Ours", "Bound")]
    columns += [Column("Truth")]
    columns += [Column(title, True) for title in ("First, µs", "Ours, µs")]
    return plain_table(NAME, CAPTION, columns, _lines(rows))


def _lines(rows: Sequence[Row]) -> list[str]:
    """Table rows; the first of each family has a line above it."""
    families = ["", *(row["family"] for row in rows)]
    starts = [before != after for before, after in pairwise(families)]
    return [_line(row, first) for row, first in zip(rows, starts, strict=True)]


def _line(row: Row, first: bool) -> str:
    cells = [
        text_cell(row["family"]),
        f"<td>{escape(row['case'])}<small>{escape(judged(row))}</small></td>",
        _error(row, "naive_error", row["naive"]),
        _error(row, "our_error", row["ours"]),
        number_cell(float(row["bound"]), short(float(row["bound"]))),
        text_cell(row["reference"]),
        *(_time(float(row[column])) for column in ("naive_seconds", "our_seconds")),
    ]
    return f"<tr{FIRST if first else ''}>{''.join(cells)}</tr>"


def _error(row: Row, column: str, formula: str) -> str:
    """An error over the formula that made it; one above the bound is marked."""
    error, bound = float(row[column]), float(row["bound"])
    text, below = error_text(row, column), f"<small>{escape(formula)}</small>"
    sort = min(error, sys.float_info.max)
    if error <= bound:
        return number_cell(sort, text, below)
    return number_cell(sort, "", f'<b class="worse">✗ {text}</b>{below}')


def _time(seconds: float) -> str:
    return number_cell(seconds, f"{1e6 * seconds:,.0f}" if seconds >= 1e-6 else "< 1")
