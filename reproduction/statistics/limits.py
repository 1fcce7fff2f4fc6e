"""Scores and errors of single runs, combined to the numbers of a table cell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean, stdev
from typing import Annotated, Any

import pandas as pd
from pydantic import Field, FiniteFloat, NonNegativeInt
from scipy.stats import binomtest

from reproduction.runs.results import read_result, shaped
from reproduction.statistics.seeds import half_width
from synfeal.records.tables import read_numbers

MEASURES = ("position_m", "orientation_deg", "position_m_true", "orientation_deg_true")
# Columns of ``errors.csv`` and ``common_errors.csv``.
COLUMNS = ("frame", *MEASURES)
COMMON_COLUMNS = COLUMNS[:3]
COUNTS = ("n_train", "n_test", "failed")
BASELINES = tuple(f"baseline_{measure}" for measure in MEASURES)
FLOORS = tuple(f"floor_{measure}" for measure in MEASURES[:2])
Metrics = Mapping[str, Any]
# What the limits of a cell cover, as tables say it.
PATHS, PATHS_AND_SEEDS = "paths", "paths and seeds"
REMEDY = "score that run again"
Score = Annotated[FiniteFloat, Field(ge=0)]


def read_metrics(path: Path) -> Metrics:
    """Read the scores of one run."""
    limits = [f"{measure}_{end}" for measure in MEASURES for end in ("low", "high")]
    scores = (*MEASURES, *limits, "position_rms_m", *BASELINES, *FLOORS)
    values = read_result(path, (*COUNTS, *scores), REMEDY)
    shaped(path, {name: values[name] for name in COUNTS}, dict[str, NonNegativeInt], REMEDY)
    shaped(path, {name: values[name] for name in scores}, dict[str, Score | None], REMEDY)
    return dict(values)


def read_errors(path: Path, columns: Sequence[str] = COLUMNS) -> pd.DataFrame:
    """Read the errors of one run, a row per test frame.

    Args:
        path: File ``errors.csv``, or ``common_errors.csv`` with ``columns=COMMON_COLUMNS``.
        columns: Columns it must have.

    Returns:
        Frame number, metres and degrees, as the columns are named; infinite or NaN where a
        prediction failed.

    Raises:
        InputError: The file is missing, or holds other columns or no numbers.
    """
    values = read_numbers(path, ",".join(columns), "table of errors", finite=False)
    return pd.DataFrame(values, columns=list(columns))


def combine(runs: Sequence[Metrics]) -> dict[str, float | str | None]:
    """Combine the scores of a cell's finished repetitions, and count all, by column.

    Returns:
        Each of ``MEASURES`` with its limits and deviation (:func:`score_of`); ``position_rms_m``,
        the median position error as the published code computes it; what has not been trained
        (``BASELINES`` and ``FLOORS``), the same for all; training and test frames; ``n_seeds``,
        ``n_finished`` (repetitions with a score) and ``failed``: predictions that were not finite.
        A run scores those as infinite errors, so it has no score when more than half failed.
        ``limits_of`` says what the limits cover: of one run the test paths alone.
    """
    finished = [run for run in runs if run["position_m"] is not None]
    scores = [score_of(finished, measure) for measure in MEASURES]
    return {
        **{name: value for score in scores for name, value in score.items()},
        "position_rms_m": _mean(finished, "position_rms_m"),
        **{name: runs[0][name] for name in (*BASELINES, *FLOORS, "n_train", "n_test")},
        "n_seeds": len(runs),
        "n_finished": len(finished),
        "limits_of": PATHS_AND_SEEDS if len(finished) > 1 else PATHS,
        "failed": sum(int(run["failed"]) for run in runs),
    }


def score_of(finished: Sequence[Metrics], measure: str) -> dict[str, float | None]:
    """Combine one measure over the runs that finished.

    Returns:
        By column: the run's median, or the mean of the medians of several runs, missing when all
        failed; ``_low`` and ``_high``, its 95 % limits: of one run from its test paths (bootstrap),
        of several the mean of those, widened by the spread of the medians over the runs
        (:func:`~reproduction.statistics.seeds.half_width`); ``_sd``, the standard deviation of the
        medians, missing below two runs.
    """
    values = [run[measure] for run in finished]
    mean, sd = _mean(finished, measure), stdev(values) if len(values) > 1 else None
    low, high = (_mean(finished, f"{measure}_{end}") for end in ("low", "high"))
    if mean is not None and sd is not None:
        error, degrees = sd / math.sqrt(len(values)), len(values) - 1
        if low is not None:
            low = max(mean - half_width(max(mean - low, 0.0), error, degrees), 0.0)
        if high is not None:
            high = mean + half_width(max(high - mean, 0.0), error, degrees)
    parts = {"": mean, "_low": low, "_high": high, "_sd": sd}
    return {f"{measure}{end}": value for end, value in parts.items()}


def percent_change(new: float | None, old: float | None) -> float | None:
    """Compute ``100 (new - old) / old``; None where either is missing or ``old`` is zero."""
    return None if new is None or not old else 100 * (new - old) / old


def sign_test(changes: Sequence[float]) -> tuple[int, int, float]:
    """Test by signs, two-sided, whether changes go one way; those of exactly 0 are left out.

    Returns:
        How many are negative, how many count, and the probability of a split at least as uneven
        when either sign is equally likely; 1 when none counts.
    """
    signed = [change for change in changes if change < 0 or change > 0]
    negative = sum(change < 0 for change in signed)
    chance = float(binomtest(negative, len(signed)).pvalue) if signed else 1.0
    return negative, len(signed), chance


def share_limits(count: int, total: int, confidence: float = 0.95) -> tuple[float, float]:
    """Compute exact (Clopper-Pearson) limits of a share.

    Args:
        count: How many were observed.
        total: Out of how many; above 0.
        confidence: Two-sided confidence of the limits.
    """
    found = binomtest(count, total).proportion_ci(confidence, method="exact")
    return float(found.low), float(found.high)


def _mean(runs: Sequence[Metrics], key: str) -> float | None:
    """Average over runs; None without runs, or where a run has no finite value (a wide limit)."""
    values = [run[key] for run in runs]
    return fmean(values) if values and None not in values else None
