"""Alignment of one trajectory with another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def umeyama_sim3(source: ArrayLike, target: ArrayLike) -> tuple[float, Array, Array]:
    """Scale, rotation (3, 3) and translation (3,) with ``target = scale * rotation @ source + t``.

    Least squares over point pairs (N, 3), N >= 3 and not collinear (Umeyama, PAMI 1991, eq. 39-42).

    Raises:
        ValueError: fewer than three pairs, or collinear points (their rotation about it is free).
    """
    source, target = np.asarray(source, np.float64), np.asarray(target, np.float64)
    if source.shape != target.shape or source.ndim != 2 or len(source) < 3:
        raise ValueError(
            f"need equal (N >= 3, 3) point sets, got {source.shape} and {target.shape}"
        )
    source_mean, target_mean = source.mean(0), target.mean(0)
    source_c, target_c = source - source_mean, target - target_mean
    spread = np.linalg.svd(source_c, compute_uv=False)
    if spread[1] <= 1e-9 * max(spread[0], np.finfo(float).tiny):
        raise ValueError("the points are collinear: the rotation about their line is undetermined")
    u, singular, vt = np.linalg.svd(target_c.T @ source_c / len(source))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * sign) @ vt
    scale = float((singular * sign).sum() / (source_c**2).sum(axis=1).mean())
    return scale, rotation, target_mean - scale * rotation @ source_mean
