"""Medians and limits of few, tied and infinite values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal import bootstrap
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import RATIONAL

Array = NDArray[np.float64]
INF = math.inf


def median_of(values: Sequence[float], counts: Sequence[int] | None = None) -> Trial:
    """Median of values, each taken as often as ``counts`` says (once, when absent)."""
    taken = [1] * len(values) if counts is None else list(counts)
    errors, path = np.array(values), np.arange(len(values))
    return Trial(
        naive=lambda: np.quantile(np.repeat(errors, taken), 0.5),
        ours=lambda: bootstrap.medians(errors, path, np.array([taken]))[0],
        truth=_median([v for v, n in zip(values, taken, strict=True) for _ in range(n)]),
    )


def limits_of(drawn: Sequence[float]) -> Trial:
    """95 % limits of resamples: the values with 2.5 % of them beyond."""
    sample, ranked = np.array([0.0, *drawn]), sorted(drawn)
    beyond = len(ranked) * 25 // 1000
    return Trial(
        naive=lambda: np.quantile(sample[1:], [0.025, 0.975]),
        ours=lambda: np.array(bootstrap.limits(sample)),
        truth=[_number(ranked[beyond]), _number(ranked[-1 - beyond])],
    )


def _median(values: Sequence[float]) -> Any:
    ranked = sorted(values)
    low, high = ranked[(len(ranked) - 1) // 2], ranked[len(ranked) // 2]
    return INF if high == INF else (Fraction(low) + Fraction(high)) / 2


def _number(value: float) -> Any:
    return value if math.isinf(value) else Fraction(value)


_MEDIAN = partial(
    Case,
    "medians",
    quantity="median",
    unit="1",
    naive="quantile(0.5)",
    ours="medians",
    reference=RATIONAL,
)
_LIMITS = partial(
    Case,
    "medians",
    quantity="limits",
    unit="1",
    naive="quantile(0.025, 0.975)",
    ours="limits",
    reference="order statistics",
    bound=0.0,
)

CASES = (
    _MEDIAN("one value", bound=0.0, trial=partial(median_of, [0.1])),
    _MEDIAN("two values", bound=1e-16, trial=partial(median_of, [0.1, 0.7])),
    _MEDIAN("an even number", bound=1e-16, trial=partial(median_of, [0.3, 0.1, 0.7, 0.2])),
    _MEDIAN("ties", bound=0.0, trial=partial(median_of, [0.2, 0.1, 0.2, 0.2, 0.9])),
    _MEDIAN(
        "resampled, some left out", bound=0.0, trial=partial(median_of, [0.4, 0.1, 0.3], [3, 0, 2])
    ),
    _MEDIAN("half of them infinite", bound=0.0, trial=partial(median_of, [0.1, 0.2, INF, INF])),
    _MEDIAN("most of them infinite", bound=0.0, trial=partial(median_of, [0.1, INF, INF, INF])),
    _MEDIAN("near the largest double", bound=0.0, trial=partial(median_of, [1.7e308, 1.7e308])),
    _LIMITS("all resamples equal", trial=partial(limits_of, [0.1] * 4000)),
    _LIMITS(
        "3 % of the resamples infinite",
        trial=partial(limits_of, [*range(3880), *[INF] * 120]),
    ),
)
