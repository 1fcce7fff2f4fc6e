"""One hard case: a first-thought formula, the project's function, and the exact answer."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from synfeal.hard_cases.exact import max_abs

N_TIMINGS, FEWEST_TIMINGS, LONG_S = 9, 3, 0.1
# What a formula may end in when it meets a case it was not written for.
BREAKDOWNS = (ArithmeticError, ValueError, RuntimeError, IndexError, np.linalg.LinAlgError)
REFUSED = "refused"
REFUSAL = "refusal"  # the quantity of cases without an answer: 0 when refused, else ``inf``


@dataclass(frozen=True)
class Trial:
    """What a case asks.

    Attributes:
        naive: the answer of the formula somebody would write first.
        ours: the answer of the project's function.
        truth: the exact answer: ``mpf``, ``Fraction``, or nested lists of them; or
            :data:`REFUSED` where no answer is the only right one.
        error: how far an answer is from the truth, in the unit of the case.
    """

    naive: Callable[[], Any]
    ours: Callable[[], Any]
    truth: Any
    error: Callable[[Any, Any], float] = max_abs


@dataclass(frozen=True)
class Case:
    """One row of the table.

    Attributes:
        family: what is computed.
        name: when it is hard.
        quantity: what the error is measured in.
        unit: of the error.
        naive: the naive formula, in words.
        ours: the function that is judged.
        reference: how the truth is computed.
        bound: the largest error we promise.
        trial: makes the inputs and the truth; nothing in it is random but by a fixed seed.
    """

    family: str
    name: str
    quantity: str
    unit: str
    naive: str
    ours: str
    reference: str
    bound: float
    trial: Callable[[], Trial]


@dataclass(frozen=True)
class Outcome:
    """What both formulas did; errors are ``inf`` where there was no answer or no number."""

    naive_error: float
    our_error: float
    naive_seconds: float
    our_seconds: float


def examine(case: Case) -> Outcome:
    """Errors and times of both formulas; the errors are the same in every run."""
    trial = case.trial()
    naive_error, naive_seconds = _judged(trial, trial.naive, case.unit)
    our_error, our_seconds = _judged(trial, trial.ours, case.unit)
    return Outcome(naive_error, our_error, naive_seconds, our_seconds)


def _judged(trial: Trial, formula: Callable[[], Any], unit: str) -> tuple[float, float]:
    """Error of a formula's answer, and the median time of a call in seconds."""
    seconds = []
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # of a naive formula nothing else is expected
        for _ in range(N_TIMINGS):
            begin = time.perf_counter()
            answer = _answer(formula)
            seconds.append(time.perf_counter() - begin)
            if sum(seconds) > LONG_S and len(seconds) >= FEWEST_TIMINGS:
                break
        return _error(trial, answer), float(np.median(seconds))


def _answer(formula: Callable[[], Any]) -> Any:
    """What a formula returns, or that it gave up."""
    try:
        return formula()
    except BREAKDOWNS:
        return REFUSED


def _error(trial: Trial, answer: Any) -> float:
    """The error; a refusal is right where the truth is one and infinitely wrong elsewhere."""
    refused = isinstance(answer, str)
    if refused or isinstance(trial.truth, str):
        return 0.0 if refused and isinstance(trial.truth, str) else math.inf
    error = trial.error(answer, trial.truth)
    return math.inf if math.isnan(error) else error
