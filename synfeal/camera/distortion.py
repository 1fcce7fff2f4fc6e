"""Lens distortion after Brown and Conrady, in OpenCV's formulas and order k1, k2, p1, p2, k3.

Points are normalised image coordinates (x / z, y / z), so nothing here depends on pixels.

With t = x² + y²:

    x' = x (1 + k1 t + k2 t² + k3 t³) + 2 p1 x y + p2 (t + 2 x²)
    y' = y (1 + k1 t + k2 t² + k3 t³) + 2 p2 x y + p1 (t + 2 y²)

Source: OpenCV, "Camera Calibration and 3D Reconstruction"; D. C. Brown, "Decentering distortion of
lenses", Photogrammetric Engineering 32 (1966).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Coefficients = Sequence[float]

# Entries of the table from which Newton's method starts, and its steps: three are enough but close
# to the fold, where it converges more slowly.
_ENTRIES = 4096
_STEPS = 10
_TOLERANCE = 1e-12


def distort(point: Array, coefficients: Coefficients) -> Array:
    """Distort points (..., 2): map their pinhole positions to those seen through the lens."""
    return _map(point, coefficients)[0]


def undistort(point: Array, coefficients: Coefficients) -> Array:
    """Invert :func:`distort` to within 1e-12.

    The domain is the image of the disc within :func:`fold_radius`. Beyond it a lens shows points
    nearer to the centre although a pinhole would show them further out, so images fold over. The
    radial part alone is inverted by a table, which is where Newton's method starts.

    Args:
        point: Distorted normalised image coordinates (..., 2), x / z and y / z.
        coefficients: k1, k2, p1, p2 and k3.

    Returns:
        Normalised image coordinates (..., 2) of a pinhole; NaN outside the domain.
    """
    point = np.asarray(point, np.float64)
    limit = fold_radius(coefficients)
    found = _radial_inverse(point, coefficients, limit)
    with np.errstate(all="ignore"):  # outside the fold anything may happen, and is not kept
        for _ in range(_STEPS):
            value, jacobian = _map(found, coefficients)
            step = _solve(jacobian, point - value)
            found = found + step
            if not (np.abs(step) > 1e-15).any():
                break
        value, jacobian = _map(found, coefficients)
        good = (
            (np.abs(value - point).max(axis=-1) <= _TOLERANCE)
            & (np.hypot(found[..., 0], found[..., 1]) < limit)
            & (_determinant(jacobian) > 0.0)
        )
    return np.where(good[..., None], found, np.nan)


def fold_radius(coefficients: Coefficients) -> float:
    """Return the least radius at which the radial part stops growing; inf where it never does."""
    k1, k2, _, _, k3 = coefficients
    # The radial part's slope 1 + 3 k1 t + 5 k2 t² + 7 k3 t³ as a polynomial in 1 / t.
    roots = np.roots([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return float(1.0 / np.sqrt(real.max())) if len(real) else np.inf


def _map(point: Array, coefficients: Coefficients) -> tuple[Array, Array]:
    """Distort points and return them (..., 2) with the Jacobian (..., 2, 2) of the mapping."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = point[..., 0], point[..., 1]
    t = x * x + y * y
    radial = 1.0 + t * (k1 + t * (k2 + t * k3))
    slope = 2.0 * (k1 + t * (2.0 * k2 + t * 3.0 * k3))  # d radial / dx is x times this
    value = np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (t + 2.0 * x * x),
            y * radial + 2.0 * p2 * x * y + p1 * (t + 2.0 * y * y),
        ],
        axis=-1,
    )
    across = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    along_x = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    along_y = radial + y * y * slope + 2.0 * p2 * x + 6.0 * p1 * y
    rows = [np.stack([along_x, across], axis=-1), np.stack([across, along_y], axis=-1)]
    return value, np.stack(rows, axis=-2)


def _radial_inverse(point: Array, coefficients: Coefficients, limit: float) -> Array:
    """Return points whose radial part alone maps to ``point``, or the nearest within the fold."""
    k1, k2, _, _, k3 = coefficients
    target = np.hypot(point[..., 0], point[..., 1])

    def radial(r: Any) -> Any:
        t = r * r
        return r * (1.0 + t * (k1 + t * (k2 + t * k3)))

    farthest, high = np.max(target, initial=0.0), min(1.0, limit)
    while high < limit and radial(np.float64(high)) < farthest:
        high = min(2.0 * high, limit)
    table = np.linspace(0.0, high, _ENTRIES)
    found = np.interp(target, radial(table), table)
    return point * (found / np.where(target > 0.0, target, 1.0))[..., None]


def _determinant(matrix: Array) -> Array:
    determinant: Array = (
        matrix[..., 0, 0] * matrix[..., 1, 1] - matrix[..., 0, 1] * matrix[..., 1, 0]
    )
    return determinant


def _solve(matrix: Array, right: Array) -> Array:
    """Solve 2x2 systems and return their solutions (..., 2)."""
    x = matrix[..., 1, 1] * right[..., 0] - matrix[..., 0, 1] * right[..., 1]
    y = matrix[..., 0, 0] * right[..., 1] - matrix[..., 1, 0] * right[..., 0]
    return np.stack([x, y], axis=-1) / _determinant(matrix)[..., None]
