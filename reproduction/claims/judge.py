"""Verdicts on the effects of claims, by the limits of each.

Limits are of logarithms of ratios, turned so that the claimed direction is positive: whichever of
two errors is the base, the verdict is the same. Regions and thresholds are those of
:mod:`reproduction.claims.verdicts`: two thirds of the printed effect where the claim prints a size,
5 % where it names a direction, and any effect where it names an order. A claim holds when all of
its parts do. It is refuted by a part that is decided otherwise at the level corrected for their
number.

Where limits come from is left to whoever asks: test paths and training runs of a single run, or the
spread over replications.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from reproduction.claims.effects import BEST_NETWORK, Asked, Effect, printed_effects
from reproduction.claims.verdicts import DECIDED_AGAINST, ENOUGH, FEW, NOT_COPING, SMALLEST, Verdict

# Claims that one thing is better than each of several others, and claims about so many things.
BEST = ("C12", BEST_NETWORK)
SEVERAL = {"C11": 3}
# Of the number of effects that one is judged with (Bonferroni), its two-sided 95 % limits.
Limits = Callable[[int], tuple[float, float]]


class Condition(NamedTuple):
    """One effect that a claim asserts."""

    asked: Asked
    sign: int  # sign of the claimed direction
    limits: Limits  # of the logarithm of a ratio
    printed: float = math.nan  # the same in print, where it can be computed
    # Sets two effects against each other, of which it tells neither: no part is borne out by it.
    compares: bool = False


def condition_of(effect: Effect, limits: Limits) -> Condition:
    """Ask of an effect what its claim says.

    Args:
        effect: One effect of a claim.
        limits: Its limits.
    """
    printed = printed_effects().get(effect[:4], math.nan)
    return Condition(effect.asked, effect.sign, limits, printed, effect.compares)


def percent(log_ratio: float) -> float:
    """Return the change in percent that a logarithm of a ratio stands for; none of no number."""
    return math.inf if log_ratio >= 700 else 100 * math.expm1(log_ratio)


def verdict_of(condition: Condition, comparisons: int = 1) -> Verdict:
    """Judge one effect by its limits, at the level corrected for ``comparisons``."""
    ends = sorted(condition.sign * end for end in condition.limits(comparisons))
    smallest = 0.0 if condition.asked == "order" else math.log1p(SMALLEST / 100)
    enough = smallest
    if condition.asked == "size":
        enough = max(smallest, ENOUGH * abs(condition.printed))
    return _region(ends[0], ends[1], smallest, enough, condition.asked == "size")


def _region(low: float, high: float, smallest: float, enough: float, printed: bool) -> Verdict:
    """Judge limits of a logarithm, positive in the claimed direction."""
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
    against = [verdict for verdict in corrected if verdict in DECIDED_AGAINST]
    if not against:
        return Verdict.HOLDS if set(verdicts) == {Verdict.HOLDS} else Verdict.UNDECIDED
    pairs = zip(conditions, verdicts, strict=True)
    if any(verdict == Verdict.HOLDS and not own.compares for own, verdict in pairs):
        return Verdict.MIXED
    kinds = {*against}
    if len(against) == len(conditions):
        if len(kinds) == 1:
            return kinds.pop()
        if Verdict.OPPOSITE not in kinds:
            return Verdict.LESS
    return Verdict.REFUTED


def judge_claim(claim: str, parts: Mapping[str, Sequence[Condition]]) -> Verdict:
    """Judge a claim about errors by the rule for what it says.

    Args:
        claim: Its id.
        parts: The effects of each of its parts.
    """
    every = [condition for of_part in parts.values() for condition in of_part]
    if claim in BEST:
        return judge_best(every)
    if claim in SEVERAL:
        return judge_several(list(parts.values()), SEVERAL[claim])
    return judge(every)


def judge_several(things: Sequence[Sequence[Condition]], number: int) -> Verdict:
    """Judge a claim that all conditions hold for at least so many things, whichever they are.

    These are partial conjunctions (Benjamini and Heller, "Screening for Partial Conjunction
    Hypotheses", Biometrics 2008): that m of n effects exist is as sure as the m-th surest one of
    them is at the level corrected for n - m + 1. The claim is refuted when so many things do
    certainly not what it says that fewer than ``number`` are left.

    Args:
        things: The conditions of each.
        number: How many of them are claimed to meet theirs.
    """
    spare = len(things) - number + 1
    met = sum(all(verdict_of(c, spare) == Verdict.HOLDS for c in own) for own in things)
    if met >= number:
        return Verdict.HOLDS
    missed = sum(
        any(verdict_of(c, number * len(own)) in DECIDED_AGAINST for c in own) for own in things
    )
    return Verdict.REFUTED if missed >= spare else Verdict.UNDECIDED


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
