"""Compare the errors of the paper's tables with those that another commit's run made.

Writes ``results/benchmarks/reproduce_errors.csv``, a row for each localizer and one for all::

    mkdir -p before/tables
    for table in table2_ground_truth table3_inconsistencies table4_size table5_from_scratch; do
      git show bdfa7c9:results/published/mini/tables/$table.csv > before/tables/$table.csv
    done
    python -m benchmarks.reproduce_errors --before before

Cells are matched by what they are of; those that one run alone has are left out.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from synfeal.errors import InputError, exit_status
from synfeal.records.tables import MAYBE_TEXT, NUMBER, TEXT, read_frame, write_frame

TABLES = ("table2_ground_truth", "table3_inconsistencies", "table4_size", "table5_from_scratch")
CELL = ("block", "scene", "size", "labels", "noise_m", "noise_deg", "model")
ERRORS = ("position_m", "orientation_deg", "position_m_true", "orientation_deg_true")


def cells_of(root: Path) -> pd.DataFrame:
    """Read the errors of every cell of the tables of a run.

    Args:
        root: Results of the run, with ``tables``.

    Raises:
        InputError: a table is missing or damaged.
    """
    schema = dict.fromkeys(CELL, MAYBE_TEXT) | {"model": TEXT} | dict.fromkeys(ERRORS, NUMBER)
    tables = [
        read_frame(root / "tables" / f"{table}.csv", schema).assign(table=table) for table in TABLES
    ]
    return pd.concat(tables, ignore_index=True)


def compared(before: pd.DataFrame, now: pd.DataFrame) -> pd.DataFrame:
    """Compute the mean errors of both runs over the cells that both have, and their ratios.

    Args:
        before: Cells of the other run.
        now: Cells of the run now.

    Returns:
        A row for each localizer and one for all: ``cells``, and of every error ``_before``,
        ``_now`` and ``_ratio``, the geometric mean of the ratios of single cells.

    Raises:
        InputError: the runs have no cell in common.
    """
    both = before.merge(now, on=["table", *CELL], suffixes=("_before", "_now"))
    if both.empty:
        raise InputError("the runs have no cell in common; compare runs of one design")
    groups = [*both.groupby("model"), ("all", both)]
    return pd.DataFrame([{"localizer": name, **_means(cells)} for name, cells in groups])


def _means(cells: pd.DataFrame) -> dict[str, float]:
    means: dict[str, float] = {"cells": len(cells)}
    for error in ERRORS:
        then, now = cells[f"{error}_before"], cells[f"{error}_now"]
        means[f"{error}_before"], means[f"{error}_now"] = then.mean(), now.mean()
        means[f"{error}_ratio"] = float(np.exp(np.log(now / then).mean()))
    return means


def run(options: argparse.Namespace) -> None:
    """Write the table, and print it."""
    table = compared(cells_of(options.before), cells_of(options.now))
    print(table.to_string(index=False))
    write_frame(options.out, table, "%.4g")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reproduce_errors")
    parser.add_argument("--before", type=Path, required=True, help="results of the other commit")
    parser.add_argument("--now", type=Path, default=Path("results/published/mini"))
    out = Path("results/benchmarks/reproduce_errors.csv")
    parser.add_argument("--out", type=Path, default=out)
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
