"""Count the rows of a run's tables that runs with fresh seeds have, and their training runs.

No run with a fresh seed has all tables: each has the rows of some claims or findings. This module
says what they have together of the rows of the run that was seen before the rules were frozen.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from reproduction.config.tables import KEYS
from reproduction.report.findings import read_table
from reproduction.report.fresh import is_fresh
from reproduction.report.html.tables import table_title
from reproduction.report.published_claims import published_runs, read_published
from reproduction.tables.sheet import markdown_table
from synfeal.errors import InputError

# What the last line of each table counts: rows that any of the runs has.
TOGETHER = "together"


def run_anew(root: Path) -> str:
    """Tabulate what published runs with fresh seeds have of a run's rows, table by table.

    Args:
        root: The run, among other published ones.

    Raises:
        InputError: It is not published, or has no table of training runs.
    """
    tables = {name: keys for name, keys in KEYS.items() if _has(root, name)}
    if not tables:
        raise InputError(root, "has no table of training runs", "publish again")
    fresh = [run for run in published_runs(root.parent) if is_fresh(read_published(run))]
    records = []
    for table, keys in tables.items():
        asked = {*_rows_of_cells(read_table(root, table), keys)}
        met: set[tuple[object, ...]] = set()
        for run in (run for run in fresh if _has(run, table)):
            cells = read_table(run, table)
            shared = cells[[row in asked for row in _rows_of_cells(cells, keys)]]
            again = {*_rows_of_cells(shared, keys)}
            if again:
                met |= again
                records.append(_record(table, f"`{run.name}`", again, asked, training_runs(shared)))
        records.append(_record(table, TOGETHER, met, asked, ""))
    return markdown_table(pd.DataFrame(records))


def _has(root: Path, table: str) -> bool:
    return (root / "tables" / f"{table}.csv").is_file()


def training_runs(cells: pd.DataFrame) -> str:
    """Say how many training runs the cells of a table have, as in `3` or `1 to 3`."""
    fewest, most = int(cells.n_seeds.min()), int(cells.n_seeds.max())
    return str(fewest) if fewest == most else f"{fewest} to {most}"


def _rows_of_cells(cells: pd.DataFrame, keys: tuple[str, ...]) -> list[tuple[object, ...]]:
    """Name the row that each cell is in; a row has a cell per localizer."""
    return list(cells[[*keys]].itertuples(index=False, name=None))


def _record(
    table: str,
    run: str,
    again: set[tuple[object, ...]],
    asked: set[tuple[object, ...]],
    training_runs: str,
) -> dict[str, str]:
    """Describe a line of the table that :func:`run_anew` makes."""
    return {
        "table": table_title(table),
        "run": run,
        "rows": f"{len(again)} of {len(asked)}",
        "training runs per cell": training_runs,
    }
