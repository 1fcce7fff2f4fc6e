"""First hits of rays on triangles in whole numbers: no rounding, so no tolerance.

A double is a whole number of 2^-SHIFT, so products and sums of doubles are whole numbers of powers
of it, and every test has a sign.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.hard_cases.exact import MP, mpf

SHIFT = 200
Whole = Any  # arrays of Python integers


def first_crossings(
    origins: NDArray[np.float64], directions: NDArray[np.float64], corners: NDArray[np.float64]
) -> list[Fraction | None]:
    """Where rays (N) first meet triangles (F, 3, 3), in lengths of their directions; None: nowhere.

    Edges and corners belong to their triangles; those seen exactly edge-on are not met. Moeller and
    Trumbore's test (1997), with the division left out.
    """
    triangles = whole(corners)
    found: list[Fraction | None] = []
    for origin, direction in zip(whole(origins), whole(directions), strict=True):
        numerator, determinant = _crossings(origin, direction, triangles)
        ahead = [Fraction(n, d) for n, d in zip(numerator, determinant, strict=True) if n >= 0]
        found.append(min(ahead, default=None))
    return found


def distance_m(crossing: Fraction, direction: NDArray[np.float64]) -> Any:
    """Metres to a crossing, with 50 digits."""
    square = sum(Fraction(float(value)) ** 2 for value in direction)
    return mpf(crossing) * MP.sqrt(mpf(Fraction(square)))


def whole(values: NDArray[np.float64]) -> Whole:
    """Doubles as whole numbers of 2^-SHIFT.

    Raises:
        ValueError: a value is so small that it is none.
    """
    scaled = [Fraction(float(value)) * 2**SHIFT for value in np.ravel(values)]
    if any(value.denominator != 1 for value in scaled):
        raise ValueError(f"a value is not a multiple of 2^-{SHIFT}")
    result = np.empty(len(scaled), dtype=object)
    result[:] = [value.numerator for value in scaled]
    return result.reshape(np.shape(values))


def _crossings(origin: Whole, direction: Whole, triangles: Whole) -> tuple[Whole, Whole]:
    """Numerators and positive denominators of the crossings inside triangles."""
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    start = origin - triangles[:, 0]
    across = _cross(np.broadcast_to(direction, second.shape), second)
    determinant = (first * across).sum(axis=1)
    sign = np.where(determinant < 0, -1, 1)
    beside = _cross(start, first)
    u = sign * (start * across).sum(axis=1)
    v = sign * (direction * beside).sum(axis=1)
    inside = (determinant != 0) & (u >= 0) & (v >= 0) & (u + v <= sign * determinant)
    numerator = sign * (second * beside).sum(axis=1)
    return numerator[inside], (sign * determinant)[inside]


def _cross(a: Whole, b: Whole) -> Whole:
    """Cross products (F, 3); NumPy's own has no integers without limit."""
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )
