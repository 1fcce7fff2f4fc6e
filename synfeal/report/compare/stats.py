"""Differences of median errors with intervals from a bootstrap over test paths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.bootstrap import CONFIDENCE, mean_of, medians, path_counts
from synfeal.report.compare.runs import RunErrors
from synfeal.report.stats import MEASURES
from synfeal.seeds import generator_of

Array = NDArray[np.float64]
Verdict = Literal["better", "worse", "no difference seen"]

RESAMPLES = 1000


@dataclass(frozen=True)
class Difference:
    """One measure of a run in both trees; errors, so lower is better.

    Attributes:
        a: median error in tree A, averaged over its seeds; infinite where the run failed.
        b: the same in tree B.
        low: lower 95 % limit of ``b - a`` from the test paths.
        high: upper limit.
        sd_a: standard deviation of the medians over the seeds of A; None below two finite ones.
        sd_b: the same in tree B.
        se_seeds: standard error of ``b - a`` from both spreads; None where one is unknown.
    """

    a: float
    b: float
    low: float
    high: float
    sd_a: float | None = None
    sd_b: float | None = None
    se_seeds: float | None = None

    @property
    def value(self) -> float:
        """``b - a``; zero where both failed."""
        return float(_minus(np.float64(self.b), np.float64(self.a)))

    @property
    def percent(self) -> float:
        """Relative change ``100 (b - a) / a``.

        In the limit where an error is infinite: -100 for a run that failed in A only, infinite for
        one that failed in B only, 0 where both failed.
        """
        if self.value == 0:
            return 0.0
        if math.isinf(self.a):
            return -100.0
        return 100 * self.value / self.a if self.a else math.inf

    @property
    def verdict(self) -> Verdict:
        """Better or worse where the interval does not hold zero."""
        if self.high < 0:
            return "better"
        return "worse" if self.low > 0 else "no difference seen"


def compare_errors(a: RunErrors, b: RunErrors, paired: bool) -> dict[str, Difference]:
    """Every measure's difference between two runs.

    Args:
        a: the run in tree A.
        b: the run in tree B.
        paired: both saw the same frames: each resample draws the same paths for both, so that what
            makes a path hard for both cancels. Otherwise their paths are drawn independently.
    """
    draws_a = _Draws.of(a.path, "a")
    draws_b = draws_a if paired else _Draws.of(b.path, "b")
    return {
        measure: _difference(a.errors[:, i], b.errors[:, i], draws_a, draws_b)
        for i, measure in enumerate(MEASURES)
    }


@dataclass(frozen=True)
class _Draws:
    """Resamples of the paths of a test set.

    Attributes:
        path: (N,) place of each frame's path in a row of ``counts``.
        counts: (1000, P) how often each path is taken.
    """

    path: NDArray[np.int64]
    counts: NDArray[np.int64]

    @classmethod
    def of(cls, path: NDArray[np.int64], tree: str) -> _Draws:
        names, place = np.unique(path, return_inverse=True)
        rng = generator_of("compare", tree, len(names))
        return cls(place, path_counts(len(names), rng, RESAMPLES)[1:])

    def median_of_seeds(self, errors: Array) -> Array:
        """Mean over seeds of the median error (seeds, N) in each resample: (1000,)."""
        return mean_of([medians(values, self.path, self.counts) for values in errors])


def _difference(errors_a: Array, errors_b: Array, draws_a: _Draws, draws_b: _Draws) -> Difference:
    """The difference of errors (seeds, N) of two runs."""
    medians_a, medians_b = np.median(errors_a, axis=1), np.median(errors_b, axis=1)
    resampled = _minus(draws_b.median_of_seeds(errors_b), draws_a.median_of_seeds(errors_a))
    tail = (1 - CONFIDENCE) / 2
    # Always one of the differences: interpolating towards an infinite one would not be a number.
    limits = np.quantile(resampled, [tail, 1 - tail], method="inverted_cdf")
    return Difference(
        a=float(medians_a.mean()),
        b=float(medians_b.mean()),
        low=float(limits[0]),
        high=float(limits[1]),
        sd_a=_deviation(medians_a),
        sd_b=_deviation(medians_b),
        se_seeds=_standard_error(medians_a, medians_b),
    )


def _minus(b: Array | np.float64, a: Array | np.float64) -> Array:
    """``b - a``, zero where both are infinite: two failures do not differ."""
    both = np.isinf(a) & np.isinf(b)
    return np.asarray(np.where(both, 0.0, b) - np.where(both, 0.0, a))


def _deviation(medians: Array) -> float | None:
    finite = medians[np.isfinite(medians)]
    return float(finite.std(ddof=1)) if len(finite) > 1 else None


def _standard_error(medians_a: Array, medians_b: Array) -> float | None:
    sd_a, sd_b = _deviation(medians_a), _deviation(medians_b)
    if sd_a is None or sd_b is None:
        return None
    n_a, n_b = (int(np.isfinite(medians).sum()) for medians in (medians_a, medians_b))
    return math.hypot(sd_a / math.sqrt(n_a), sd_b / math.sqrt(n_b))
