"""Simulate how often pooled limits contain the truth, by replications and by what they differ in.

    python -m benchmarks.pooled_coverage results/benchmarks/pooled_coverage.csv

A replication's effect is the true one, plus a deviation of its own, plus the error of its test
paths, whose standard error it knows. ``share_between`` is the part of the variance that is the
replications' own; test paths differ in number, so that standard errors differ up to twofold.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from reproduction.statistics.pooled import pool
from synfeal.records.tables import write_frame

SHARES = (0.0, 0.5, 0.9, 1.0)
REPLICATIONS = (3, 5, 8)
SIMULATED = 4000


def coverage(
    replications: int, share_between: float, simulated: int, rng: np.random.Generator
) -> float:
    """Simulate sets of replications, and return the share whose limits contain the truth.

    Args:
        replications: Replications of each set.
        share_between: Part of the mean variance that lies between replications, 0 to 1.
        simulated: Number of sets.
        rng: Source of all draws.
    """
    covered = 0
    for _ in range(simulated):
        within = (1 - share_between) * rng.uniform(0.4, 1.6, replications)
        own = np.sqrt(share_between) * rng.standard_normal(replications)
        effects = own + np.sqrt(within) * rng.standard_normal(replications)
        found = pool(effects, within)
        covered += found.low <= 0.0 <= found.high
    return covered / simulated


def main() -> None:
    """Write the table that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    table = parser.parse_args().table
    rng = np.random.default_rng(0)
    rows = [
        {
            "replications": count,
            "share_between": share,
            "coverage": coverage(count, share, SIMULATED, rng),
            "simulated": SIMULATED,
        }
        for count in REPLICATIONS
        for share in SHARES
    ]
    write_frame(table, pd.DataFrame(rows), "%.4g")


if __name__ == "__main__":
    main()
