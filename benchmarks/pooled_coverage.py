"""Simulate how often pooled limits contain the truth, by replications and by what they differ in.

    python -m benchmarks.pooled_coverage results/benchmarks/pooled_coverage.csv

A replication's effect is the true one, plus a deviation of its own, plus the error of its test
paths, whose standard error it knows. ``share_between`` is the part of the variance that is the
replications' own; test paths differ in number, so that standard errors differ up to twofold. In a
``failing_share`` of replications something fails, as SfM does in some rooms, and the effect is ten
standard deviations larger; the truth is its mean over replications of both kinds.
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
FAILING = (0.1, 0.2, 0.3)
FAILURE = 10.0  # standard deviations
SIMULATED = 4000


def coverage(
    replications: int,
    share_between: float,
    simulated: int,
    rng: np.random.Generator,
    failing_share: float = 0.0,
) -> float:
    """Simulate sets of replications, and return the share whose limits contain the truth.

    Args:
        replications: Replications of each set.
        share_between: Part of the mean variance that lies between replications, 0 to 1.
        simulated: Number of sets.
        rng: Source of all draws.
        failing_share: Probability that a replication fails.
    """
    covered, truth = 0, failing_share * FAILURE
    for _ in range(simulated):
        within = (1 - share_between) * rng.uniform(0.4, 1.6, replications)
        own = np.sqrt(share_between) * rng.standard_normal(replications)
        effects = own + np.sqrt(within) * rng.standard_normal(replications)
        if failing_share:
            effects += FAILURE * (rng.uniform(size=replications) < failing_share)
        found = pool(effects, within)
        covered += found.low <= truth <= found.high
    return covered / simulated


def main() -> None:
    """Write the table that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    table = parser.parse_args().table
    rng = np.random.default_rng(0)
    cases = [(count, share, 0.0) for count in REPLICATIONS for share in SHARES]
    cases += [(5, 0.5, failing) for failing in FAILING]
    rows = [
        {
            "replications": count,
            "share_between": share,
            "failing_share": failing,
            "coverage": coverage(count, share, SIMULATED, rng, failing),
            "simulated": SIMULATED,
        }
        for count, share, failing in cases
    ]
    write_frame(table, pd.DataFrame(rows), "%.4g")


if __name__ == "__main__":
    main()
