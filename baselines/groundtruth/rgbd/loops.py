"""Which keyframes are tried as loop closures."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Keyframes are compared when their optical axes and positions are at most this far apart.
_LOOP_MAX_DEG, _LOOP_MAX_M = 45.0, 2.0


def loop_candidates(first_from_cam: Array, keyframe_every: int) -> list[tuple[int, int]]:
    """Pairs of keyframes, i < j - 1, whose views may overlap by their poses (n, 4, 4)."""
    keyframes = np.arange(0, len(first_from_cam), keyframe_every)
    position_m, axis = first_from_cam[keyframes, :3, 3], first_from_cam[keyframes, :3, 2]
    distance_m = np.linalg.norm(position_m[:, None] - position_m, axis=-1)
    near = (distance_m <= _LOOP_MAX_M) & (axis @ axis.T >= np.cos(np.radians(_LOOP_MAX_DEG)))
    i, j = keyframes[np.array(np.nonzero(np.triu(near, 1)))]
    return [(int(a), int(b)) for a, b in zip(i, j, strict=True) if b - a > 1]


def most_telling(
    candidates: Sequence[tuple[int, int]], overlap: Callable[[int, int], float], per_keyframe: int
) -> list[tuple[int, int]]:
    """Of each later keyframe the ``per_keyframe`` earliest partners that overlap it.

    The further apart in time, the more drift a closure takes away.

    Args:
        candidates: pairs (i, j), i < j, ordered by i.
        overlap: share of image j that image i shows; 0 where the pair is not worth trying.
        per_keyframe: most pairs to keep.
    """
    chosen: dict[int, int] = {}
    kept = []
    for i, j in candidates:
        if chosen.get(j, 0) < per_keyframe and overlap(i, j) > 0:
            chosen[j] = chosen.get(j, 0) + 1
            kept.append((i, j))
    return kept
