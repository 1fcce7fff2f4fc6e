"""Seconds of jobs, from those of measured runs."""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from pathlib import Path

import pandas as pd

from reproduction.design.profiles import read_profile
from reproduction.plan.jobs import jobs_of
from reproduction.runs.job_times import read_measured
from synfeal.errors import InputError

# Largest over smallest job of a pace from which the difference tells its start from its work.
LEAST_RATIO = 1.5


def read_run(root: Path) -> pd.DataFrame:
    """Read the measured jobs of a run.

    Args:
        root: Its results; the directory is called like its profile, as the workflow calls it.

    Returns:
        Those jobs of the profile (:func:`reproduction.plan.jobs.jobs_of`) that were measured, with
        ``cpu_s``, seconds of the processor.

    Raises:
        InputError: No job of the profile was measured.
    """
    measured = read_measured(root)
    names = measured["stage"].str.cat(measured["job"], sep="/").str.rstrip("/")
    jobs = jobs_of(read_profile(root.resolve().name))
    jobs = jobs.merge(measured.assign(job=names)[["job", "cpu_s"]], on="job")
    if jobs.empty:
        raise InputError(root, "none of its measured jobs is one of the profile's")
    return jobs


def paces_of(measured: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Compute what jobs of runs (:func:`read_run`) take.

    Returns:
        A row for each pace: ``start_s`` of a job, ``px_s`` for each pixel of its cost, and
        ``largest``, the cost of the largest one.
    """
    jobs = pd.concat(list(measured))
    program_s = float(jobs.groupby("pace")["cpu_s"].median().min())
    paces = {name: _pace(group, program_s) for name, group in jobs.groupby("pace")}
    return pd.DataFrame.from_dict(paces, "index", columns=["start_s", "px_s", "largest"])


def _pace(jobs: pd.DataFrame, program_s: float) -> list[float]:
    """Compute start and seconds per pixel, which meet the measured sum, and the largest cost."""
    seconds, cost = jobs["cpu_s"], jobs["cost"]
    start_s, largest = program_s, float(cost.max())
    if largest >= LEAST_RATIO * cost.min():  # the small ones show it
        is_small = cost <= sqrt(cost.min() * largest)
        at_small, at_large = cost[is_small].mean(), cost[~is_small].mean()
        small_s, large_s = seconds[is_small].mean(), seconds[~is_small].mean()
        rise = max(large_s - small_s, 0.0) / (at_large - at_small)
        start_s = max(small_s - rise * at_small, 0.0)
    start_s = min(start_s, float(seconds.min()))
    return [start_s, float((seconds - start_s).sum() / cost.sum()), largest]


def seconds_of(jobs: pd.DataFrame, paces: pd.DataFrame) -> pd.Series[float]:
    """Predict the seconds of jobs; NaN where their pace was not measured."""
    pace = jobs[["pace"]].join(paces, on="pace")
    return pace["start_s"] + pace["px_s"] * jobs["cost"]
