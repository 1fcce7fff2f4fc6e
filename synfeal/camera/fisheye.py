"""Fisheye lenses after Kannala and Brandt, in OpenCV's formulas and order k1, k2, k3, k4.

A ray at an angle t from the optical axis, radians, is shown at the radius

    d(t) = t (1 + k1 t² + k2 t⁴ + k3 t⁶ + k4 t⁸)

focal lengths from the principal point. With all coefficients 0 the lens is equidistant. Angles may
exceed 90 degrees: such a lens sees behind itself, which OpenCV's and COLMAP's own functions, in
terms of x / z and y / z, do not invert.

Source: OpenCV, "Fisheye camera model"; J. Kannala and S. S. Brandt, "A generic camera model and
calibration method for conventional, wide-angle, and fish-eye lenses", PAMI 28 (2006).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Coefficients = Sequence[float]

EQUIDISTANT = (0.0, 0.0, 0.0, 0.0)
# Entries of the table from which Newton's method starts, and its steps.
_ENTRIES = 4096
_STEPS = 6


def radius_of_angle(angle_rad: Array, coefficients: Coefficients) -> Array:
    """Return radii (...) in focal lengths at which angles (...) from the axis are shown.

    Args:
        angle_rad: Angles (...), 0 to :func:`largest_angle_rad`.
        coefficients: k1, k2, k3, k4.
    """
    k1, k2, k3, k4 = coefficients
    t = np.square(angle_rad)
    return np.asarray(angle_rad * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4)))))


def angle_of_radius(radius: Array, coefficients: Coefficients) -> Array:
    """Invert :func:`radius_of_angle` to rounding.

    Args:
        radius: Radii (...) in focal lengths.
        coefficients: k1, k2, k3, k4.

    Returns:
        Angles (...), radians; NaN beyond what the largest angle is shown at.
    """
    limit = largest_angle_rad(coefficients)
    table = np.linspace(0.0, limit, _ENTRIES)
    shown = radius_of_angle(table, coefficients)
    angle = np.interp(radius, shown, table)
    for _ in range(_STEPS):
        step = (radius_of_angle(angle, coefficients) - radius) / _slope(angle, coefficients)
        angle = np.clip(angle - step, 0.0, limit)
    return np.where(radius < shown[-1], angle, np.nan)


def largest_angle_rad(coefficients: Coefficients) -> float:
    """Return the angle beyond which the lens shows nothing: where the radius stops growing, or pi.

    Args:
        coefficients: k1, k2, k3, k4.
    """
    k1, k2, k3, k4 = coefficients
    # The slope of the radius as a polynomial in 1 / t².
    roots = np.roots([1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return min(float(np.pi), float(1.0 / np.sqrt(real.max()))) if len(real) else float(np.pi)


def _slope(angle_rad: Array, coefficients: Coefficients) -> Array:
    """Return the derivative (...) of the radius, kept off the zero it has at the largest angle."""
    k1, k2, k3, k4 = coefficients
    t = np.square(angle_rad)
    slope = 1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * 9.0 * k4)))
    return np.maximum(slope, 1e-6)
