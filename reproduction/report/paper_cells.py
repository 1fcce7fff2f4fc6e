"""Every cell of Tables 2 to 5 beside the printed one, and what that says of the networks' order."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from scipy.stats import spearmanr

from baselines.config.learning import MODELS
from reproduction.config.tables import KEYS
from reproduction.report.findings import read_table

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


def paper_cells(root: Path) -> pd.DataFrame:
    """Pair the cells of a run with the printed ones.

    Args:
        root: Published results, or those of a finished run.

    Returns:
        A row per cell and error: ``table``, ``row`` (the keys of the table's row as one text),
        ``model``, ``quantity`` (``position`` or ``orientation``), ``printed`` and ``ours``
        (metres, root mean square over the axes, or degrees). Cells that the paper has not or
        misprints are left out, and tables that the run has not.
    """
    pairs = []
    for table in TABLES:
        if not (root / "tables" / f"{table}.csv").is_file():
            continue
        cells = read_table(root, table)
        cells = cells[cells.published_flag == "none"]
        keys = [key for key in KEYS[table] if key != "model"]
        row = cells[keys].astype(str).agg(" ".join, axis=1)
        for quantity, ours in OURS.items():
            pairs.append(
                pd.DataFrame(
                    {
                        "table": table,
                        "row": row,
                        "model": cells.model,
                        "quantity": quantity,
                        "printed": cells[PRINTED[quantity]],
                        "ours": cells[ours],
                    }
                )
            )
    columns = ["table", "row", "model", "quantity", "printed", "ours"]
    if not pairs:
        return pd.DataFrame(columns=columns)
    return pd.concat(pairs, ignore_index=True).dropna().reset_index(drop=True)


def ratios(cells: pd.DataFrame, quantity: str) -> dict[str, float]:
    """Return ours over print by network, geometric mean over the rows of Table 4."""
    sizes = cells[(cells.table == SIZES) & (cells.quantity == quantity)]
    logarithms = pd.Series(np.log(sizes.ours / sizes.printed), sizes.index)
    means = logarithms.groupby(sizes.model).mean()
    return {model: math.exp(means[model]) for model in MODELS if model in means}


def rank_correlations(
    cells: pd.DataFrame, quantity: str, within: Literal["row", "model"]
) -> list[float]:
    """Correlate the ranks of ours and print in Table 4 (Spearman).

    Args:
        cells: As :func:`paper_cells` returns them.
        quantity: ``position`` or ``orientation``.
        within: Ranks are those of the networks of a ``row``, or those of the rows of a ``model``.

    Returns:
        A correlation for each row, or for each network.
    """
    sizes = cells[(cells.table == SIZES) & (cells.quantity == quantity)]
    return [
        float(spearmanr(group.printed, group.ours)[0])
        for _, group in sizes.groupby(within, sort=False)
    ]
