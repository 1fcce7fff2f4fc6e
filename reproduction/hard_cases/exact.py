"""Trials of formulas against exact answers: 50 digits with mpmath, or rational numbers.

Inputs are the very doubles that the formulas get: a double is a rational number, so nothing is lost
in taking it over. Quaternions are lists ``wxyz``, matrices those of mpmath.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from mpmath import MPContext

MP: Any = MPContext()  # a context of its own: nobody else's precision is touched
MP.dps = 50
MPMATH, RATIONAL = "mpmath, 50 digits", "exact rationals"
N_TIMINGS, LONG_S = 9, 0.1
# What a formula may end in when it meets a case it was not written for.
BREAKDOWNS = (ArithmeticError, ValueError, RuntimeError, IndexError, np.linalg.LinAlgError)
REFUSED = "refused"
REFUSAL = "refusal"  # the quantity of cases without an answer: 0 when refused, else ``inf``


def mpf(value: Any) -> Any:
    """A number with 50 digits; doubles and integers as they are, quotients rounded."""
    if isinstance(value, Fraction):
        return MP.mpf(value.numerator) / value.denominator
    return value if isinstance(value, MP.mpf) else MP.mpf(float(value))


def exact(values: Any) -> Any:
    """An array (N,) of doubles as a list, or (N, M) as a matrix, of numbers with 50 digits."""
    array = np.asarray(values)
    numbers = [[mpf(v) for v in row] for row in np.atleast_2d(array)]
    return MP.matrix(numbers) if array.ndim == 2 else numbers[0]


def rounded(values: Any) -> Any:
    """The nearest doubles, as an array in the shape of a matrix or of nested lists."""
    nested = values.tolist() if isinstance(values, MP.matrix) else values
    return np.array(nested, dtype=object).astype(np.float64)


def max_abs(answer: Any, truth: Any) -> float:
    """Largest absolute difference: 0 between equal infinities, ``inf`` where one is no number."""
    nested = truth.tolist() if isinstance(truth, MP.matrix) else truth
    numbers = np.array(nested, dtype=object).ravel()
    return max(
        float(abs(mpf(a) - mpf(t)))
        if math.isfinite(a) and t not in (math.inf, -math.inf)
        else (0.0 if a == t else math.inf)
        for a, t in zip(np.ravel(answer).tolist(), numbers, strict=True)
    )


@dataclass(frozen=True)
class Trial:
    """What a case asks."""

    naive: Callable[[], Any]  # the answer of the formula somebody would write first
    ours: Callable[[], Any]  # the answer of the project's function
    # The exact answer, as numbers of mpmath or fractions; :data:`REFUSED` where no answer is the
    # only right one.
    truth: Any
    # How far an answer is from the truth, in the unit of the case.
    error: Callable[[Any, Any], float] = max_abs


class Family(NamedTuple):
    """Rows of the table that differ only in their inputs."""

    name: str  # what is computed
    quantity: str  # what the error is measured in
    unit: str  # of the error
    naive: str  # the naive formula, in words
    ours: str  # the function that is judged
    reference: str  # how the truth is computed
    bound: float  # the largest error we promise
    # By name, what makes inputs and truth; nothing is random but by a fixed seed.
    cases: dict[str, Callable[[], Trial]]


def examine(trial: Trial) -> dict[str, float]:
    """Errors and times of both formulas, by column; the errors are the same in every run.

    They are ``inf`` where there was no answer or no number.
    """
    naive, ours = (_judged(trial, formula) for formula in (trial.naive, trial.ours))
    found = {"naive_error": naive[0], "our_error": ours[0]}
    return found | {"naive_seconds": naive[1], "our_seconds": ours[1]}


def _judged(trial: Trial, formula: Callable[[], Any]) -> tuple[float, float]:
    """Error of a formula's answer, and the median time of a call in seconds."""
    seconds: list[float] = []
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # of a naive formula nothing else is expected
        while len(seconds) < N_TIMINGS and sum(seconds) < LONG_S:
            begin = time.perf_counter()
            try:
                answer = formula()
            except BREAKDOWNS:
                answer = REFUSED
            seconds.append(time.perf_counter() - begin)
        return _error(trial, answer), float(np.median(seconds))


def _error(trial: Trial, answer: Any) -> float:
    """The error; a refusal is right where the truth is one and infinitely wrong elsewhere."""
    if isinstance(answer, str) or isinstance(trial.truth, str):
        return 0.0 if isinstance(answer, str) and isinstance(trial.truth, str) else math.inf
    error = trial.error(answer, trial.truth)
    return math.inf if math.isnan(error) else error


def quat_of(angle: Any, axis: Sequence[Any]) -> list[Any]:
    """Unit quaternion of a turn about an axis of any length; an axis of 0 turns nothing."""
    length = MP.sqrt(sum(mpf(v) ** 2 for v in axis)) or mpf(1)
    sine, cosine = MP.sin(mpf(angle) / 2), MP.cos(mpf(angle) / 2)
    return [cosine, *(sine * mpf(v) / length for v in axis)]


def quat_product(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """Hamilton product of two quaternions."""
    w, x, y, z = a
    rows = ((w, -x, -y, -z), (x, w, -z, y), (y, z, w, -x), (z, -y, x, w))
    return [sum(p * q for p, q in zip(row, b, strict=True)) for row in rows]


def inverse(quat: Sequence[Any]) -> list[Any]:
    """The inverse turn, of the same length."""
    return [quat[0], *(-value for value in quat[1:])]


def angle_of_quat(quat: Sequence[Any]) -> Any:
    """Angle in [0, pi] of the turn of a quaternion of any length but 0."""
    return 2 * MP.atan2(MP.sqrt(sum(v**2 for v in quat[1:])), abs(quat[0]))


def quat_to_power(quat: Sequence[Any], power: float) -> list[Any]:
    """The turn of a quaternion, the short way round, ``power`` times."""
    sign = -1 if quat[0] < 0 else 1
    return quat_of(mpf(power) * angle_of_quat(quat), [sign * v for v in quat[1:]])


def matrix_of(quat: Sequence[Any]) -> Any:
    """Rotation matrix of a quaternion of any length but 0."""
    w, x, y, z = (value / MP.sqrt(sum(v**2 for v in quat)) for value in quat)
    return MP.matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def angle_of_matrix(r: Any) -> Any:
    """Angle in [0, pi] of a rotation matrix."""
    doubled_sine = [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]
    return MP.atan2(MP.norm(doubled_sine), r[0, 0] + r[1, 1] + r[2, 2] - 1)


def nearest_rotation(matrix: Any) -> Any:
    """The rotation nearest to a matrix of positive determinant, by its singular values."""
    u, _, vt = MP.svd_r(matrix)
    return u * vt
