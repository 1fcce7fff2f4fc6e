"""Differences of median errors with limits over test paths and training runs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reproduction.statistics.limits import MEASURES
from reproduction.statistics.seeds import Group, Layout, borrowed_deviations, limits
from synfeal.evaluation.bootstrap import Counts, medians, path_counts
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


def compare_errors(a: RunErrors, b: RunErrors, paired: bool, model: str) -> pd.DataFrame:
    """Compare the errors of two runs, a row per measure; lower is better.

    Columns are ``measure``; ``a`` and ``b``, the median error in either tree, averaged over its
    seeds, infinite where the run failed; ``difference``, ``b - a``, zero where both failed; ``low``
    and ``high``, its 95 % limits over test paths and training runs
    (:mod:`reproduction.statistics.seeds`); ``change_percent`` of ``a``; ``verdict``; ``sd_a`` and
    ``sd_b``, standard deviations of the medians over the seeds, NaN below two finite ones.

    Args:
        a: The run in tree A.
        b: The run in tree B.
        paired: Both saw the same frames: each resample draws the same paths for both, so that what
            makes a path hard for both cancels. Otherwise their paths are drawn independently.
        model: The localizer, of which a single run borrows the deviation over seeds.
    """
    draws_a = draws_of(a.path, "a")
    draws_b = draws_a if paired else draws_of(b.path, "b")
    rows = []
    for place, measure in enumerate(MEASURES):
        runs_a, runs_b = (
            [medians(seed, *draws) for seed in run.errors[:, place]]
            for run, draws in ((a, draws_a), (b, draws_b))
        )
        rows.append({"measure": measure, **_difference(runs_a, runs_b, model, measure)})
    return pd.DataFrame(rows)


def draws_of(path: NDArray[np.int64], tree: str) -> tuple[Counts, Counts]:
    """Place (N,) of each frame's path, and how often (1 + 1000, P) each resample takes a path.

    The first row takes every path once.
    """
    names, place = np.unique(path, return_inverse=True)
    rng = generator_of("compare", tree, len(names))
    return place, path_counts(len(names), rng, RESAMPLES)


def _difference(
    runs_a: list[Array], runs_b: list[Array], model: str, measure: str
) -> dict[str, Any]:
    """Compare two runs by one measure, from the medians (1 + 1000,) of each of their seeds."""
    relative_sd, layout = _layout(len(runs_a), len(runs_b), model, measure)
    sample_a = layout.sample(runs_a, 0, relative_sd)
    sample_b = layout.sample(runs_b, 1, relative_sd)
    difference = _minus(sample_b, sample_a)
    low, high = limits(difference, layout)
    verdict: Verdict = "better" if high < 0 else "worse" if low > 0 else "no difference seen"
    a, b, value = (float(sample[0]) for sample in (sample_a, sample_b, difference))
    return {
        "a": a,
        "b": b,
        "difference": value,
        "low": low,
        "high": high,
        "change_percent": _percent(value, a),
        "verdict": verdict,
        "sd_a": _deviation(runs_a),
        "sd_b": _deviation(runs_b),
    }


def _layout(n_a: int, n_b: int, model: str, measure: str) -> tuple[float, Layout]:
    """Return the relative deviation that single runs borrow, and the layout of both trees' samples.

    Of a localizer without published runs a single run borrows none: limits are over paths alone.
    """
    published = borrowed_deviations().get((model, measure))
    groups = []
    for n_seeds in (n_a, n_b):
        if n_seeds > 1 or published is None:
            groups.append(Group(n_seeds, n_seeds - 1))
        else:
            groups.append(Group(1, published.degrees_of_freedom, borrowed=True))
    return published.relative_sd if published else 0.0, Layout(RESAMPLES, tuple(groups))


def _percent(difference: float, a: float) -> float:
    """Compute the relative change, in the limit where an error is infinite.

    -100 for a run that failed in A only, infinite for one that failed in B only, 0 where both did.
    """
    if difference == 0:
        return 0.0
    if math.isinf(a):
        return -100.0
    return 100 * difference / a if a else math.inf


def _minus(b: Array, a: Array) -> Array:
    """Compute ``b - a``, zero where both are infinite: two failures do not differ."""
    both = np.isinf(a) & np.isinf(b)
    return np.asarray(np.where(both, 0.0, b) - np.where(both, 0.0, a))


def _deviation(runs: list[Array]) -> float:
    """Compute the standard deviation of the finite observed medians, NaN below two."""
    observed = np.array([run[0] for run in runs])
    finite = observed[np.isfinite(observed)]
    return float(finite.std(ddof=1)) if len(finite) > 1 else math.nan
