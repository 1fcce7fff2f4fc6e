"""Verdicts on the effects of claims, by the limits of each.

Limits are put into percent and turned so that the claimed direction is positive. Regions and
thresholds are those of :mod:`reproduction.claims.verdicts`: two thirds of the printed effect where
the claim prints a size, 5 % where it names a direction, and any effect where it names an order.
A claim holds when all of its parts do. It is refuted by a part that is decided otherwise at the
level corrected for their number.

Where limits come from is left to whoever asks: test paths and training runs of a single run, or the
spread over replications.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from reproduction.claims.effects import Asked
from reproduction.claims.verdicts import DECIDED_AGAINST, ENOUGH, FEW, NOT_COPING, SMALLEST, Verdict

# Of the number of effects that one is judged with (Bonferroni), its two-sided 95 % limits.
Limits = Callable[[int], tuple[float, float]]


class Condition(NamedTuple):
    """One effect that a claim asserts."""

    asked: Asked
    sign: int  # sign of the claimed direction
    limits: Limits  # of the logarithm of a ratio
    printed: float = math.nan  # the same in print, where it can be computed


def percent(log_ratio: float) -> float:
    """Return the change in percent that a logarithm of a ratio stands for; none of no number."""
    return math.inf if log_ratio >= 700 else 100 * math.expm1(log_ratio)


def verdict_of(condition: Condition, comparisons: int = 1) -> Verdict:
    """Judge one effect by its limits, at the level corrected for ``comparisons``."""
    ends = sorted(condition.sign * percent(end) for end in condition.limits(comparisons))
    smallest = 0.0 if condition.asked == "order" else SMALLEST
    enough = smallest
    if condition.asked == "size":
        enough = max(smallest, ENOUGH * abs(percent(condition.printed)))
    return _region(ends[0], ends[1], smallest, enough, condition.asked == "size")


def _region(low: float, high: float, smallest: float, enough: float, printed: bool) -> Verdict:
    """Judge limits in percent, positive in the claimed direction."""
    if low >= enough and low > 0:
        return Verdict.HOLDS
    if high <= -smallest and high < 0:
        return Verdict.OPPOSITE
    if -smallest <= low and high <= smallest:
        return Verdict.NEGLIGIBLE
    if smallest <= low and high <= enough:
        return Verdict.SMALLER
    return Verdict.LESS if printed and high <= enough else Verdict.UNDECIDED


def judge(conditions: Sequence[Condition]) -> Verdict:
    """Judge a claim that holds if all of its conditions do."""
    verdicts = [verdict_of(condition) for condition in conditions]
    corrected = [verdict_of(condition, len(conditions)) for condition in conditions]
    against = {verdict for verdict in corrected if verdict in DECIDED_AGAINST}
    if not against:
        return Verdict.HOLDS if set(verdicts) == {Verdict.HOLDS} else Verdict.UNDECIDED
    if Verdict.HOLDS in verdicts:
        return Verdict.MIXED
    if len(against) == 1:
        return next(iter(against))
    less = Verdict.LESS in against and Verdict.OPPOSITE not in against
    return Verdict.LESS if less else Verdict.MIXED


def judge_best(rivals: Sequence[Condition]) -> Verdict:
    """Judge a claim that one thing is better than every rival."""
    if any(verdict_of(rival, len(rivals)) == Verdict.OPPOSITE for rival in rivals):
        return Verdict.REFUTED
    holds = all(verdict_of(rival) == Verdict.HOLDS for rival in rivals)
    return Verdict.HOLDS if holds else Verdict.UNDECIDED


def judge_few(by_method: Mapping[str, Limits]) -> Verdict:
    """Judge C4: every method needs assistance in fewer than a third of its batches.

    Args:
        by_method: Limits of the share of assisted batches.
    """
    if all(limits(1)[1] < FEW for limits in by_method.values()):
        return Verdict.HOLDS
    most = max(limits(len(by_method))[0] for limits in by_method.values())
    return Verdict.OPPOSITE if most > FEW else Verdict.UNDECIDED


def judge_many(limits: Limits) -> Verdict:
    """Judge C15: more than half of the batches need assistance."""
    return reached(*limits(1), NOT_COPING)


def reached(low: float, high: float, number: float) -> Verdict:
    """Compare limits with a number that the paper says is reached.

    Args:
        low: Lower limit.
        high: Upper limit.
        number: The number, in the unit of the limits.
    """
    if low >= number:
        return Verdict.HOLDS
    return Verdict.OPPOSITE if high < number else Verdict.UNDECIDED
