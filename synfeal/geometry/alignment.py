"""Alignment of one trajectory with another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def umeyama_sim3(
    source: ArrayLike, target: ArrayLike, with_scale: bool = True
) -> tuple[float, Array, Array]:
    """Scale, rotation (3, 3) and translation (3,) with ``target = scale * rotation @ source + t``.

    Least squares over point pairs (N, 3), N >= 3 and not collinear (Umeyama, PAMI 1991, eq. 39-42).
    Without ``with_scale`` the scale is 1.

    Raises:
        ValueError: fewer than three pairs, or points of either set that are collinear up to
            rounding (their rotation about the line is free).
    """
    source, target = np.asarray(source, np.float64), np.asarray(target, np.float64)
    if source.shape != target.shape or source.ndim != 2 or len(source) < 3:
        raise ValueError(
            f"need equal (N >= 3, 3) point sets, got {source.shape} and {target.shape}"
        )
    if _collinear(source) or _collinear(target):
        raise ValueError("the points are collinear: the rotation about their line is undetermined")
    source_mean, target_mean = source.mean(0), target.mean(0)
    source_c, target_c = source - source_mean, target - target_mean
    u, singular, vt = np.linalg.svd(target_c.T @ source_c / len(source))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * sign) @ vt
    scale = float((singular * sign).sum() / (source_c**2).sum(axis=1).mean()) if with_scale else 1.0
    return scale, rotation, target_mean - scale * rotation @ source_mean


def _collinear(points: Array) -> bool:
    """Whether points (N, 3) lie on a line, or as near to one as their rounding can tell."""
    spread = np.linalg.svd(points - points.mean(0), compute_uv=False)
    rounding = 4.0 * np.finfo(float).eps * np.sqrt(len(points)) * np.abs(points).max()
    return bool(spread[1] <= max(1e-9 * spread[0], rounding))
