"""Choose which of the published results a page tells, and read their tables."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from reproduction.runs.published import HEADLINES, PUBLISHED
from reproduction.tables.cells import schema_of
from synfeal.records.tables import Schema, read_frame


def headline(published: Path = PUBLISHED) -> Path:
    """Return the largest single run of all tables that is published."""
    found = (published / name for name in HEADLINES if (published / name).is_dir())
    return next(found, published / HEADLINES[-1])


def read_table(root: Path, name: str, schema: Schema | None = None) -> pd.DataFrame:
    """Read a table of published results.

    Args:
        root: Published results, or those of a finished run.
        name: Name of the table, without folder and suffix.
        schema: Columns to read; None for those of a table of localizers.

    Raises:
        InputError: the table is missing or lacks a column.
    """
    kinds = schema or schema_of(name, repeated=True)
    return read_frame(root / "tables" / f"{name}.csv", kinds, "publish again")
