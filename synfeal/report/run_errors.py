"""The errors of one training run over test frames: ``errors.csv`` and ``common_errors.csv``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from synfeal.dataset.number_table import read_numbers
from synfeal.report.stats import MEASURES

COLUMNS = ("frame", *MEASURES)
COMMON_COLUMNS = COLUMNS[:3]


def read_errors(path: Path, columns: Sequence[str] = COLUMNS) -> pd.DataFrame:
    """A row per test frame; not finite where a prediction failed."""
    values = read_numbers(path, ",".join(columns), "table of errors", finite=False)
    return pd.DataFrame(values, columns=list(columns))
