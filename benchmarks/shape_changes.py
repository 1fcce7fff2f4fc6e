"""Compare label errors of each shape with exact labels, frame by frame.

    python -m benchmarks.shape_changes results/shapes/tables/shape_changes.csv --profile shapes

Table 6 has medians with limits, but not the errors of single frames, so that limits of changes
between its rows are computed as if their frames were different ones. This reads the errors of a
finished run and compares them on the same test frames, as the claims do: a row for each shape
against exact labels, and one for each pair of shapes, in percentage points. The table is published
with the run, and the third finding has its limits from there.
"""

from __future__ import annotations

import argparse
from itertools import combinations
from pathlib import Path
from typing import Any

import pandas as pd

from baselines.config.learning import MODELS
from reproduction.claims.evidence import COMMON, QUANTITIES, Cell, Evidence, evidence_of
from reproduction.claims.labels import changes
from reproduction.config.load import load_config
from reproduction.design.experiments import read_design
from reproduction.report.findings import SHAPES
from reproduction.statistics.seeds import limits
from synfeal.evaluation.bootstrap import Array, difference, mean_of
from synfeal.records.tables import write_frame

ENDING = "-p0.3-r20"  # of the label sets that are compared


def change_of(evidence: Evidence, shape: str) -> Array:
    """Sample the changes (2, B) in percent from exact labels, means over the localizers."""
    wrong = [Cell(model, labels=f"{shape}{ENDING}") for model in MODELS]
    return mean_of(list(changes(evidence, wrong, [Cell(model) for model in MODELS])))


def rows_of_change(evidence: Evidence, name: str, change: Array) -> list[dict[str, Any]]:
    """Describe a change by a row for either error."""
    rows = []
    for quantity, sample in zip(QUANTITIES, change, strict=True):
        low, high = limits(sample, evidence.layout)
        row = {"change": name, "error": quantity, "percent": float(sample[0])}
        rows.append({**row, "percent_low": low, "percent_high": high})
    return rows


def main() -> None:
    """Compare the shapes of the run that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--profile", default="shapes")
    parser.add_argument("--results", type=Path, default=Path("results"))
    args = parser.parse_args()
    config = load_config(Path("config/config.yaml"), Path(f"config/{args.profile}.yaml"))
    evidence = evidence_of(read_design(config), args.results / args.profile).under(COMMON)
    found = {shape: change_of(evidence, shape) for shape in SHAPES}
    rows = [row for shape in found for row in rows_of_change(evidence, shape, found[shape])]
    for less, more in combinations(found, 2):
        gap = difference(found[more], found[less])
        rows += rows_of_change(evidence, f"{more} more than {less}", gap)
    write_frame(args.table, pd.DataFrame(rows), "%.4g")


if __name__ == "__main__":
    main()
