"""Medians and functions of them, with 95 % limits from a bootstrap over test paths.

The unit drawn is the path, not the frame: neighbouring frames of a path are nearly the same
picture. All cells with one test set share one set of draws, so whatever is computed from several of
them, draw by draw, is paired.

A *sample* is an array (1 + RESAMPLES,): first the value that was observed, then its value in each
resample. Statistics of samples are therefore plain array arithmetic.

The limits say how far the test paths decide; another training run varies beyond them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

RESAMPLES = 4000
# Counts held at once: bounds memory at the paper's 20,000 test frames.
BLOCK = 2_000_000
CONFIDENCE = 0.95
# With fewer, limits miss the truth more often than they say, at corrected levels many times so.
FEWEST_PATHS = 10


def path_counts(n_paths: int, rng: np.random.Generator, resamples: int = RESAMPLES) -> Counts:
    """Draw as many paths as there are, with replacement, and count how often each is drawn.

    Args:
        n_paths: Number of paths.
        rng: Source of the draws.
        resamples: Number of draws of ``n_paths`` paths.

    Returns:
        Counts (1 + resamples, n_paths). The first row takes each path once, which gives the
        observed value.
    """
    drawn = rng.multinomial(n_paths, np.full(n_paths, 1 / n_paths), size=resamples)
    return np.concatenate([np.ones((1, n_paths), dtype=np.int64), drawn])


def medians(errors: Array, path: Counts, counts: Counts) -> Array:
    """Compute the median error in each resample of the paths.

    An even number of frames gives the mean of the middle two. An infinite error is a failure and
    counts as the worst; so does one that is not a number.

    Args:
        errors: Error (N,) of each frame.
        path: Column (N,) of ``counts`` that belongs to each frame's path.
        counts: How often each resample takes each path (B, P), see :func:`path_counts`.

    Returns:
        Medians (B,).
    """
    errors = np.where(np.isnan(errors), np.inf, errors)
    order = np.argsort(errors)
    blocks = -(-len(counts) * len(errors) // BLOCK)
    parts = [_medians(errors[order], b[:, path[order]]) for b in np.array_split(counts, blocks)]
    return np.concatenate(parts)


def _medians(ranked: Array, frame_counts: Counts) -> Array:
    """Compute medians (B,) of sorted values (N,), value n taken ``frame_counts[b, n]`` times."""
    reached = np.cumsum(frame_counts, axis=1)
    total = reached[:, -1:]
    below = (reached > (total - 1) // 2).argmax(axis=1)
    above = (reached > total // 2).argmax(axis=1)
    middle: Array = ranked[below] / 2 + ranked[above] / 2  # their sum may be too large
    return middle


def relative_change(new: Array, old: Array) -> Array:
    """Compute ``100 (new - old) / old``; infinite to a failure, -100 from a failure to a score.

    Not a number where both failed: nothing can be said about such a pair.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        return 100 * (new / old - 1)


def difference(a: Array, b: Array) -> Array:
    """Compute ``a - b``; not a number where both are the same infinity."""
    with np.errstate(invalid="ignore"):
        return a - b


def mean_of(samples: Sequence[Array]) -> Array:
    """Average samples, resample by resample."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.mean(samples, axis=0))


def limits(sample: Array, comparisons: int = 1) -> tuple[float, float]:
    """Return percentile limits of a sample at 95 %, or at ``1 - 0.05 / k`` after Bonferroni.

    Always values that occur, since interpolating towards infinity gives no number. A resample that
    is not a number could be anything, and widens both ends.
    """
    drawn, unknown = sample[1:], np.isnan(sample[1:])
    left_out = int((1 - CONFIDENCE) / comparisons / 2 * len(drawn) + 1e-9)
    low = np.sort(np.where(unknown, -np.inf, drawn))[left_out]
    high = np.sort(np.where(unknown, np.inf, drawn))[-1 - left_out]
    return float(low), float(high)
