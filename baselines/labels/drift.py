"""The label error of real data sets: smooth along each path, forgotten after some hundred frames.

Two label sets of 7-Scenes, by depth tracking and by structure from motion, differ by errors that
are nearly the same in neighbouring frames and fade slowly: over 25 frames their correlation is
0.73 to 0.93 in position and 0.39 to 0.92 in orientation
(``results/benchmarks/label_differences.csv``).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from baselines.labels.injected import displaced
from baselines.registry.kinds import LabelError
from synfeal.dataset.pose_table import PoseTable

Array = NDArray[np.float64]
# Frames after which the correlation has fallen to 1/e: 0.993 after one frame, 0.846 after 25. The
# medians over the scenes of 7-Scenes are 0.995 and 0.858 in position, 0.991 and 0.820 in
# orientation.
CORRELATED_FRAMES = 150.0


@LabelError(name="drift", title="drift along paths", rank=5)
def drift_along_paths(
    table: PoseTable,
    train: PoseTable,
    noise_m: float,
    noise_deg: float,
    rng: np.random.Generator,
) -> PoseTable:
    """Displace and turn poses by two random walks along each path that are pulled back to zero.

    Arguments are those of :func:`baselines.labels.injected.with_error`. Where cameras stand plays
    no part. As with independent noise, the median sizes are exact on ``table`` itself, whichever
    split it is; ``train`` is not looked at.
    """
    shift, turn = walks(table.path, rng), walks(table.path, rng)
    return displaced(table, _sized(shift, noise_m), _sized(turn, math.radians(noise_deg)))


def walks(path: NDArray[np.int64], rng: np.random.Generator) -> Array:
    """Draw one stationary Ornstein-Uhlenbeck process for each path and component.

    Of each component the mean is 0, the variance 1, and the correlation of frames ``k`` apart
    ``exp(-k / CORRELATED_FRAMES)``; components and paths are independent.

    Args:
        path: Path of each frame (N,), frames of a path in the order in which they were taken.
        rng: Source of the normal variates, three for each frame in the order of the table.

    Returns:
        Vectors (N, 3).
    """
    kept = math.exp(-1 / CORRELATED_FRAMES)
    drawn = rng.standard_normal((len(path), 3))
    walk = np.empty_like(drawn)
    last: dict[int, int] = {}
    for row, name in enumerate(path.tolist()):
        before = last.get(name)
        walk[row] = drawn[row]  # the first of a path is drawn from the stationary distribution
        if before is not None:
            walk[row] = kept * walk[before] + math.sqrt(1 - kept**2) * drawn[row]
        last[name] = row
    return walk


def _sized(vectors: Array, median: float) -> Array:
    """Scale vectors (N, 3) so that their median length is the given one."""
    return np.asarray(median / np.median(np.linalg.norm(vectors, axis=1)) * vectors)
