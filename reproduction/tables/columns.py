"""Side tables: columns defined once for the page, LaTeX and Markdown.

A side table (:class:`reproduction.tables.side.Table`) has a schema of its CSV, and lays out rows
that are read from it. A new column is a line in either.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.tables.sheet import PAPER, Line, Sheet, Value, write_latex
from synfeal.records.tables import records_of

# The score that the switch on the page shows, and how names of its columns end.
SCORES = {"labels": "", "true": "_true"}
NOTHING = "–"


@dataclass(frozen=True)
class Column:
    """A column of a side table."""

    title: str  # its heading
    name: str = ""  # the frame's column that it shows, and that a reader sorts by
    form: str = ""  # how its numbers are written, for :meth:`str.format`; empty for text
    factor: float = 1.0  # so many times the number is shown
    text: str = ""  # column of the frame that says how a number is written, in place of ``form``
    paper: str = ""  # column with what the paper printed, set below
    small: str = ""  # column with more text, set small below
    bad: str = ""  # column that says whether a number is marked as bad
    # There are two numbers, against the labels and the true poses (``<name>_true``), with 95 %
    # limits (``_low``, ``_high``); on paper stands the second without its limits.
    scored: bool = False
    on_paper: bool = True  # else on the page alone

    @property
    def is_number(self) -> bool:
        """Set to the right, digits aligned."""
        return bool(self.form or self.text)

    def written(self, value: Any, missing: str = NOTHING) -> str:
        """Format a value of the column as it is printed."""
        if pd.isna(value):
            return missing
        if not self.form:
            return str(value)
        # Whole numbers stay whole, as formats such as "{:d}" ask for.
        return self.form.format(value if self.factor == 1.0 else self.factor * value)


@dataclass(frozen=True)
class SideLayout:
    """A table beside tables 2 to 7, laid out."""

    name: str  # its files are called so, without suffix
    caption: str  # what it shows, in a sentence or two
    columns: Sequence[Column]
    # A row per line. Two columns may say more than cells: ``style``, a class for a row of the page,
    # and ``on_paper``, whether a row stands there too.
    rows: pd.DataFrame
    remark: str = ""  # what a reader has to know of the columns
    block: str = ""  # name of the column whose values are titles of blocks on paper


@dataclass(frozen=True)
class Cell:
    """Content of one cell: what a column shows of a row."""

    text: str
    small: str = ""
    paper: str = ""
    sort: Any = ""  # what the page sorts by; empty comes last
    bad: bool = False
    style: str = ""  # which of two scores it shows


def cells_of(row: Mapping[str, Any], column: Column) -> list[Cell]:
    """Fill the cells of a column in one row: one cell, or, if ``scored``, one per score."""
    if column.scored:
        return [_score(row, column, style) for style in SCORES]
    value = row[column.name]
    return [
        Cell(
            row[column.text] if column.text else column.written(value),
            row[column.small] if column.small else "",
            column.written(row[column.paper], "") if column.paper else "",
            "" if pd.isna(value) else value,
            bool(column.bad) and bool(row[column.bad]),
        )
    ]


def _score(row: Mapping[str, Any], column: Column, style: str) -> Cell:
    name = f"{column.name}{SCORES[style]}"
    number = column.form.partition("}")[0] + "}"  # without its unit
    value, *limits = (row[f"{name}{end}"] for end in ("", "_low", "_high"))
    between = "–".join(number.format(column.factor * limit) for limit in limits)
    known = "" if pd.isna(limits).any() else between
    return Cell(column.written(value), known, sort="" if pd.isna(value) else value, style=style)


def by_method(cells: pd.DataFrame, rows: Sequence[str]) -> pd.DataFrame:
    """Pivot cells to a row per combination of ``rows`` and a column per method.

    ``cells`` have a ``method``, a ``number`` to sort by and a ``text``; the texts of a method are
    in the column ``<method>_text``.
    """
    order = cells[[*rows]].drop_duplicates()
    order = order.iloc[order.groupby(rows[0], sort=False).ngroup().argsort(kind="stable")]
    wide = cells.pivot(index=[*rows], columns="method", values=["number", "text"])
    wide = wide.reindex(pd.MultiIndex.from_frame(order))
    texts = wide["text"].fillna(NOTHING).add_suffix("_text")
    return pd.concat([wide["number"], texts], axis=1).reset_index()


def method_columns(titles: Mapping[str, str], on_paper: bool = True) -> list[Column]:
    """Return columns for what :func:`by_method` made."""
    return [
        Column(title, name, text=f"{name}_text", on_paper=on_paper)
        for name, title in titles.items()
    ]


def write_side(path: Path, table: SideLayout) -> None:
    """Write a side table as LaTeX."""
    write_latex(path, side_sheet(table))


def side_sheet(table: SideLayout) -> Sheet:
    """Lay out a side table as it is printed on paper; the paper's values are a grey line below.

    Lines with the label of the one above belong to the same row, and do not repeat it.
    """
    columns = [column for column in table.columns if column.on_paper and column.name != table.block]
    lines: list[Line] = []
    for row in records_of(table.rows):
        if not row.get("on_paper", True):
            continue
        cells = [cells_of(row, column)[-1] for column in columns]
        label, *texts = map(_printed, cells)
        block = str(row[table.block]) if table.block else ""
        repeated = bool(lines) and (lines[-1].block, lines[-1].row) == (block, label)
        lines.append(_line(block, label, "", ["" if repeated else label, *texts]))
        if any(cell.paper for cell in cells):
            lines.append(_line(block, label, PAPER, ["paper", *(c.paper for c in cells[1:])]))
    headings = tuple(column.title for column in columns)
    return Sheet(table.name, table.caption, headings, lines, (table.remark,) * bool(table.remark))


def _printed(cell: Cell) -> str:
    """Return the text of a cell without limits of a score."""
    mark, small = "✗ " if cell.bad else "", f" ({cell.small})" if cell.small else ""
    return f"{mark}{cell.text}{'' if cell.style else small}"


def _line(block: str, row: str, kind: str, texts: Sequence[str]) -> Line:
    return Line(block, row, kind, [[Value(text)] for text in texts])
