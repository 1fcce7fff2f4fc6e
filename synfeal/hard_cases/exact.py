"""Exact answers: 50 digits with mpmath, or rational numbers; and distances from them.

Inputs are the very doubles that the formulas get: a double is a rational number, so nothing is lost
in taking it over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import MPContext

MP: Any = MPContext()  # a context of its own: nobody else's precision is touched
MP.dps = 50
MPMATH = "mpmath, 50 digits"
RATIONAL = "exact rationals"
Number = Any  # mpf or Fraction: neither has stubs that mix with the other
Vector = Sequence[Number]
Matrix = Sequence[Vector]


def mpf(value: Number) -> Number:
    """A number with 50 digits; doubles and integers as they are, quotients rounded."""
    if isinstance(value, Fraction):
        return MP.mpf(value.numerator) / value.denominator
    return value if isinstance(value, MP.mpf) else MP.mpf(float(value))


def exact(values: Any) -> Any:
    """An array of doubles as nested lists of numbers with 50 digits."""
    array = np.asarray(values)
    return [exact(item) for item in array] if array.ndim else mpf(array[()])


def flat(values: Any) -> list[Number]:
    """The numbers of an array or of nested lists, in order."""
    if isinstance(values, (list, tuple, np.ndarray)):
        return [number for item in values for number in flat(item)]
    return [values]


def max_abs(answer: Any, truth: Any) -> float:
    """Largest absolute difference: 0 between equal infinities, ``inf`` where one is no number."""
    return max(
        _apart(a, t, 1) for a, t in zip(flat(np.asarray(answer).tolist()), flat(truth), strict=True)
    )


def max_relative(answer: Any, truth: Any) -> float:
    """Largest difference relative to the true value, or to 1 where that is larger."""
    pairs = zip(flat(np.asarray(answer).tolist()), flat(truth), strict=True)
    return max(_apart(a, t, max(1, abs(t))) for a, t in pairs)


def _apart(answer: float, truth: Number, scale: Number) -> float:
    if not math.isfinite(answer) or truth in (math.inf, -math.inf):
        return 0.0 if answer == truth else math.inf
    return float(abs(mpf(answer) - mpf(truth)) / mpf(scale))


def dot(a: Vector, b: Vector) -> Number:
    """Scalar product."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def matmul(a: Matrix, b: Matrix) -> Matrix:
    """Matrix product."""
    columns = list(zip(*b, strict=True))
    return [[dot(row, column) for column in columns] for row in a]


def transposed(a: Matrix) -> Matrix:
    """Transpose."""
    return [list(column) for column in zip(*a, strict=True)]


def unit(vector: Vector) -> Vector:
    """A vector of length 1."""
    length = MP.sqrt(dot(vector, vector))
    return [value / length for value in vector]


def quat_product(a: Vector, b: Vector) -> Vector:
    """Hamilton product of two quaternions wxyz."""
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def conjugate(quat: Vector) -> Vector:
    """The inverse turn of a unit quaternion wxyz."""
    return [quat[0], *(-value for value in quat[1:])]


def quat_of(angle: Number, axis: Vector) -> Vector:
    """Unit quaternion wxyz of a turn about an axis of any length."""
    sine, cosine = MP.sin(mpf(angle) / 2), MP.cos(mpf(angle) / 2)
    return [cosine, *(sine * value for value in unit([mpf(v) for v in axis]))]


def quat_of_vector(vector: Vector) -> Vector:
    """Unit quaternion wxyz of a rotation vector in radians, which may be 0."""
    angle = MP.sqrt(dot(vector, vector))
    return quat_of(angle, vector) if angle else [mpf(1), mpf(0), mpf(0), mpf(0)]


def quat_to_power(quat: Vector, power: Number) -> Vector:
    """The turn of a unit quaternion wxyz, the short way round, ``power`` times."""
    positive = quat if quat[0] >= 0 else [-value for value in quat]
    sine = MP.sqrt(dot(positive[1:], positive[1:]))
    if not sine:
        return [mpf(1), mpf(0), mpf(0), mpf(0)]
    return quat_of(mpf(power) * 2 * MP.atan2(sine, positive[0]), positive[1:])


def matrix_of(quat: Vector) -> Matrix:
    """Rotation matrix of a unit quaternion wxyz."""
    w, x, y, z = quat
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def rounded(values: Any) -> Any:
    """The nearest doubles, as an array in the shape of the nested lists."""
    return np.array(values, dtype=object).astype(np.float64)


def angle_of_quat(quat: Vector) -> Number:
    """Angle in [0, pi] of the turn of a quaternion wxyz of any length."""
    return 2 * MP.atan2(MP.sqrt(dot(quat[1:], quat[1:])), abs(quat[0]))


def angle_between_quats(a: Vector, b: Vector) -> Number:
    """Angle in [0, pi] between the rotations of two quaternions wxyz of any length."""
    return angle_of_quat(quat_product(conjugate(a), b))


def angle_of_matrix(rotation: Matrix) -> Number:
    """Angle in [0, pi] of a rotation matrix."""
    r = rotation
    doubled_sine = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]]
    doubled_cosine = r[0][0] + r[1][1] + r[2][2] - 1
    return MP.atan2(MP.sqrt(dot(doubled_sine, doubled_sine)), doubled_cosine)


def nearest_rotation(matrix: Matrix) -> Matrix:
    """The rotation nearest to a matrix of positive determinant: Newton's polar iteration."""
    current = MP.matrix(matrix)
    for _ in range(200):
        following = (current + (current**-1).T) / 2
        if MP.mnorm(following - current, 1) < MP.mpf(10) ** -45:
            return list(following.tolist())
        current = following
    raise ArithmeticError("the polar iteration has not converged")


def turn_apart(answer: Any, truth: Any) -> float:
    """Largest angle in radians between quaternions (N, 4) and true ones, any sign or length."""
    pairs = zip(exact(np.atleast_2d(answer)), truth, strict=True)
    return max(float(angle_between_quats(a, t)) for a, t in pairs)
