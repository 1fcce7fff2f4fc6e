"""Share of the time of jobs in which they do not draw or train, from the logs of a run.

Writes ``results/benchmarks/starting.csv``, a row for each kind of job::

    python -m benchmarks.starting --results results/mini

A job that renders says how long its frames took, one that trains how many images a second it was
shown. The rest of its time, by Snakemake's clock, is starting; of training also predicting and
scoring.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from reproduction.runs.job_times import read_measured
from synfeal.errors import InputError, exit_status
from synfeal.records.tables import write_frame

RENDERED = re.compile(r"(\d+) frames in ([\d.]+) s")
TRAINED = re.compile(r"(\d+) of \1 samples, .* (\d+) samples/s")


def drawing_s(log: str) -> float:
    """Return the seconds in which a job drew frames; NaN where its log does not say."""
    found = RENDERED.findall(log)
    return float(found[-1][1]) if found else float("nan")


def training_s(log: str) -> float:
    """Return the seconds in which a job trained; NaN where its log does not say."""
    found = TRAINED.findall(log)
    return int(found[-1][0]) / int(found[-1][1]) if found else float("nan")


WORK: dict[str, Callable[[str], float]] = {"render_packed": drawing_s, "train": training_s}


def shares(jobs: pd.DataFrame, logs: Path) -> pd.DataFrame:
    """Compute the mean seconds of jobs and of their work, by stage.

    Args:
        jobs: Jobs of a run, with ``stage``, ``job`` and ``wall_s``.
        logs: Its folder of logs, named like the jobs.

    Raises:
        InputError: no log of a stage says how long its work took.
    """
    rows = []
    for stage, work_s in WORK.items():
        of_stage = jobs[jobs["stage"] == stage]
        texts = [(logs / stage / f"{job}.log").read_text() for job in of_stage["job"]]
        told = of_stage.assign(work_s=list(map(work_s, texts))).dropna(subset=["work_s"])
        if told.empty:
            raise InputError(f"{logs / stage}: no log says how long the work of a job took")
        wall_s, working_s = told["wall_s"].mean(), told["work_s"].mean()
        row = {"stage": stage, "jobs": len(told), "wall_s": wall_s, "work_s": working_s}
        rows.append({**row, "rest_share": 1.0 - working_s / wall_s})
    return pd.DataFrame(rows)


def run(options: argparse.Namespace) -> None:
    """Write the table, and print it."""
    table = shares(read_measured(options.results), options.results / "logs")
    print(table.to_string(index=False))
    write_frame(options.out, table, "%.3g")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.starting")
    parser.add_argument("--results", type=Path, default=Path("results/mini"))
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/starting.csv"))
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
