"""Verdicts on pooled effects: each claim is judged once, on the limits over replications.

Limits are put into percent and turned so that the claimed direction is positive. Regions and
thresholds are those of :mod:`reproduction.claims.verdicts`: two thirds of the printed effect where
the claim prints a size, 5 % where it names a direction, and any effect where it names an order.
A claim holds when all of its parts do. It is refuted by a part that is decided otherwise at the
level corrected for their number.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from reproduction.claims.verdicts import DECIDED_AGAINST, RULE, Verdict
from reproduction.replications.effects import Asked
from reproduction.statistics.pooled import Pooled, pool


class Part(NamedTuple):
    """One effect of a claim in every replication."""

    name: str
    asked: Asked
    sign: int  # sign of the claimed direction
    values: tuple[float, ...]  # logarithms of ratios, one of each replication
    variances: tuple[float, ...]
    printed: float = math.nan  # the same in print, where it can be computed


def percent(log_ratio: float) -> float:
    """Return the change in percent that a logarithm of a ratio stands for."""
    return 100 * math.expm1(log_ratio) if log_ratio < 700 else math.inf


def part_verdict(part: Part, comparisons: int = 1) -> Verdict:
    """Judge one effect by its pooled limits, at the level corrected for ``comparisons``."""
    pooled = pool(part.values, part.variances, comparisons)
    ends = sorted(part.sign * percent(end) for end in (pooled.low, pooled.high))
    smallest = 0.0 if part.asked == "order" else RULE.smallest
    enough = smallest
    if part.asked == "size":
        enough = max(smallest, RULE.enough * abs(percent(part.printed)))
    return _region(ends[0], ends[1], smallest, enough, part.asked == "size")


def _region(low: float, high: float, smallest: float, enough: float, printed: bool) -> Verdict:
    """Judge limits in percent, positive in the claimed direction, as ``claims.verdicts`` does."""
    if low >= enough and low > 0:
        return Verdict.HOLDS
    if high <= -smallest and high < 0:
        return Verdict.OPPOSITE
    if -smallest <= low and high <= smallest:
        return Verdict.NEGLIGIBLE
    if smallest <= low and high <= enough:
        return Verdict.SMALLER
    return Verdict.LESS if printed and high <= enough else Verdict.UNDECIDED


def judge(parts: Sequence[Part]) -> Verdict:
    """Judge a claim that holds if all of its parts do."""
    verdicts = [part_verdict(part) for part in parts]
    corrected = [part_verdict(part, len(parts)) for part in parts]
    against = {verdict for verdict in corrected if verdict in DECIDED_AGAINST}
    if not against:
        return Verdict.HOLDS if set(verdicts) == {Verdict.HOLDS} else Verdict.UNDECIDED
    if Verdict.HOLDS in verdicts:
        return Verdict.MIXED
    if len(against) == 1:
        return next(iter(against))
    less = Verdict.LESS in against and Verdict.OPPOSITE not in against
    return Verdict.LESS if less else Verdict.MIXED


def judge_best(rivals: Sequence[Part]) -> Verdict:
    """Judge a claim that one thing is better than every rival."""
    if any(part_verdict(part, len(rivals)) == Verdict.OPPOSITE for part in rivals):
        return Verdict.REFUTED
    holds = all(part_verdict(part) == Verdict.HOLDS for part in rivals)
    return Verdict.HOLDS if holds else Verdict.UNDECIDED


class Shares(NamedTuple):
    """Logarithms of odds, one of each replication, with their variances."""

    values: tuple[float, ...]
    variances: tuple[float, ...]


def odds_of(counts: Sequence[tuple[int, int]]) -> Shares:
    """Return the logarithm of the odds of each count, half a case added on either side.

    Args:
        counts: Assisted batches, and all batches, of each replication.
    """
    pairs = [(some + 0.5, total - some + 0.5) for some, total in counts]
    return Shares(tuple(math.log(a / b) for a, b in pairs), tuple(1 / a + 1 / b for a, b in pairs))


def pooled_odds(shares: Shares, comparisons: int = 1) -> Pooled:
    """Pool logarithms of odds; see :func:`~reproduction.statistics.pooled.pool`."""
    return pool(shares.values, shares.variances, comparisons, counted=True)


def share(pooled: Pooled) -> tuple[float, float, float]:
    """Return a pooled share with its limits, from its logarithm of odds."""
    value, low, high = (float(1 / (1 + np.exp(-x))) for x in pooled[:3])
    return value, low, high


def judge_few(by_method: Mapping[str, Shares]) -> Verdict:
    """Judge C4: every method needs assistance in fewer than a third of its batches."""
    pooled = {name: share(pooled_odds(shares)) for name, shares in by_method.items()}
    if all(high < RULE.few for _, _, high in pooled.values()):
        return Verdict.HOLDS
    corrected = [share(pooled_odds(shares, len(by_method))) for shares in by_method.values()]
    return Verdict.OPPOSITE if max(low for _, low, _ in corrected) > RULE.few else Verdict.UNDECIDED


def judge_many(shares: Shares) -> Verdict:
    """Judge C15: more than half of the batches need assistance."""
    _, low, high = share(pooled_odds(shares))
    if low >= RULE.not_coping:
        return Verdict.HOLDS
    return Verdict.OPPOSITE if high < RULE.not_coping else Verdict.UNDECIDED
