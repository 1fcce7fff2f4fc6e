"""What each stage of a run cost: time and memory, as measured job by job."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from synfeal.errors import InputError


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


def read_stages(benchmarks: Path) -> list[Stage]:
    """Every stage measured below ``benchmarks``, the longest first.

    Raises:
        InputError: a measurement cannot be read.
    """
    jobs: dict[str, list[tuple[float, float | None]]] = {}
    for path in sorted(benchmarks.rglob("*.tsv")):
        name = path.relative_to(benchmarks).parts[0].removesuffix(".tsv")
        jobs.setdefault(name, []).extend(_read(path))
    stages = [_stage(name, measured) for name, measured in jobs.items() if measured]
    return sorted(stages, key=lambda stage: (-stage.seconds, stage.stage))


def _stage(name: str, measured: list[tuple[float, float | None]]) -> Stage:
    seconds = [job[0] for job in measured]
    peaks = [job[1] for job in measured if job[1] is not None]
    return Stage(name, len(measured), sum(seconds), median(seconds), max(peaks, default=None))


def _read(path: Path) -> list[tuple[float, float | None]]:
    """Seconds and peak memory (MB) of each time a job ran."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file, delimiter="\t"))
        if not rows:
            raise ValueError("it has no rows")
        return [(_finite(row["s"]), _number(row["max_rss"])) for row in rows]
    except (OSError, KeyError, ValueError, TypeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as a measurement of a job ({error!r})") from None


def _number(text: str) -> float | None:
    """Memory; a job that ends before the first look at it has none."""
    return None if text in ("", "-", "NA") else _finite(text)


def _finite(text: str) -> float:
    if not 0 <= float(text) < math.inf:
        raise ValueError(f"{text} is no amount")
    return float(text)
