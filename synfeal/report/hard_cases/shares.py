"""Limits of shares near 0 and 1, and the sign test, against exact binomial sums."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from math import comb, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import MP, MPMATH, RATIONAL, mpf
from synfeal.report import stats

Z = float(norm.ppf(0.975))


def share(count: int, total: int) -> Trial:
    """95 % limits of ``count`` of ``total``: where a tail of the binomial holds exactly 2.5 %."""
    return Trial(
        naive=lambda: _wald(count, total),
        ours=lambda: np.array(stats.share_limits(count, total)),
        truth=[_limit(count, total), 1 - _limit(total - count, total)],
    )


def signs(negative: int, positive: int) -> Trial:
    """Probability of a split at least as uneven, from counts of equally likely signs."""
    total = negative + positive
    tail = sum(comb(total, k) for k in range(min(negative, positive) + 1))
    changes = [-1.0] * negative + [1.0] * positive
    return Trial(
        naive=lambda: 2.0 * norm.sf(abs(negative - positive) / sqrt(total)),
        ours=lambda: stats.sign_test(changes)[2],
        truth=min(Fraction(1), Fraction(2 * tail, 2**total)),
    )


def _wald(count: int, total: int) -> NDArray[np.float64]:
    observed = count / total
    half = Z * sqrt(observed * (1.0 - observed) / total)
    return np.array([observed - half, observed + half])


def _limit(count: int, total: int) -> Any:
    """The share at which ``count`` or more of ``total`` have a chance of 2.5 %, by bisection."""
    low, high = mpf(0.0), mpf(1.0)
    for _ in range(170):  # 2^-170 < 1e-50
        middle = (low + high) / 2
        fewer = _chance_of_fewer(count, total, middle)
        low, high = (middle, high) if 1 - fewer < mpf(Fraction(1, 40)) else (low, middle)
    return low if count else mpf(0.0)


def _chance_of_fewer(count: int, total: int, chance: Any) -> Any:
    return sum(
        (comb(total, k) * chance**k * (1 - chance) ** (total - k) for k in range(count)),
        start=MP.mpf(0),
    )


_SHARE = partial(
    Case,
    "shares",
    quantity="limits",
    unit="1",
    naive="p ± 1.96 √(p (1 − p) / n)",
    ours="share_limits",
    reference="bisection, " + MPMATH,
    bound=1e-12,
)
_SIGNS = partial(
    Case,
    "shares",
    quantity="p of the sign test",
    unit="1",
    naive="normal approximation",
    ours="sign_test",
    reference=RATIONAL,
    bound=1e-14,
)

CASES = (
    _SHARE("0 of 20", trial=partial(share, 0, 20)),
    _SHARE("20 of 20", trial=partial(share, 20, 20)),
    _SHARE("1 of 100", trial=partial(share, 1, 100)),
    _SIGNS("all of 5 fell", trial=partial(signs, 5, 0)),
    _SIGNS("10 of 20 fell", trial=partial(signs, 10, 10)),
)
