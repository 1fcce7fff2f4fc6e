"""Read what the jobs of a run took, from Snakemake's benchmark files."""

from __future__ import annotations

from collections.abc import Iterable
from math import floor
from pathlib import Path

import pandas as pd

from reproduction.runs.renamed import with_present_names
from synfeal.errors import InputError
from synfeal.records.tables import MAYBE, NUMBER, TEXT, read_frame, write_frame

# Snakemake looks at a job every half second for 15 s, then every 30 s; ``cpu_time`` is what it saw
# at its last look.
SHORT_S, SHORT_UNTIL_S, LONG_S = 0.5, 15.0, 30.0
# Shorter jobs are not asked how busy they were: starting up waits for the disk.
LEAST_S = 2.0
SCHEMA = {"stage": TEXT, "job": TEXT, "wall_s": NUMBER, "cpu_s": NUMBER, "peak_mb": MAYBE}
# Of Snakemake's files, whose cells may be ``-`` or ``NA``.
BENCHMARK = {"s": NUMBER, "cpu_time": MAYBE, "max_rss": MAYBE}
REMEDY = "run that job again, or leave its measurement out"


def read_measured(root: Path) -> pd.DataFrame:
    """Read the jobs of a run from ``<root>/benchmarks``, else from ``<root>/benchmarks.csv``.

    Raises:
        InputError: The run has neither.
    """
    folder, table = root / "benchmarks", root / "benchmarks.csv"
    paths = sorted(folder.rglob("*.tsv"))
    if paths:
        return with_present_names(read_jobs(paths, folder))
    if not table.is_file():
        raise InputError(root, "holds no benchmarks/**/*.tsv and no benchmarks.csv", "name a run")
    return with_present_names(read_frame(table, SCHEMA, "name another run"))


def read_jobs(paths: Iterable[Path], folder: Path) -> pd.DataFrame:
    """Read jobs from their files below ``folder``, ``<root>/benchmarks``.

    Processor time is completed up to the end, at the share of a core a job had when last seen. What
    was too short to tell is taken to have had the run's median share.
    """
    records = [_read_tsv(path, folder) for path in paths]
    jobs = pd.DataFrame.from_records(records, columns=list(SCHEMA)).astype({"cpu_s": float})
    seen_s = jobs["wall_s"].map(last_look_s)
    told = (jobs["cpu_s"] > 0) & (jobs["wall_s"] >= LEAST_S)
    busy = (jobs["cpu_s"] / seen_s).where(told)
    usual = busy.median() if told.any() else 1.0
    return jobs.assign(cpu_s=jobs["wall_s"] * busy.fillna(usual))


def write_measured(jobs: pd.DataFrame, root: Path) -> None:
    """Keep the jobs of :func:`read_jobs` in one file, ``<root>/benchmarks.csv``."""
    table = jobs.round({"wall_s": 2, "cpu_s": 2, "peak_mb": 1})
    write_frame(root / "benchmarks.csv", table, float_format=None)


def last_look_s(wall_s: float) -> float:
    """Return when Snakemake last looked at a job that ran for ``wall_s``."""
    if wall_s < SHORT_UNTIL_S:
        return SHORT_S * floor(wall_s / SHORT_S)
    return SHORT_UNTIL_S + LONG_S * floor((wall_s - SHORT_UNTIL_S) / LONG_S)


def _read_tsv(path: Path, folder: Path) -> tuple[str, str, float, float, float]:
    """Read a job, its processor time as it was seen last."""
    stage, *rest = path.relative_to(folder).with_suffix("").parts
    rows = read_frame(path, BENCHMARK, REMEDY, sep="\t")
    if rows.empty:
        raise InputError(path, "has no rows", REMEDY)
    return stage, "/".join(rest), *rows.iloc[-1]
