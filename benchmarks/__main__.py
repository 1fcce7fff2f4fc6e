"""Command line: measure what a sweep's table lacks, then write its page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.page import write_page
from benchmarks.sweep import read_sweep, run_missing, runs_of
from synfeal.errors import exit_status

SWEEPS = Path(__file__).with_name("sweeps")
OUT = Path("results/benchmarks")


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    names = ", ".join(sorted(path.stem for path in SWEEPS.glob("*.yaml")))
    parser.add_argument("sweep", help=f"one of {names}, or a YAML file of your own")
    parser.add_argument(
        "--results", type=Path, default=Path("results/mini"), help="tree of inputs (results/mini)"
    )
    parser.add_argument("--out", type=Path, help=f"without ending ({OUT}/NAME)")
    parser.add_argument("--seeds", type=int, help="runs of each combination, else the sweep's")
    parser.add_argument("--jobs", type=int, default=1, help="runs side by side (1)")
    return parser


def run(options: argparse.Namespace) -> None:
    """Measure, then write ``<out>.csv``, ``<out>.md`` and the picture."""
    path = Path(options.sweep)
    path = path if path.suffix == ".yaml" else SWEEPS / f"{options.sweep}.yaml"
    sweep = read_sweep(path)
    out = options.out or OUT / path.stem
    runs = runs_of(sweep, options.results, options.seeds or sweep.seeds)
    rows = run_missing(sweep.measure, runs, out.with_suffix(".csv"), options.jobs)
    write_page(out, path.stem, sweep, rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
