"""Processor time and memory of a job as a function of its size, from jobs that were measured."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from synfeal.report.cost.jobs import TRAINING

# Least ratio of the largest to the smallest job that tells the fixed part from the part per unit.
LEAST_RATIO = 1.5
# Relative residual from which a job counts as an outlier: another job had the processor.
OUTLIER = 0.15
# A range needs this many jobs.
LEAST_JOBS = 3
QUANTILES = (0.1, 0.9)
# A law: seconds of a job are ``fixed_s + rate_other * other + rate * size``, and 10 and 90 % of the
# measured ones are below ``low`` and ``high`` times that (1 for under three jobs). ``largest`` of
# the measured sizes, NaN where all jobs are alike; ``base_mb``, peak memory without the data a job
# holds, NaN where it was not measured.
LAW = ("fixed_s", "rate_other", "rate", "low", "high", "largest", "base_mb")


def matched(jobs: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    """Measured jobs with what is known of those of the same name."""
    return measured.merge(jobs, on=["stage", "job"])


def fit_laws(pairs: pd.DataFrame, training: tuple[float, ...] | None = None) -> pd.DataFrame:
    """A law (columns :data:`LAW`) by its name, for all measured jobs that :func:`matched` gives.

    ``training`` are the parts per unit of training runs, where they are known better.
    """
    start_s = _start(pairs)
    laws = {
        name: _law(group, start_s, training if name == TRAINING else None)
        for name, group in pairs.groupby("law", sort=False)
    }
    return pd.DataFrame.from_dict(laws, orient="index", columns=list(LAW), dtype=float)


def seconds_of(jobs: pd.DataFrame, laws: pd.DataFrame) -> pd.Series[float]:
    """Seconds of every job by its law; NaN where there is none."""
    law = jobs[["law"]].join(laws, on="law")
    work = law["rate_other"] * jobs["other"].fillna(0.0) + law["rate"] * jobs["size"].fillna(0.0)
    return law["fixed_s"] + work


def fit_seconds(
    sizes: NDArray[np.float64], seconds: NDArray[np.float64], start_s: float
) -> tuple[float, tuple[float, ...]]:
    """Fixed part, at least the start of a program, and parts per unit, none negative.

    Sizes (N, K) that differ enough are fitted by robust least squares on relative residuals. Else
    the fixed part is the start of a program, and what all jobs took beyond that is per main (last)
    unit.
    """
    n_units = sizes.shape[1]
    if n_units == 0:
        return float(np.mean(seconds)), ()
    varied = max(np.ptp(np.log(np.maximum(column, 1e-12))) for column in sizes.T)
    if len(sizes) >= 2 * (n_units + 1) and varied >= np.log(LEAST_RATIO):
        return _regression(sizes, seconds, min(start_s, float(seconds.min())))
    fixed_s, work = min(start_s, float(np.median(seconds))), float(sizes[:, -1].sum())
    rate = max(float(np.sum(seconds - fixed_s)), 0.0) / work if work else 0.0
    return fixed_s, (*[0.0] * (n_units - 1), rate)


def _regression(
    sizes: NDArray[np.float64], seconds: NDArray[np.float64], least_s: float
) -> tuple[float, tuple[float, ...]]:
    """Fixed part and parts per unit, none negative, the fixed part at least ``least_s``."""
    design = np.column_stack([np.ones(len(sizes)), sizes])
    scale = np.maximum(design.max(axis=0), 1e-12)
    weighted = design / scale / seconds[:, None]
    least = np.array([least_s, *[0.0] * sizes.shape[1]])
    fit = least_squares(
        lambda x: weighted @ x - 1,
        least + seconds.mean() / len(least),
        bounds=(least, np.inf),
        loss="soft_l1",
        f_scale=OUTLIER,
    )
    fixed_s, *rates = fit.x / scale
    return float(fixed_s), tuple(float(rate) for rate in rates)


def _law(pairs: pd.DataFrame, start_s: float, known: tuple[float, ...] | None) -> list[float]:
    sizes = pairs[["other", "size"]].dropna(axis="columns").to_numpy()
    seconds = np.maximum(pairs["cpu_s"].to_numpy(), 1e-3)
    if known is None:
        fixed_s, rates = fit_seconds(sizes, seconds, start_s)
        # Scenes differ, and a robust fit follows most jobs: the sum of all is what is asked for.
        level = float(seconds.sum() / (fixed_s + sizes @ np.array(rates)).sum())
        fixed_s, rates = fixed_s * level, tuple(rate * level for rate in rates)
    else:
        rates = known
        fixed_s = max(start_s, float(np.median(seconds - sizes @ np.array(rates))))
    spread = np.ones(2)
    if len(pairs) >= LEAST_JOBS:
        spread = np.quantile(seconds / (fixed_s + sizes @ np.array(rates)), QUANTILES)
    base_mb = (pairs["peak_mb"] - pairs["held_bytes"] / 1e6).max()
    return [fixed_s, *(0.0, 0.0, *rates)[-2:], *spread, pairs["size"].max(), base_mb]


def _start(pairs: pd.DataFrame) -> float:
    """Seconds to start a program: the median of the stage where it is least."""
    stages = pairs.groupby("stage")["cpu_s"].agg(["median", "size"])
    enough = stages[stages["size"] >= LEAST_JOBS]
    return float((enough if len(enough) else stages)["median"].min())
