"""What each stage of a run cost: time and memory, as measured job by job."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from synfeal.frames import MAYBE, NUMBER, read_frame, records_of

# A job that ends before Snakemake's first look at it has no memory.
JOB = {"s": NUMBER, "max_rss": MAYBE}


@dataclass(frozen=True)
class Stage:
    """The jobs of one stage.

    Attributes:
        stage: its name, a folder (or file) of ``<root>/benchmarks``.
        jobs: how many were measured.
        seconds: of all of them together.
        median_seconds: of one.
        peak_mb: largest resident memory of any, MB; None where all were too short to measure.
    """

    stage: str
    jobs: int
    seconds: float
    median_seconds: float
    peak_mb: float | None


def read_stages(paths: Iterable[Path], benchmarks: Path) -> list[Stage]:
    """Every stage measured, by files below ``benchmarks``, the longest first.

    Raises:
        InputError: a measurement cannot be read.
    """
    jobs = [_read(path, benchmarks) for path in sorted(paths)]
    if not jobs:
        return []
    stages = (
        pd.concat(jobs)
        .groupby("stage")
        .agg(
            jobs=("s", "size"),
            seconds=("s", "sum"),
            median_seconds=("s", "median"),
            peak_mb=("max_rss", "max"),
        )
        .reset_index()
        .sort_values(["seconds", "stage"], ascending=[False, True])
    )
    return [
        Stage(**row | {"peak_mb": None if pd.isna(row["peak_mb"]) else row["peak_mb"]})
        for row in records_of(stages)
    ]


def _read(path: Path, benchmarks: Path) -> pd.DataFrame:
    """Seconds and peak memory (MB) of each time a job ran."""
    stage = path.relative_to(benchmarks).parts[0].removesuffix(".tsv")
    return read_frame(path, JOB, "run that job again", sep="\t").assign(stage=stage)
