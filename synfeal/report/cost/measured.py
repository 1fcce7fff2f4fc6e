"""What the jobs of a run took: processor time and memory, from Snakemake's benchmark files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import floor
from pathlib import Path
from statistics import median
from typing import Any

import pandas as pd

from synfeal.errors import InputError
from synfeal.files import atomic_path

# Snakemake looks at a job every half second for 15 s, then every 30 s; ``cpu_time`` is what it saw
# at its last look.
SHORT_S, SHORT_UNTIL_S, LONG_S = 0.5, 15.0, 30.0
# Shorter jobs are not asked how busy they were: starting up waits for the disk.
LEAST_S = 2.0
COLUMNS = ("stage", "job", "wall_s", "cpu_s", "peak_mb")


@dataclass(frozen=True)
class Measured:
    """One job that ran.

    Attributes:
        stage: folder or file below ``<root>/benchmarks``.
        name: path below that, without ``.tsv``.
        wall_s: from start to end.
        cpu_s: processor time.
        peak_mb: largest resident memory; None where the job was too short to look.
    """

    stage: str
    name: str
    wall_s: float
    cpu_s: float
    peak_mb: float | None

    @property
    def key(self) -> tuple[str, str]:
        """Stage and name."""
        return self.stage, self.name


def read_measured(root: Path) -> list[Measured]:
    """Jobs of a run: from ``<root>/benchmarks``, else from ``<root>/benchmarks.csv``.

    Raises:
        InputError: there is neither, or a measurement cannot be read.
    """
    folder, table = root / "benchmarks", root / "benchmarks.csv"
    paths = sorted(folder.rglob("*.tsv"))
    if paths:
        return read_jobs(paths, folder)
    if table.is_file():
        return _read_table(table)
    raise InputError(f"{root}: holds no benchmarks/**/*.tsv and no benchmarks.csv; name a run")


def read_jobs(paths: Iterable[Path], folder: Path) -> list[Measured]:
    """Jobs by their files below ``folder``, ``<root>/benchmarks``.

    Raises:
        InputError: a measurement cannot be read.
    """
    return _completed([_read_tsv(path, folder) for path in paths])


def write_measured(root: Path) -> None:
    """Keep the measurements below ``<root>/benchmarks`` in one file, ``<root>/benchmarks.csv``."""
    rows = [[*job.key, job.wall_s, job.cpu_s, job.peak_mb] for job in read_measured(root)]
    table = pd.DataFrame(rows, columns=list(COLUMNS)).astype({"peak_mb": float})
    table = table.round({"wall_s": 2, "cpu_s": 2, "peak_mb": 1})
    with atomic_path(root / "benchmarks.csv") as temporary:
        table.to_csv(temporary, index=False, lineterminator="\n")


def last_look_s(wall_s: float) -> float:
    """When Snakemake last looked at a job that ran for ``wall_s``."""
    if wall_s < SHORT_UNTIL_S:
        return SHORT_S * floor(wall_s / SHORT_S)
    return SHORT_UNTIL_S + LONG_S * floor((wall_s - SHORT_UNTIL_S) / LONG_S)


def _read_tsv(path: Path, folder: Path) -> tuple[Measured, float | None]:
    """A job, its processor time as it was seen last, and how busy it was; None when unknown."""
    stage, *rest = path.relative_to(folder).with_suffix("").parts
    try:
        row = pd.read_csv(path, sep="\t", na_values=["-"]).iloc[-1]
        wall_s, cpu_s, peak_mb = (_number(row[name]) for name in ("s", "cpu_time", "max_rss"))
        if wall_s is None:
            raise ValueError("it has no duration")
    except (OSError, IndexError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path}: cannot be read as a measurement of a job ({error!r})") from None
    seen_s = last_look_s(wall_s)
    busy = cpu_s / seen_s if cpu_s and wall_s >= LEAST_S else None
    return Measured(stage, "/".join(rest), wall_s, cpu_s or 0.0, peak_mb), busy


def _completed(jobs: Iterable[tuple[Measured, float | None]]) -> list[Measured]:
    """Processor time up to the end, at the share of a core a job had when last seen.

    What was too short to tell is taken to have had the run's median share.
    """
    jobs = list(jobs)
    usual = median([busy for _, busy in jobs if busy is not None] or [1.0])
    return [
        Measured(j.stage, j.name, j.wall_s, j.wall_s * (usual if busy is None else busy), j.peak_mb)
        for j, busy in jobs
    ]


def _read_table(path: Path) -> list[Measured]:
    types = {"stage": str, "job": str, "wall_s": float, "cpu_s": float, "peak_mb": float}
    try:
        table = pd.read_csv(path, dtype=types, usecols=list(COLUMNS)).fillna({"job": ""})
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as measurements of jobs ({error!r})") from None
    if table[["stage", "wall_s", "cpu_s"]].isna().any(axis=None):
        raise InputError(f"{path}: cannot be read as measurements of jobs (a value is missing)")
    rows = table[list(COLUMNS)].to_dict("records")
    return [
        Measured(row["stage"], row["job"], row["wall_s"], row["cpu_s"], _number(row["peak_mb"]))
        for row in rows
    ]


def _number(value: Any) -> float | None:
    """A job that ends before the first look at it has none."""
    return None if pd.isna(value) else float(value)
