"""Read the tables of pooled replications."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pandas as pd

from reproduction.replications.pooling import CLAIMS, EFFECTS
from synfeal.records.tables import (
    COUNT,
    LIMITLESS,
    LIMITLESS_MAYBE,
    MAYBE,
    TEXT,
    Kind,
    read_frame,
)

REPLICATIONS = "replications"  # folder of archives and pooled tables, among published runs
REMEDY = "pool the replications again: python -m reproduction.replications pool"
AGAINST = Kind("str", optional=True)  # empty of batches, which no score is needed for
EFFECTS_SCHEMA = {
    "claim": TEXT,
    "part": TEXT,
    "quantity": TEXT,
    "against": AGAINST,
    "replication": TEXT,
    "value": LIMITLESS,
    "low": LIMITLESS_MAYBE,
    "high": LIMITLESS_MAYBE,
    "printed": MAYBE,
    "unit": TEXT,
}
CLAIMS_SCHEMA = {"claim": TEXT, "against": AGAINST, "verdict": TEXT, "replications": COUNT}


def has_pooled(folder: Path) -> bool:
    """Tell whether replications have been pooled there."""
    return all((folder / name).is_file() for name in (EFFECTS, CLAIMS))


class PooledTables(NamedTuple):
    """What replications come to together.

    Attributes:
        effects: ``claim_effects.csv``: a row for each effect and replication, and the pooled one.
        verdicts: ``claims.csv``: the verdict on each claim by its id and what errors are against.
    """

    effects: pd.DataFrame
    verdicts: dict[tuple[str, str], str]


def read_pooled(folder: Path) -> PooledTables:
    """Read both tables of pooled replications.

    Raises:
        InputError: One cannot be read.
    """
    rows = read_frame(folder / CLAIMS, CLAIMS_SCHEMA, REMEDY)
    keys = zip(rows["claim"], rows["against"].fillna(""), strict=True)
    return PooledTables(
        effects=read_frame(folder / EFFECTS, EFFECTS_SCHEMA, REMEDY),
        verdicts=dict(zip(keys, rows["verdict"], strict=True)),
    )
