"""Processor time and memory of a job as a function of its size, from jobs that were measured."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from synfeal.report.cost.jobs import TRAINING, Job
from synfeal.report.cost.measured import Measured

# Least ratio of the largest to the smallest job that tells the fixed part from the part per unit.
LEAST_RATIO = 1.5
# Relative residual from which a job counts as an outlier: another job had the processor.
OUTLIER = 0.15
# A range needs this many jobs.
LEAST_JOBS = 3
QUANTILES = (0.1, 0.9)


@dataclass(frozen=True)
class Law:
    """Seconds of a job: ``fixed_s + rates . size``.

    Attributes:
        fixed_s: start of the program, imports, reading the mesh.
        rates: seconds per unit, one per unit of the size.
        spread: 10 and 90 % quantiles of measured over fitted seconds; (1, 1) for under three jobs.
        n_jobs: measured.
        largest: of the measured jobs, in the main unit; None where all jobs are alike.
        base_mb: peak memory without the data a job holds; None where it was not measured.
    """

    fixed_s: float
    rates: tuple[float, ...]
    spread: tuple[float, float]
    n_jobs: int
    largest: float | None
    base_mb: float | None

    def seconds(self, size: Sequence[float]) -> float:
        """Of one job."""
        return self.fixed_s + sum(r * x for r, x in zip(self.rates, size, strict=True))


Pairs = list[tuple[Job, Measured]]


def matched(jobs: Iterable[Job], measured: Iterable[Measured]) -> Pairs:
    """Measured jobs beside those of the same name."""
    known = {job.key: job for job in jobs}
    return [(known[m.key], m) for m in measured if m.key in known]


def fit_laws(pairs: Pairs, training: tuple[float, ...] | None = None) -> dict[str, Law]:
    """A law for everything that was measured; parts per unit of trainings may be known better."""
    start_s = _start(pairs)
    by_law: dict[str, Pairs] = {}
    for job, measured in pairs:
        by_law.setdefault(job.law, []).append((job, measured))
    return {
        name: _law(group, start_s, training if name == TRAINING else None)
        for name, group in by_law.items()
    }


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
        return fmean(seconds), ()
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


def _law(pairs: Pairs, start_s: float, known: tuple[float, ...] | None) -> Law:
    sizes = np.array([job.size for job, _ in pairs], dtype=float).reshape(len(pairs), -1)
    seconds = np.array([max(measured.cpu_s, 1e-3) for _, measured in pairs])
    if known is None:
        fixed_s, rates = fit_seconds(sizes, seconds, start_s)
        # Scenes differ, and a robust fit follows most jobs: the sum of all is what is asked for.
        level = float(seconds.sum() / (fixed_s + sizes @ np.array(rates)).sum())
        fixed_s, rates = fixed_s * level, tuple(rate * level for rate in rates)
    else:
        rates = known
        fixed_s = max(start_s, float(np.median(seconds - sizes @ np.array(rates))))
    fitted = fixed_s + sizes @ np.array(rates)
    low, high = np.quantile(seconds / fitted, QUANTILES)
    spread = (float(low), float(high)) if len(pairs) >= LEAST_JOBS else (1.0, 1.0)
    bases = [m.peak_mb - job.held_bytes / 1e6 for job, m in pairs if m.peak_mb is not None]
    return Law(
        fixed_s,
        rates,
        spread,
        len(pairs),
        float(sizes[:, -1].max()) if sizes.shape[1] else None,
        max(bases, default=None),
    )


def _start(pairs: Pairs) -> float:
    """Seconds to start a program: the median of the stage where it is least."""
    groups: dict[str, list[float]] = {}
    for job, measured in pairs:
        groups.setdefault(job.stage, []).append(measured.cpu_s)
    enough = [median(group) for group in groups.values() if len(group) >= LEAST_JOBS]
    return min(enough or [median(group) for group in groups.values()] or [0.0])
