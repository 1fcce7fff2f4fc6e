"""Errors of networks and of labels in metres and degrees, beside the effects of the claims.

``cell_errors.csv`` has the median error of every cell, ``label_errors.csv`` how far off the labels
that each method gives training frames are. Pooled replications write both: geometric means with
limits over them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.claims.tables import REMEDY
from synfeal.records.tables import COUNT, LIMITLESS, LIMITLESS_MAYBE, TEXT, read_frame

CELL_ERRORS, LABEL_ERRORS = "cell_errors.csv", "label_errors.csv"
UNITS = ("position_m", "orientation_deg")
ERRORS = {
    f"{unit}{end}": kind
    for unit in UNITS
    for end, kind in {"": LIMITLESS, "_low": LIMITLESS_MAYBE, "_high": LIMITLESS_MAYBE}.items()
}
CELLS_SCHEMA = {
    "model": TEXT,
    "scene": TEXT,
    "size": TEXT,
    "labels": TEXT,
    "init": TEXT,
    "test_set": TEXT,
    "against": TEXT,
    **ERRORS,
    "replications": COUNT,
}
RMSE = "position_m_rmse"  # of all frames of all replications, which single failures show in
LABELS_SCHEMA = {"method": TEXT, **ERRORS, RMSE: LIMITLESS, "replications": COUNT}


def read_cell_errors(folder: Path) -> pd.DataFrame:
    """Read the errors of cells; positions are distances.

    Raises:
        InputError: The table cannot be read.
    """
    return read_frame(folder / CELL_ERRORS, CELLS_SCHEMA, REMEDY)


def read_label_errors(folder: Path) -> pd.DataFrame:
    """Read the median errors of training labels, and their root mean square, by method.

    Raises:
        InputError: The table cannot be read.
    """
    return read_frame(folder / LABEL_ERRORS, LABELS_SCHEMA, REMEDY)


def limits_columns(unit: str, value: float, low: float, high: float) -> dict[str, Any]:
    """Name a value and its limits as the tables do."""
    return {unit: value, f"{unit}_low": low, f"{unit}_high": high}
