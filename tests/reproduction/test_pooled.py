"""Pooled effects against closed forms, another program's worked example, and simulated truth."""

import math

import numpy as np
import pytest
from scipy.stats import t

from benchmarks.pooled_coverage import coverage
from reproduction.claims.judge import (
    Condition,
    judge,
    judge_best,
    judge_few,
    judge_many,
    verdict_of,
)
from reproduction.claims.verdicts import Verdict
from reproduction.replications.pooling import Part, limits_of, odds_of, pooled_odds, share
from reproduction.statistics.pooled import pool


def test_equally_exact_replications_are_pooled_as_a_mean_of_few_values():
    """With one variance for all, Hartung and Knapp's limits are those of Student's t."""
    values = np.array([-0.2, -0.1, -0.15, 0.05, -0.3])
    found = pool(values, np.full(5, 1e-6))
    half = t.ppf(0.975, 4) * values.std(ddof=1) / math.sqrt(5)
    assert found.value == pytest.approx(values.mean())
    assert (found.low, found.high) == pytest.approx((values.mean() - half, values.mean() + half))
    assert found.deviation == pytest.approx(math.sqrt(values.var(ddof=1) - 1e-6), rel=1e-3)


def test_what_replications_share_alone_leaves_no_deviation_between_them():
    """Two values as far apart as their standard errors say: weights are inverse variances."""
    found = pool([1.0, 1.2], [0.04, 0.16])
    assert found.value == pytest.approx((1.0 / 0.04 + 1.2 / 0.16) / (1 / 0.04 + 1 / 0.16))
    assert found.deviation == 0.0


def test_paule_and_mandels_deviation_solves_its_equation():
    """The weighted squares about the pooled value add up to their degrees of freedom."""
    values, variances = (
        np.array([0.1, 0.9, 0.4, -0.3, 0.6]),
        np.array([0.01, 0.02, 0.04, 0.03, 0.05]),
    )
    found = pool(values, variances)
    weights = 1 / (variances + found.deviation**2)
    assert (weights * (values - found.value) ** 2).sum() == pytest.approx(4, rel=1e-4)
    assert found.value == pytest.approx((weights * values).sum() / weights.sum())


def test_one_replication_and_a_failed_one_tell_nothing_of_others():
    for values in ([0.3], [0.3, math.inf, 0.2]):
        found = pool(values, [0.01] * len(values))
        assert (found.low, found.high) == (-math.inf, math.inf)
    of_unknown_error = pool([0.3, 0.1, 0.2], [0.01, math.nan, 0.01])
    assert (of_unknown_error.low, of_unknown_error.high) == (-math.inf, math.inf)


def test_limits_at_a_corrected_level_are_wider():
    values, variances = [-0.2, -0.1, -0.15, 0.05, -0.3], [1e-4] * 5
    once, of_ten = pool(values, variances), pool(values, variances, 10)
    ratio = t.ppf(1 - 0.05 / 20, 4) / t.ppf(0.975, 4)
    assert (of_ten.high - of_ten.value) == pytest.approx(ratio * (once.high - once.value))


@pytest.mark.parametrize("share_between", [0.0, 0.5, 0.9, 1.0])
def test_five_replications_cover_the_truth_as_often_as_they_say(share_between):
    assert 0.93 <= coverage(5, share_between, 2000, np.random.default_rng(7)) <= 0.97


def part(percent_changes, asked="size", sign=-1, printed=-50.0):
    values = tuple(math.log1p(change / 100) for change in percent_changes)
    pooled = Part(values, (1e-6,) * len(values))
    return Condition(asked, sign, pooled.limits, math.log1p(printed / 100))


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ((-50, -51, -49, -50, -52), Verdict.HOLDS),
        ((-20, -21, -19, -20, -22), Verdict.SMALLER),
        ((-1, 1, 0.5, -0.5, 0), Verdict.NEGLIGIBLE),
        ((20, 21, 19, 20, 22), Verdict.OPPOSITE),
        ((-3, -15, -10, -5, -6), Verdict.LESS),
        ((-80, 30, -60, 10, -40), Verdict.UNDECIDED),
    ],
)
def test_an_effect_is_judged_by_the_region_its_pooled_limits_lie_in(changes, verdict):
    assert verdict_of(part(changes)) == verdict


def test_a_direction_asks_for_five_percent_and_an_order_for_less():
    small = (-2, -2.1, -1.9, -2, -2.2)
    assert verdict_of(part(small, "direction")) == Verdict.NEGLIGIBLE
    assert verdict_of(part(small, "order")) == Verdict.HOLDS


def test_a_claim_holds_with_all_parts_and_is_mixed_with_one_that_is_refuted():
    holds, opposite = part((-50, -51, -49, -50, -52)), part((20, 21, 19, 20, 22))
    assert judge([holds, holds]) == Verdict.HOLDS
    assert judge([holds, opposite]) == Verdict.MIXED
    assert judge([opposite, opposite]) == Verdict.OPPOSITE
    assert judge([holds, part((-80, 30, -60, 10, -40))]) == Verdict.UNDECIDED
    assert judge_best([opposite._replace(asked="order"), holds]) == Verdict.REFUTED


def test_shares_of_batches_are_judged_beside_a_third_and_a_half():
    few = odds_of([(2, 34), (3, 34), (1, 34), (4, 34), (2, 34)])
    most = odds_of([(30, 34), (32, 34), (33, 34), (31, 34), (34, 34)])
    value, low, high = share(pooled_odds(few))
    assert low < 2.4 / 34 < high
    assert value == pytest.approx(2.4 / 34, abs=0.02)
    assert judge_few({"sfm": limits_of(few), "rgbd-g2o": limits_of(few)}) == Verdict.HOLDS
    assert judge_few({"sfm": limits_of(few), "rgbd-g2o": limits_of(most)}) == Verdict.OPPOSITE
    assert (judge_many(limits_of(most)), judge_many(limits_of(few))) == (
        Verdict.HOLDS,
        Verdict.OPPOSITE,
    )
    value, low, high = share(pooled_odds(odds_of([(0, 34)] * 5)))
    assert 0 < low < value < 0.05 < high < 0.15  # never assisted: as many batches tell no more
