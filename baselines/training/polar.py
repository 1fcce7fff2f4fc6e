"""Polar factors of many small matrices at once, by a few matrix products.

The polar decomposition of ``X = U S V^T`` has the orthogonal factor ``U V^T = (X X^T)^(-1/2) X``.
Newton-Schulz iterations find it by multiplication alone: each applies an odd polynomial to all
singular values, until they are near 1. The polynomials need not be the same each time. The best
quintic for the interval that the one before leaves behind, one after the other, is the best
composition of so many quintics there is:

@inproceedings{amsel2026polarexpress,
  title     = {The {Polar Express}: Optimal Matrix Sign Methods and their Application to the {Muon}
               Algorithm},
  author    = {Amsel, Noah and Persson, David and Musco, Christopher and Gower, Robert M.},
  booktitle = {International Conference on Learning Representations (ICLR)},
  year      = {2026}
}

An odd polynomial of ``X`` is a polynomial of ``X X^T`` times ``X``. So the iteration here is on the
Gram matrices, which are square and as small as the shorter side: those of kernels with different
numbers of input channels go through it together, and ``X`` is multiplied only before and after.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

REMEZ_STEPS = 50
# Matrices of a smaller squared Frobenius norm are as good as zero.
LEAST_TRACE = 1e-20
# Of a Gram matrix of trace 1: that of a thousand equal eigenvalues is 56 times as large.
LEAST_BOUND = 1e-4


class Quintic(NamedTuple):
    """The odd polynomial ``linear x + cubic x^3 + quintic x^5``."""

    linear: float
    cubic: float
    quintic: float


def best_quintic(low: float, high: float) -> tuple[Quintic, float]:
    """Find the odd quintic that is nearest to 1 on an interval, and its largest distance from 1.

    Remez' algorithm. The best one goes through its largest error four times, with alternating
    signs (Chebyshev): at the ends of the interval and at its two extrema between them.

    Args:
        low: Lower end of the interval, above 0.
        high: Upper end of the interval.
    """
    nodes = np.linspace(low, high, 4)
    signs = (-1.0) ** np.arange(4)
    for _ in range(REMEZ_STEPS):
        powers = np.stack([nodes, nodes**3, nodes**5, signs], axis=1)
        linear, cubic, quintic, error = np.linalg.solve(powers, np.ones(4))
        extrema = np.roots([5 * quintic, 3 * cubic, linear])  # zeros of the derivative, in x^2
        nodes = np.array([low, *np.sqrt(np.sort(extrema.real)), high])
    return Quintic(float(linear), float(cubic), float(quintic)), float(abs(error))


@cache
def quintics_for(lowest: float, count: int) -> tuple[Quintic, ...]:
    """Choose the quintics that together bring ``[lowest, 1]`` nearest to 1.

    Args:
        lowest: Smallest singular value that is to come near 1, where the largest is at most 1.
        count: Number of quintics.

    Returns:
        The quintics in the order of their use.
    """
    low, high = lowest, 1.0
    chosen = []
    for _ in range(count):
        quintic, error = best_quintic(low, high)
        low, high = 1 - error, 1 + error
        chosen.append(quintic)
    return tuple(chosen)


def inverse_square_root(gram: Tensor, quintics: tuple[Quintic, ...]) -> Tensor:
    """Approximate ``G^(-1/2)`` of symmetric, positive semi-definite matrices.

    ``G = X X^T`` is scaled so that its largest eigenvalue is at most 1, by the fourth root of the
    trace of ``G^4``. That bound is much nearer than the trace of ``G`` (the squared Frobenius norm
    of ``X``, by which Muon divides) and comes for free, as ``G^2`` is needed anyway.

    Args:
        gram: The matrices G (K, M, M); rows and columns of zeros may fill them up.
        quintics: Polynomials, in the order of their use, that bring the singular values of ``X`` to
            1, as :func:`quintics_for` chooses them; at least one.

    Returns:
        The roots (K, M, M). Those of zero matrices have no meaning, but are finite.

    Raises:
        ValueError: No quintic is given.
    """
    trace = gram.diagonal(dim1=1, dim2=2).sum(1)[:, None, None].clamp_min(LEAST_TRACE)
    gram = gram / trace  # the fourth power of a gradient would underflow
    square = torch.bmm(gram, gram)
    bound = torch.linalg.matrix_norm(square, keepdim=True).sqrt().clamp_min(LEAST_BOUND)
    gram, square = gram / bound, square / bound.square()
    root: Tensor | None = None
    for step, (linear, cubic, quintic) in enumerate(quintics):
        if step == 0:
            factor = torch.add(cubic * gram, square, alpha=quintic)
        else:
            factor = torch.baddbmm(gram, gram, gram, beta=cubic, alpha=quintic)
        factor.diagonal(dim1=1, dim2=2).add_(linear)
        root = factor if root is None else torch.bmm(factor, root)
        if step + 1 < len(quintics):
            gram = torch.bmm(factor, torch.bmm(factor, gram))
    if root is None:
        raise ValueError("at least one quintic is needed")
    scaled: Tensor = root / (trace * bound).sqrt()
    return scaled
