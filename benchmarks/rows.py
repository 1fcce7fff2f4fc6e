"""Tables of measurements that grow row by row, whose columns are those of what was measured."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pandas as pd

from synfeal.records.tables import read_records


def read_rows(path: Path, text: Collection[str] = ()) -> pd.DataFrame:
    """Read the rows that were measured so far.

    Args:
        path: CSV, which need not exist.
        text: Columns that it must have and that stay text.

    Returns:
        All columns of the file. Those that hold numbers alone are numbers; an empty cell is
        missing.

    Raises:
        InputError: The file is no CSV, or lacks a column of ``text``.
    """
    if not path.exists():
        return pd.DataFrame(columns=list(text), dtype=str)
    records = read_records(path, text, "move it away")
    table = pd.DataFrame.from_records([row for _, row in records])
    for name in table.columns.difference(list(text)):
        cells = table[name].replace("", None)
        try:
            table[name] = pd.to_numeric(cells)
        except ValueError:
            table[name] = cells
    return table
