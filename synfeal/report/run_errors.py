"""The errors of one run over its test frames: ``errors.csv`` of a training run."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from synfeal.dataset.number_table import read_numbers
from synfeal.report.stats import MEASURES

COLUMNS = ("frame", *MEASURES)


def read_errors(path: Path) -> pd.DataFrame:
    """A row per test frame, columns :data:`COLUMNS`; not finite where a prediction failed.

    Raises:
        InputError: it is missing, or holds anything but these columns of numbers.
    """
    values = read_numbers(path, ",".join(COLUMNS), "table of errors", finite=False)
    return pd.DataFrame(values, columns=list(COLUMNS))
