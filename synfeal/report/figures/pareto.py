"""Which variants are worth having: none other is both as fast and as right."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def pareto_front(seconds: ArrayLike, errors: ArrayLike) -> NDArray[np.bool_]:
    """Which of N variants (costs and errors (N,), less is better) no other one dominates.

    A variant dominates another when it is at least as good in both and better in one; of equal
    variants none dominates the other.
    """
    cost = np.stack([np.asarray(seconds, np.float64), np.asarray(errors, np.float64)], axis=1)
    order = np.lexsort((cost[:, 1], cost[:, 0]))
    # Among all variants that cost no more, those later in this order have no smaller error.
    best = np.minimum.accumulate(cost[order, 1])
    first = np.concatenate([[True], cost[order[1:], 1] < best[:-1]])
    starts = cost[order[first]]
    return np.array((cost[:, None] == starts[None]).all(axis=2).any(axis=1), dtype=np.bool_)
