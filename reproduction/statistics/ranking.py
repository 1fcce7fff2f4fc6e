"""Agreement of two rankings of the same methods, resample by resample of the test paths.

Kendall's tau-b counts pairs of methods: those that both rankings order alike, less those that they
order oppositely, over the geometric mean of how many pairs each of them orders at all.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.evaluation.bootstrap import CONFIDENCE, Array, limits

Orders = NDArray[np.int8]


class Agreement(NamedTuple):
    """Agreement of a ranking with the true one."""

    tau: float  # NaN where the truth tells no two methods apart, so that nothing is to be ranked
    tau_low: float  # 95 % limits over test paths
    tau_high: float
    pairs: int  # that the truth orders
    swapped: int  # pairs that are ordered the other way
    tied: int  # pairs that are not told apart
    reversed: int  # ordered one way by the truth, the other way otherwise, both beyond doubt


def agreement(scores: Array, true_scores: Array) -> Agreement:
    """Compare two rankings.

    Args:
        scores: Scores (1 + R, M) of each method: observed, then in each resample.
        true_scores: The same methods, scored against the truth.
    """
    orders, true_orders = pair_orders(scores), pair_orders(true_scores)
    taus = tau_b(orders, true_orders)
    low, high = limits(taus)
    products = orders[0] * true_orders[0]
    opposed = sure_order(orders) * sure_order(true_orders) < 0
    return Agreement(
        tau=float(taus[0]),
        # A resample in which nothing is to be ranked could have had any tau.
        tau_low=max(low, -1.0),
        tau_high=min(high, 1.0),
        pairs=int(np.count_nonzero(true_orders[0])),
        swapped=int((products < 0).sum()),
        tied=int(((orders[0] == 0) & (true_orders[0] != 0)).sum()),
        reversed=int(opposed.sum()),
    )


def pair_orders(scores: Array) -> Orders:
    """Order every two of the methods: 1, 0 or -1 where the first has more, as much, or less.

    Args:
        scores: Scores (B, M); infinite ones are equal.

    Returns:
        Orders (B, M (M - 1) / 2).
    """
    first, second = np.array([*combinations(range(scores.shape[1]), 2)]).T
    more = scores[:, first] > scores[:, second]
    less = scores[:, first] < scores[:, second]
    return more.astype(np.int8) - less.astype(np.int8)


def tau_b(orders: Orders, true_orders: Orders) -> Array:
    """Compute Kendall's tau-b (B,) from the orders of all pairs (B, P).

    0 where only the first orders nothing: such a score does not rank, though there is a ranking.
    NaN where the truth orders nothing.
    """
    wide, true_wide = orders.astype(np.int64), true_orders.astype(np.int64)
    common = (wide * true_wide).sum(axis=1)
    told, true_told = (np.abs(o).sum(axis=1) for o in (wide, true_wide))
    tau = common / np.sqrt(np.maximum(told * true_told, 1))
    return np.where(true_told > 0, tau, np.nan)


def sure_order(orders: Orders) -> Orders:
    """Keep the orders (P,) of pairs that hardly any resample (1 + R, P) reverses or ties."""
    enough = 1 - (1 - CONFIDENCE) / 2
    more, less = ((orders[1:] == sign).mean(axis=0) >= enough for sign in (1, -1))
    return np.asarray(more.astype(np.int8) - less.astype(np.int8), dtype=np.int8)
