"""Every cell of Tables 2 to 5 beside the printed one: pooled over replications, or of one run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from baselines.config.learning import MODELS
from reproduction.claims.effects import OWN, printed_cell
from reproduction.claims.evidence import COMMON, Cell
from reproduction.claims.levels import UNITS, read_cell_errors
from reproduction.config.tables import KEYS
from reproduction.replications.archive import ON_COMMON
from reproduction.report.published import read_table
from reproduction.tables.cells import published_frame
from synfeal.records.tables import rows_of

TABLES = {
    "table2_ground_truth": "Table 2, labels",
    "table3_inconsistencies": "Table 3, noise",
    "table4_size": "Table 4, size",
    "table5_from_scratch": "Table 5, start",
}
SIZES = "table4_size"
# The paper's unit of position: root mean square over the axes. Both are against the labels of the
# test set, as the paper's are.
OURS = {"position": "position_rms_m", "orientation": "orientation_deg"}
PRINTED = {"position": "published_position_m", "orientation": "published_orientation_deg"}
PRINTED_ERRORS = {unit: f"printed_{unit}" for unit in UNITS}
COLUMNS = ("table", "row", "model", "quantity", "printed", "ours", "replications")


def paper_cells(root: Path) -> pd.DataFrame:
    """Pair the cells of a run with the printed ones.

    Args:
        root: Published results, or those of a finished run.

    Returns:
        A row per cell and error: ``table``, ``row`` (the keys of the table's row as one text),
        ``model``, ``quantity`` (``position`` or ``orientation``), ``printed`` and ``ours``
        (metres, root mean square over the axes, or degrees), and 1 as ``replications``. Cells that
        the paper has not or misprints are left out, and tables that the run has not.
    """
    pairs = []
    for table in TABLES:
        if not (root / "tables" / f"{table}.csv").is_file():
            continue
        cells = read_table(root, table)
        cells = cells[cells.published_flag == "none"]
        pairs += [
            _paired(table, cells, quantity, cells[PRINTED[quantity]], cells[ours]).assign(
                replications=1
            )
            for quantity, ours in OURS.items()
        ]
    return _together(pairs)


def pooled_cells(folder: Path) -> pd.DataFrame:
    """Pair the errors of cells over replications with the printed ones.

    Args:
        folder: Pooled tables.

    Returns:
        As :func:`paper_cells`, with the number of replications. Tables 2 and 3 are against the
        labels of their test sets; those of Tables 4 and 5, whose test set all sizes share, are
        exact.
    """
    pairs = []
    for table in TABLES:
        cells = pooled_rows(folder, table)
        cells = cells[cells["flag"] == "none"]
        # The paper's unit of position: root mean square over the axes.
        values = {
            "position": (cells["printed_position_m"], cells["position_m"] / math.sqrt(3)),
            "orientation": (cells["printed_orientation_deg"], cells["orientation_deg"]),
        }
        pairs += [
            _paired(table, cells, quantity, *both).assign(replications=cells["replications"])
            for quantity, both in values.items()
        ]
    return _together(pairs)


def pooled_rows(folder: Path, table: str) -> pd.DataFrame:
    """Join printed cells of a table with the errors over replications.

    Args:
        folder: Pooled tables.
        table: Name of the table.

    Returns:
        The columns of the printed table, its errors as ``printed_...``, and those of
        ``cell_errors.csv``; errors are missing where replications have no such cell.
    """
    printed = published_frame(table).rename(columns=lambda name: PRINTED_ERRORS.get(name, name))
    keys = [*Cell._fields, "test_set", "against"]
    errors = read_cell_errors(folder).set_index(keys)
    score = (COMMON, "true") if table in ON_COMMON else (OWN, "labels")
    cells = [(*printed_cell(row), *score) for row in rows_of(printed)]
    ours = errors.reindex(pd.MultiIndex.from_tuples(cells, names=keys)).reset_index(drop=True)
    return pd.concat([printed.reset_index(drop=True), ours], axis=1)


def best_known_cells(root: Path, folder: Path) -> pd.DataFrame:
    """Take cells from pooled replications, and those that they have not from one run.

    Args:
        root: Published results of one run.
        folder: Pooled tables.
    """
    cells = pd.concat([pooled_cells(folder), paper_cells(root)], ignore_index=True)
    return cells.drop_duplicates(list(COLUMNS[:4])).reset_index(drop=True)


def _paired(
    table: str, cells: pd.DataFrame, quantity: str, printed: pd.Series, ours: pd.Series
) -> pd.DataFrame:
    keys = [key for key in KEYS[table] if key != "model"]
    row = cells[keys].astype(str).agg(" ".join, axis=1)
    values = {"model": cells["model"], "quantity": quantity, "printed": printed, "ours": ours}
    return pd.DataFrame({"table": table, "row": row, **values})


def _together(pairs: Sequence[pd.DataFrame]) -> pd.DataFrame:
    if not pairs:
        return pd.DataFrame(columns=COLUMNS)
    found = pd.concat(pairs, ignore_index=True).dropna().reset_index(drop=True)
    return found.astype({"replications": int})[list(COLUMNS)]


def ratios(cells: pd.DataFrame, quantity: str) -> dict[str, float]:
    """Return ours over print by network, geometric mean over the rows of Table 4."""
    sizes = cells[(cells.table == SIZES) & (cells.quantity == quantity)]
    logarithms = pd.Series(np.log(sizes.ours / sizes.printed), sizes.index)
    means = logarithms.groupby(sizes.model).mean()
    return {model: math.exp(means[model]) for model in MODELS if model in means}
