"""Differences of median errors with intervals from a bootstrap over test paths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reproduction.statistics.limits import MEASURES
from synfeal.evaluation.bootstrap import CONFIDENCE, Counts, mean_of, medians, path_counts
from synfeal.records.provenance import generator_of

Array = NDArray[np.float64]
Verdict = Literal["better", "worse", "no difference seen"]

RESAMPLES = 1000


@dataclass(frozen=True)
class RunErrors:
    """The errors of one run over its test frames."""

    frame: NDArray[np.int64]  # (N,) index in the test split
    path: NDArray[np.int64]  # (N,) index of the straight path the frame belongs to
    # (seeds, 4, N) by :data:`~reproduction.statistics.limits.MEASURES`; a prediction that was not
    # finite has infinite errors.
    errors: NDArray[np.float64]

    def counts(self) -> dict[str, int]:
        """Count test frames, the paths these belong to, seeds, and predictions that failed."""
        paths, seeds = len(np.unique(self.path)), len(self.errors)
        failed = int(np.isinf(self.errors[:, 0]).sum())
        return {"n_test": len(self.frame), "n_paths": paths, "n_seeds": seeds, "failed": failed}


def compare_errors(a: RunErrors, b: RunErrors, paired: bool) -> pd.DataFrame:
    """Compare the errors of two runs, a row per measure; lower is better.

    Columns are ``measure``; ``a`` and ``b``, the median error in either tree, averaged over its
    seeds, infinite where the run failed; ``difference``, ``b - a``, zero where both failed; ``low``
    and ``high``, its 95 % limits from the test paths; ``change_percent`` of ``a``; ``verdict``;
    ``sd_a`` and ``sd_b``, standard deviations of the medians over the seeds, NaN below two finite
    ones; and ``se_seeds``, the standard error of the difference from both.

    Args:
        a: The run in tree A.
        b: The run in tree B.
        paired: Both saw the same frames: each resample draws the same paths for both, so that what
            makes a path hard for both cancels. Otherwise their paths are drawn independently.
    """
    draws_a = draws_of(a.path, "a")
    draws_b = draws_a if paired else draws_of(b.path, "b")
    rows = [
        {"measure": measure, **_difference(a.errors[:, i], b.errors[:, i], draws_a, draws_b)}
        for i, measure in enumerate(MEASURES)
    ]
    return pd.DataFrame(rows)


def draws_of(path: NDArray[np.int64], tree: str) -> tuple[Counts, Counts]:
    """Place (N,) of each frame's path, and how often (1000, P) each resample takes a path."""
    names, place = np.unique(path, return_inverse=True)
    rng = generator_of("compare", tree, len(names))
    return place, path_counts(len(names), rng, RESAMPLES)[1:]


def _difference(
    errors_a: Array, errors_b: Array, draws_a: tuple[Counts, Counts], draws_b: tuple[Counts, Counts]
) -> dict[str, Any]:
    """Compare errors (seeds, N) of two runs by one measure."""
    medians_a, medians_b = np.median(errors_a, axis=1), np.median(errors_b, axis=1)
    a, b = float(medians_a.mean()), float(medians_b.mean())
    value = float(_minus(np.float64(b), np.float64(a)))
    drawn_a, drawn_b = (
        mean_of([medians(seed, *draws) for seed in errors])
        for errors, draws in ((errors_a, draws_a), (errors_b, draws_b))
    )
    tail = (1 - CONFIDENCE) / 2
    # Always one of the differences: interpolating towards an infinite one would not be a number.
    low, high = np.quantile(_minus(drawn_b, drawn_a), [tail, 1 - tail], method="inverted_cdf")
    verdict: Verdict = "better" if high < 0 else "worse" if low > 0 else "no difference seen"
    (sd_a, n_a), (sd_b, n_b) = _deviation(medians_a), _deviation(medians_b)
    return {
        "a": a,
        "b": b,
        "difference": value,
        "low": float(low),
        "high": float(high),
        "change_percent": _percent(value, a),
        "verdict": verdict,
        "sd_a": sd_a,
        "sd_b": sd_b,
        "se_seeds": math.hypot(sd_a / math.sqrt(n_a), sd_b / math.sqrt(n_b)),
    }


def _percent(difference: float, a: float) -> float:
    """Compute the relative change, in the limit where an error is infinite.

    -100 for a run that failed in A only, infinite for one that failed in B only, 0 where both did.
    """
    if difference == 0:
        return 0.0
    if math.isinf(a):
        return -100.0
    return 100 * difference / a if a else math.inf


def _minus(b: Array | np.float64, a: Array | np.float64) -> Array:
    """Compute ``b - a``, zero where both are infinite: two failures do not differ."""
    both = np.isinf(a) & np.isinf(b)
    return np.asarray(np.where(both, 0.0, b) - np.where(both, 0.0, a))


def _deviation(medians: Array) -> tuple[float, int]:
    """Compute the standard deviation of the finite medians, NaN below two, and count them."""
    finite = medians[np.isfinite(medians)]
    return (float(finite.std(ddof=1)) if len(finite) > 1 else math.nan), max(len(finite), 1)
