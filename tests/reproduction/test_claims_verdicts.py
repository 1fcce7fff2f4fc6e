"""The rules of the verdicts, against limits chosen by hand and against simulated runs."""

import math
import re
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

from reproduction.claims.effects import PAPERS_FIVE, printed_effects
from reproduction.claims.judge import (
    Condition,
    judge,
    judge_best,
    judge_few,
    judge_many,
    judge_several,
    percent,
    reached,
    verdict_of,
)
from reproduction.claims.verdicts import Verdict
from reproduction.replications.pooling import Part
from reproduction.statistics.seeds import Layout, limits
from tests import ROOT

HOLDS, SMALLER, MIXED, NEGLIGIBLE, LESS, OPPOSITE, REFUTED, UNDECIDED, *_ = Verdict


def log_ratio(change):
    return math.log1p(change / 100)


def effect(low, high, published=None, asked="direction"):
    """A rise with these limits, percent; at a corrected level they are three times as wide."""

    def ends(comparisons):
        width = (high - low) * (comparisons > 1)
        return log_ratio(low - width), log_ratio(high + width)

    printed = math.nan if published is None else log_ratio(published)
    return Condition("size" if published else asked, 1, ends, printed)


@pytest.mark.parametrize(
    ("low", "high", "published", "verdict"),
    [
        # A rise of 55 % is published; two thirds of its logarithm are a rise of 33.9 %.
        (1, 56, 55, UNDECIDED),  # anything from nothing to all of it
        (40, 50, 55, HOLDS),
        (30, 50, 55, UNDECIDED),
        (34, 50, 55, HOLDS),
        (5.001, 33.8, 55, SMALLER),
        (2, 33.8, 55, LESS),  # perhaps none
        (-2, 34, 55, UNDECIDED),
        (-4, 4, 55, NEGLIGIBLE),
        (2, 4, 55, NEGLIGIBLE),  # not zero, and smaller than anybody cares for
        (-30, -10, 55, OPPOSITE),
        (-30, -4, 55, LESS),
        (-30, -4, None, UNDECIDED),  # nothing is published that it could be less than
        (6, 60, None, HOLDS),  # a direction alone
        (4, 60, None, UNDECIDED),
    ],
)
def test_an_effect_by_the_region_of_its_limits(low, high, published, verdict):
    assert verdict_of(effect(low, high, published)) == verdict


def test_a_fall_is_judged_as_the_rise_of_its_sign_and_an_order_by_however_little():
    def fall(low, high, published):
        return Condition("size", -1, lambda _: (log_ratio(low), log_ratio(high)), published)

    # To (1 - 0.55) to the power of 2/3, which is a fall by 41.3 %.
    assert verdict_of(fall(-50, -41.4, log_ratio(-55))) == HOLDS
    assert verdict_of(fall(-50, -41.2, log_ratio(-55))) == UNDECIDED
    assert verdict_of(fall(-41, -6, log_ratio(-55))) == SMALLER
    assert verdict_of(fall(10, 30, log_ratio(-55))) == OPPOSITE
    assert verdict_of(effect(0.1, 3, asked="order")) == HOLDS
    assert verdict_of(effect(-3, -0.1, asked="order")) == OPPOSITE
    assert verdict_of(effect(-1, 1, asked="order")) == UNDECIDED
    # Learning curves that do not fall have no distance along the images.
    for sign in (1, -1):
        unknown = Condition("size", sign, lambda _: (math.nan, math.nan), log_ratio(50))
        assert verdict_of(unknown) == UNDECIDED


def test_what_is_unknown_is_undecided_and_a_failure_is_the_worst():
    for ends, verdict in (
        ((-math.inf, math.inf), UNDECIDED),
        ((math.inf, math.inf), HOLDS),
    ):
        assert verdict_of(Condition("size", 1, lambda _, ends=ends: ends, 0.5)) == verdict


GOOD, SMALL, NONE = effect(50, 60, 55), effect(10, 30, 55), effect(-1, 1, 55)
LITTLE = effect(2, 14, 55)  # and at the level of two conditions from -10 to 26
AGAINST, OPEN = effect(-30, -20, 55), effect(-30, 30, 55)
RELATION = GOOD._replace(compares=True)


@pytest.mark.parametrize(
    ("conditions", "verdict"),
    [
        ([GOOD, GOOD], HOLDS),
        ([GOOD, OPEN], UNDECIDED),
        ([GOOD, NONE], MIXED),
        ([NONE, NONE], NEGLIGIBLE),
        ([NONE, OPEN], REFUTED),  # whatever the other one is, the claim cannot hold any more
        ([LITTLE, OPEN], REFUTED),
        ([NONE, AGAINST], REFUTED),
        ([NONE, RELATION], REFUTED),  # two effects set against each other tell neither of them
        ([NONE, GOOD, RELATION], MIXED),
        ([GOOD, RELATION], HOLDS),
        ([AGAINST, AGAINST], OPPOSITE),
        ([LITTLE, NONE], LESS),
        ([LITTLE, GOOD], MIXED),
        ([LITTLE, AGAINST], REFUTED),
        # Refuting needs the corrected level, where limits 20 apart become 60 apart.
        ([SMALL, SMALL], UNDECIDED),
        ([SMALL], SMALLER),
    ],
)
def test_conditions_together(conditions, verdict):
    assert judge(conditions) == verdict


def test_the_best_of_all_is_refuted_by_one_that_is_certainly_better():
    ahead, level, behind = effect(5, 9), effect(-3, 4), effect(-9, -8)
    assert judge_best(orders(ahead, ahead)) == HOLDS
    assert judge_best(orders(ahead, level)) == UNDECIDED
    assert judge_best(orders(ahead, level, behind)) == REFUTED
    # At the level of two rivals limits 20 apart become 60 apart, which decides nothing.
    assert judge_best(orders(ahead, effect(-25, -5))) == UNDECIDED


def test_three_of_five_are_counted_by_the_surest_of_them():
    better, same, worse = effect(5, 9), effect(-3, 4), effect(-20, -15)
    unsure = effect(2, 5)  # at a corrected level from -1 to 8

    def things(*pairs):
        return [orders(*pair) for pair in pairs]

    both = (better, better)
    assert judge_several(things(both, both, both, (same, worse), (same, same)), 3) == HOLDS
    assert judge_several(things(both, both, (better, same), both, (worse, same)), 3) == HOLDS
    assert judge_several(things(both, both, (better, same), (same, same), both[:1]), 2) == HOLDS
    assert judge_several(things(both, both, (better, same), (same, same), (worse, same)), 3) == (
        UNDECIDED
    )
    assert judge_several(things(both, both, (better, unsure), (same, same), (worse, same)), 3) == (
        UNDECIDED
    )
    lost = things(both, both, (worse, better), (same, worse), (worse, worse))
    assert judge_several(lost, 3) == REFUTED
    assert judge_several(lost, 2) == HOLDS
    # Noise has a third best of five on either side of nothing: nothing is said.
    assert judge_several(things(*[(same, same)] * 5), 3) == UNDECIDED


def test_effects_that_are_none_are_hardly_ever_taken_for_three_of_five():
    rng = np.random.default_rng(3)
    found = []
    for _ in range(300):
        things = []
        for _ in PAPERS_FIVE:
            parts = [Part(tuple(rng.normal(0, 0.06, 5)), (1e-4,) * 5) for _ in range(2)]
            things.append([Condition("order", -1, part.limits) for part in parts])
        found.append(judge_several(things, 3))
    assert found.count(UNDECIDED) / len(found) > 0.97


def orders(*conditions):
    return [condition._replace(asked="order") for condition in conditions]


def test_shares_of_batches_beside_a_third_and_a_half():
    def share(low, high, wider=0.0):
        return lambda comparisons: (low - wider * (comparisons > 1), high + wider)

    assert judge_few({"a": share(0.0, 0.2), "b": share(0.1, 0.3)}) == HOLDS
    assert judge_few({"a": share(0.0, 0.2), "b": share(0.1, 0.4)}) == UNDECIDED
    assert judge_few({"a": share(0.0, 0.2), "b": share(0.4, 0.6)}) == OPPOSITE
    assert judge_few({"a": share(0.0, 0.2), "b": share(0.4, 0.6, wider=0.1)}) == UNDECIDED
    assert [judge_many(share(*ends)) for ends in ((0.6, 0.9), (0.4, 0.6), (0.1, 0.4))] == [
        *(HOLDS, UNDECIDED, OPPOSITE)
    ]
    assert [reached(*ends, 5.0) for ends in ((5, 6), (4, 6), (3, 4.9))] == [
        *(HOLDS, UNDECIDED, OPPOSITE)
    ]


TRUTHS = {-40: OPPOSITE, -12: OPPOSITE, 0: NEGLIGIBLE, 3: NEGLIGIBLE, 10: SMALLER, 20: SMALLER}
TRUTHS |= {30: SMALLER, 45: HOLDS, 55: HOLDS, 80: HOLDS}


@pytest.mark.parametrize(("truth", "right"), TRUTHS.items())
def test_more_data_only_ever_makes_the_right_verdict_likelier(truth, right):
    """An effect measured with an ever smaller standard error, as a run with ever more test paths.

    Wrong verdicts are as rare as 5 % allow at every size, and the right one comes more often.
    """
    rng = np.random.default_rng(100 + truth)
    trials, shares, not_open = 400, [], []
    layout, published = Layout(400), log_ratio(55)
    for standard_error in (0.16, 0.08, 0.04, 0.02, 0.01, 0.005):
        measured = log_ratio(truth) + standard_error * rng.normal(size=trials)
        noise = standard_error * rng.normal(size=400)
        samples = [np.concatenate([[m], m + noise]) for m in measured]
        found = [
            verdict_of(Condition("size", 1, partial(limits, sample, layout), published))
            for sample in samples
        ]
        shares.append(found.count(right) / trials)
        coarse = found.count(LESS) if truth < 55 * 2 / 3 else 0
        wrong = trials - found.count(right) - coarse - found.count(UNDECIDED)
        assert wrong / trials < 0.08
        not_open.append(1 - found.count(UNDECIDED) / trials)
    error = 3 * np.sqrt(0.5 / trials)  # of a difference of two shares
    for rising in (shares, not_open):
        assert all(after > before - error for before, after in pairwise(rising))
    assert shares[-1] > 0.97


def test_percent_is_the_change_a_ratio_stands_for():
    assert percent(math.log(0.45)) == pytest.approx(-55)
    assert percent(math.inf) == math.inf


def test_the_rules_name_what_is_asked_of_each_claim_about_a_size():
    page = (ROOT / "docs/rules.md").read_text()
    of_claim = {}
    for (claim, _, _, against), log in printed_effects().items():
        if claim in ("C2", "C6", "C7", "C8", "C13") and against == "true":
            of_claim.setdefault(claim, []).append(-log if claim == "C6" else log)  # told as harm
    for claim, logs in of_claim.items():
        (line,) = (line for line in page.splitlines() if line.startswith(f"  | {claim},"))
        _, _, printed, asked, _ = line.split("|")
        for text, factor in ((printed, 1), (asked, 2 / 3)):
            told = [float(n) for n in re.findall(r"[+-]\d+", text.replace("−", "-"))]
            expected = [100 * math.expm1(factor * log) for log in logs]
            assert told == pytest.approx(expected, abs=0.501), claim
