"""Tables 2 to 6 as files: tidy CSV, one row per cell, and LaTeX in the paper's layout."""

from __future__ import annotations

from pathlib import Path

from synfeal.config import Design
from synfeal.frames import write_frame
from synfeal.report.cells import read_cells, schema_of
from synfeal.report.layouts import sheet_of
from synfeal.report.sheet import write_latex


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
