"""One hard case: a first-thought formula, the project's function, the exact answer; its text."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from synfeal.report.hard_cases.exact import max_abs

N_TIMINGS, LONG_S = 9, 0.1
# What a formula may end in when it meets a case it was not written for.
BREAKDOWNS = (ArithmeticError, ValueError, RuntimeError, IndexError, np.linalg.LinAlgError)
REFUSED = "refused"
REFUSAL = "refusal"  # the quantity of cases without an answer: 0 when refused, else ``inf``


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


Row = Mapping[str, str]


def judged(row: Row) -> str:
    """What the error of a row is of, and its unit."""
    return row["quantity"] if row["unit"] == "1" else f"{row['quantity']}, {row['unit']}"


def error_text(row: Row, column: str) -> str:
    """An error of a row as it is printed; of a case to be refused, whether it was."""
    error = float(row[column])
    if row["quantity"] == REFUSAL:
        return "refused" if error == 0 else "answered"
    return short(error)


def short(error: float) -> str:
    """An error at two digits; ``none`` where there is no finite one."""
    if math.isinf(error):
        return "none"
    if error == 0 or 1e-3 <= error < 1e4:
        return f"{error:.2g}" if error < 100 else f"{error:,.0f}"
    mantissa, exponent = f"{error:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "\u2212")
