"""95 % limits over test paths and training runs, when there are only a few runs.

How far another set of test paths would move a result is known from a bootstrap over dozens of
paths. How far other training runs ("seeds") would move it is estimated from the few there are,
usually three, and a standard deviation of three values is itself uncertain: Student's t with two
degrees of freedom takes 4.30 standard errors where the normal distribution takes 1.96.

Two rules combine both parts. Welch and Satterthwaite give one quantile of t with an effective
number of degrees of freedom (Welch, "The generalization of 'Student's' problem", Biometrika 1947);
it is too narrow where a part with two degrees of freedom dominates (92 % instead of 95 %). Banerjee
("Approximate confidence interval for linear functions of means", Sankhya 1960) adds the half-widths
of the parts in quadrature, each with its own quantile; it is never too narrow, and too wide where
the parts are alike (up to 97.7 %). A weighted mean of the two half-widths lies between: simulated
coverage is 94 to 97 % at every share of the two parts, with one and with five localizers.

A *sample* with seeds is an array (1 + R + S,): the observed value, its value in R resamples of the
test paths, and its value in S *seed rows*. In a row of a localizer with K runs, one of the runs is
left out and everything else is as observed (the jackknife). A localizer with a single run borrows
its standard deviation from published runs, in two rows: one deviation up, and one down. Statistics
of samples stay plain array arithmetic, and the rows tell how much each localizer's runs move them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, t

from synfeal.evaluation.bootstrap import CONFIDENCE, Array
from synfeal.evaluation.bootstrap import limits as path_limits
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame, rows_of

# Of Welch and Satterthwaite's half-width; the rest is Banerjee's.
WELCH_SHARE = 0.4
# Relative standard deviations of median errors over seeds, from published runs with several.
BORROWED = Path(__file__).parent / "published" / "seed_deviations.csv"
BORROWED_SCHEMA = {
    **dict.fromkeys(("model", "measure"), TEXT),
    "relative_sd": NUMBER,
    **dict.fromkeys(("cells", "degrees_of_freedom"), COUNT),
}


class Group(NamedTuple):
    """Runs that move together: the repetitions of one localizer."""

    n_seeds: int
    degrees_of_freedom: float  # of their standard deviation
    borrowed: bool = False  # a single run, whose deviation is that of published runs

    @property
    def n_rows(self) -> int:
        """Number of seed rows they take."""
        return 2 if self.borrowed else self.n_seeds


class Borrowed(NamedTuple):
    """A relative standard deviation over seeds, and how well it is known."""

    relative_sd: float
    degrees_of_freedom: int


@dataclass(frozen=True)
class Layout:
    """Places of the parts of a sample."""

    resamples: int  # of the test paths
    groups: tuple[Group, ...] = ()  # in the order of their seed rows

    @property
    def length(self) -> int:
        """Values in a sample."""
        return 1 + self.resamples + sum(group.n_rows for group in self.groups)

    def rows(self) -> list[slice]:
        """Return the seed rows of each group."""
        ends = accumulate((group.n_rows for group in self.groups), initial=1 + self.resamples)
        return [
            slice(end, end + group.n_rows) for end, group in zip(ends, self.groups, strict=False)
        ]

    def sample(self, runs: Sequence[Array], place: int, relative_sd: float = 0.0) -> Array:
        """Make the sample of one localizer's mean over its runs.

        Args:
            runs: Median error (1 + resamples,) of each run: observed, then resampled.
            place: Index of its group among ``groups``.
            relative_sd: Relative standard deviation that a single run borrows.
        """
        by_run = np.asarray(runs)
        observed = by_run[:, 0]
        sample = np.full(self.length, observed.mean())
        sample[: 1 + self.resamples] = by_run.mean(axis=0)
        rows = self.rows()[place]
        if self.groups[place].borrowed:
            sample[rows] = observed[0] * np.exp([relative_sd, -relative_sd])
        elif len(observed) > 1:
            sample[rows] = [np.delete(observed, k).mean() for k in range(len(observed))]
        return sample

    def constant(self, resampled: Array) -> Array:
        """Make the sample of what no training run moves (1 + resamples,)."""
        tail = np.full(self.length - len(resampled), resampled[0])
        return np.concatenate([resampled, tail])


def limits(sample: Array, layout: Layout, comparisons: int = 1) -> tuple[float, float]:
    """Compute limits over test paths and training runs.

    Where a run failed, so that the value or one of its seed rows is infinite, the limits span what
    paths and rows give.

    Args:
        sample: The sample (B,).
        layout: Its layout.
        comparisons: Number k of conditions it is one of; limits are at 95 %, and above one
            condition at ``1 - 0.05 / k`` (Bonferroni).

    Returns:
        The lower and the upper limit.

    Raises:
        ValueError: the sample has another length than the layout.
    """
    if len(sample) != layout.length:
        raise ValueError(f"a sample of {len(sample)} values, where {layout.length} are laid out")
    low, high = path_limits(sample[: 1 + layout.resamples], comparisons)
    rows = sample[1 + layout.resamples :]
    observed = float(sample[0])
    if not (math.isfinite(observed) and np.isfinite(rows).all()):
        spread = np.where(np.isnan(rows), [[-np.inf], [np.inf]], rows)
        return float(min([low, *spread[0]])), float(max([high, *spread[1]]))
    variance, degrees = seed_variance(sample, layout)
    if variance == 0:
        return low, high
    confidence = 1 - (1 - CONFIDENCE) / comparisons
    below, above = (
        half_width(max(distance, 0.0), math.sqrt(variance), degrees, confidence)
        for distance in (observed - low, high - observed)
    )
    return observed - below, observed + above


def seed_variance(sample: Array, layout: Layout) -> tuple[float, float]:
    """Compute the variance over seeds of the observed value, and its degrees of freedom."""
    variance = squares = 0.0
    for rows, group in zip(layout.rows(), layout.groups, strict=True):
        values = sample[rows]
        if group.borrowed:
            own = float(values[0] - values[1]) ** 2 / 4
        elif group.n_seeds > 1:
            own = (group.n_seeds - 1) * float(values.var())  # of the jackknife
        else:
            continue
        variance += own
        squares += own**2 / group.degrees_of_freedom
    return variance, variance**2 / squares if squares else math.inf


def half_width(
    of_paths: float, seed_error: float, degrees: float, confidence: float = CONFIDENCE
) -> float:
    """Compute the half-width of an interval over paths and seeds.

    Args:
        of_paths: Half-width over the test paths alone, at the same confidence.
        seed_error: Standard error of the value over the seeds.
        degrees: Degrees of freedom of ``seed_error``.
        confidence: Two-sided confidence of the interval.
    """
    if seed_error == 0:
        return of_paths
    if not math.isfinite(of_paths):
        return math.inf
    level = (1 + confidence) / 2
    path_error = of_paths / float(norm.ppf(level))
    total = math.hypot(path_error, seed_error)
    effective = degrees * (total / seed_error) ** 4
    welch = float(t.ppf(level, effective)) * total
    banerjee = math.hypot(of_paths, float(t.ppf(level, degrees)) * seed_error)
    return WELCH_SHARE * welch + (1 - WELCH_SHARE) * banerjee


@cache
def borrowed_deviations() -> Mapping[tuple[str, str], Borrowed]:
    """Return, by localizer and measure, the deviation that a single run borrows."""
    rows = rows_of(read_frame(BORROWED, BORROWED_SCHEMA))
    return {
        (row.model, row.measure): Borrowed(row.relative_sd, row.degrees_of_freedom) for row in rows
    }
