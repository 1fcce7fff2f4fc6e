"""Tables 2 to 6 as files: tidy CSV, one row per cell, and LaTeX in the paper's layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from synfeal.config import Design
from synfeal.frames import write_frame
from synfeal.report.cells import read_cells, schema_of
from synfeal.report.layouts import sheet_of
from synfeal.report.sheet import write_latex

Value = str | int | float | None


def write_table(
    table: str,
    design: Design,
    root: Path,
    out_csv: Path,
    out_tex: Path,
) -> None:
    """Write one of tables 2 to 6 from the scores of its runs: a row per cell, and LaTeX."""
    cells = read_cells(table, design, root)
    write_frame(out_csv, cells[[*schema_of(table, repeated=bool((cells.n_seeds > 1).any()))]])
    write_latex(out_tex, sheet_of(table, cells))


def write_rows(path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, Value]]) -> None:
    """Write a CSV of some columns: floats with six significant digits, None as an empty cell."""
    texts = [[_text(row.get(column)) for column in columns] for row in rows]
    write_frame(path, pd.DataFrame(texts, columns=list(columns)))


def _text(value: Value) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
