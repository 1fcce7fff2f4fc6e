"""Read the stored reference values of hard cases, and compare answers with them.

``values.json`` holds, by family and case, ``truth``: quotients, or decimals of 30 digits;
``inputs``: doubles that were rounded once and for all, where a case needs them; ``naive_error`` of
the textbook formula. ``python -m tests.hard_cases.truths`` computes all of them.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.records.files import read_json

FILE = Path(__file__).with_name("values.json")
REFUSED = "refused"  # an answer, and the truth of cases that have no single right one


class Values(NamedTuple):
    """Stored numbers of a case.

    Attributes:
        truth: Exact answer, nested lists of numbers as text; :data:`REFUSED` where refusing is
            right.
        naive_error: Error of the textbook formula, ``inf`` where it had no answer or no number.
        inputs: Doubles by name; empty where a case makes its own.
    """

    truth: Any
    naive_error: float
    inputs: dict[str, NDArray[np.float64]]


@cache
def stored_values() -> dict[tuple[str, str], Values]:
    """Read the values of all cases, by family and case."""
    found = {}
    for family, cases in read_json(FILE).items():
        for case, record in cases.items():
            inputs = {name: np.array(value) for name, value in record.get("inputs", {}).items()}
            error = record["naive_error"]
            naive_error = math.inf if error is None else float(error)
            found[family, case] = Values(record["truth"], naive_error, inputs)
    return found


def error_of(answer: Any, truth: Any, *, is_turn: bool = False) -> float:
    """Measure how far an answer is from the truth, exactly for the doubles of the answer.

    Args:
        answer: Numbers of any shape, or :data:`REFUSED`.
        truth: Numbers as text, of the same shape or one that broadcasts to it, or
            :data:`REFUSED`.
        is_turn: Compare unit quaternions (N, 4) by the angle between them, radians.

    Returns:
        The largest difference; ``inf`` where one of both is a refusal, or a number is not finite
        and should be. A right refusal is 0.
    """
    if REFUSED in (str(answer), str(truth)):
        return 0.0 if str(answer) == str(truth) else math.inf
    found = np.ravel(answer).tolist()
    exact = np.broadcast_to(np.array(truth, dtype=object), np.shape(answer)).ravel().tolist()
    if is_turn:
        return max(
            _angle_rad(found[row : row + 4], exact[row : row + 4])
            for row in range(0, len(found), 4)
        )
    return max(_difference(*pair) for pair in zip(found, exact, strict=True))


def _difference(answer: float, truth: Any) -> float:
    if not math.isfinite(answer) or truth == "inf":
        return 0.0 if answer == math.inf and truth == "inf" else math.inf
    return float(abs(Fraction(answer) - Fraction(truth)))


def _angle_rad(quat_wxyz: list[float], truth: list[Any]) -> float:
    """Compute the angle between unit quaternions by the chord to the nearer sign of the truth."""
    if not all(map(math.isfinite, quat_wxyz)):
        return math.inf
    chords = [
        sum((Fraction(a) - sign * Fraction(t)) ** 2 for a, t in zip(quat_wxyz, truth, strict=True))
        for sign in (1, -1)
    ]
    return 4.0 * math.asin(min(math.sqrt(min(chords)) / 2.0, 1.0))
