"""The rules of the verdicts, against limits chosen by hand and against simulated replications."""

from itertools import pairwise

import numpy as np
import pytest

from reproduction.claims.verdicts import (
    ERRORS,
    PERCENT,
    Condition,
    Verdict,
    all_of,
    best_of,
    limits_text,
    values_text,
    verdict_of,
)
from reproduction.statistics.seeds import Layout, limits

HOLDS, SMALLER, MIXED, NEGLIGIBLE, LESS, OPPOSITE, REFUTED, UNDECIDED, *_ = Verdict
PATHS = Layout(1000)  # no training run moves these samples


def between(low, high):
    """A sample with exactly these 95 % limits, and wider ones at a corrected level."""
    inner = np.linspace(low, high, 950)
    width = high - low
    outer = np.concatenate([np.full(25, low - width), inner, np.full(25, high + width)])
    return np.concatenate([[(low + high) / 2], outer])


def effect(low, high, published=0.0, **keys):
    return Condition("effect", between(low, high), PATHS, published, **keys)


def test_samples_counts_and_what_is_unknown():
    assert limits(between(-3.0, 5.0), PATHS) == (-3, 5)
    assert limits(between(-3.0, 5.0), PATHS, 10) == (-11, 13)
    unknown = np.full(1001, np.nan)
    assert verdict_of(Condition("", unknown, PATHS, 55)) == UNDECIDED
    assert verdict_of(Condition("", np.full(1001, np.inf), PATHS, 55)) == HOLDS


@pytest.mark.parametrize(
    ("low", "high", "published", "verdict"),
    [
        # A fall of 55 % is published; two thirds of it are 36.7 %.
        (1, 56, 55, UNDECIDED),  # -28 % (-56 to -1): anything from nothing to all of it
        (40, 50, 55, HOLDS),  # -45 % (-50 to -40)
        (30, 50, 55, UNDECIDED),
        (5, 36, 55, SMALLER),  # the bounds themselves
        (2, 36, 55, LESS),  # perhaps none
        (-2, 37, 55, UNDECIDED),
        (-4, 4, 55, NEGLIGIBLE),
        (2, 4, 55, NEGLIGIBLE),  # not zero, and smaller than anybody cares for
        (-30, -10, 55, OPPOSITE),
        (-30, -4, 55, LESS),
        (-30, -4, 0, UNDECIDED),  # nothing is published that it could be less than
        # The sign of a published fall is taken out before.
        (40, 50, -55, HOLDS),
        # No size is published: the direction, by more than the smallest of interest.
        (6, 50, 0, HOLDS),
        (2, 50, 0, UNDECIDED),
        (-3, 3, 0, NEGLIGIBLE),
        (-9, -6, 0, OPPOSITE),
        # A published effect smaller than the smallest of interest asks for that one.
        (4, 9, 3, UNDECIDED),
        (5, 9, 3, HOLDS),
    ],
)
def test_a_verdict_is_the_region_an_interval_lies_in(low, high, published, verdict):
    assert verdict_of(effect(low, high, published)) == verdict


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [(0.1, 9, HOLDS), (-9, -0.1, OPPOSITE), (-1, 9, UNDECIDED), (0, 0, NEGLIGIBLE)],
)
def test_an_order_asks_for_no_size(low, high, verdict):
    assert verdict_of(effect(low, high, is_order=True)) == verdict


GOOD, SMALL, NONE = effect(50, 60, 55), effect(10, 30, 55), effect(-1, 1, 55)
LITTLE = effect(2, 14, 55)  # and at the level of two conditions from -10 to 26
AGAINST, OPEN = effect(-30, -20, 55), effect(-60, 60, 55)


@pytest.mark.parametrize(
    ("conditions", "verdict"),
    [
        ([GOOD, GOOD], HOLDS),
        ([GOOD, OPEN], UNDECIDED),
        ([GOOD, NONE], MIXED),
        ([NONE, NONE], NEGLIGIBLE),
        ([NONE, OPEN], NEGLIGIBLE),  # whatever the other one is, the claim cannot hold any more
        ([NONE, AGAINST], MIXED),
        ([AGAINST, AGAINST], OPPOSITE),
        ([LITTLE, NONE], LESS),
        ([LITTLE, GOOD], MIXED),
        ([LITTLE, AGAINST], MIXED),
        # Refuting needs the corrected level, where an interval 20 wide becomes one 60 wide.
        ([SMALL, SMALL], UNDECIDED),
        ([SMALL], SMALLER),
    ],
)
def test_conditions_together(conditions, verdict):
    assert all_of(conditions)[0] == verdict


def test_reasons_name_conditions_and_single_ones_refute_a_mean():
    assert all_of([GOOD, OPEN])[1] == "effect: holds, effect: undecided"
    assert all_of([GOOD, OPEN, GOOD])[1] == "holds: effect, effect; undecided: effect"
    unnamed = [condition._replace(name="") for condition in (GOOD, OPEN, GOOD)]
    assert all_of(unnamed)[1] == "of 3 conditions 2 holds, 1 undecided"
    against = effect(-60, -50, 55)._replace(name="PoseNet")
    assert all_of([GOOD], each=[GOOD, OPEN])[0] == HOLDS
    verdict, reason, _ = all_of([GOOD], each=[GOOD, against])
    assert verdict == MIXED
    assert reason.endswith("; single ones opposite: PoseNet")
    assert all_of([OPEN], each=[GOOD, GOOD])[0] == UNDECIDED


def test_the_best_of_all_is_refuted_by_one_that_is_certainly_better():
    ahead, open_, behind = (
        effect(*ends)._replace(name=name)
        for name, ends in {"A": (5, 9), "B": (-3, 4), "C": (-9, -8)}.items()
    )
    assert best_of([ahead, ahead])[0] == HOLDS
    assert best_of([ahead, open_])[0] == UNDECIDED
    verdict, reason, _ = best_of([ahead, open_, behind])
    assert (verdict, reason[-22:]) == (REFUTED, "certainly worse than C")
    # At the level of two rivals an interval 20 wide becomes one 60 wide, which decides nothing.
    assert best_of([ahead, effect(-25, -5)])[0] == UNDECIDED


PUBLISHED = 55.0
TRUTHS = {-40: OPPOSITE, -12: OPPOSITE, 0: NEGLIGIBLE, 3: NEGLIGIBLE, 10: SMALLER, 20: SMALLER}
TRUTHS |= {30: SMALLER, 45: HOLDS, 55: HOLDS, 80: HOLDS}


@pytest.mark.parametrize(("truth", "right"), TRUTHS.items())
def test_more_data_only_ever_makes_the_right_verdict_likelier(truth, right):
    """An effect measured with an ever smaller standard error, as a run with ever more test paths.

    Wrong verdicts are as rare as 5 % allow at every size, and the right one comes more often.
    """
    rng = np.random.default_rng(100 + truth)
    trials, shares, not_open = 400, [], []
    for standard_error in (16.0, 8.0, 4.0, 2.0, 1.0, 0.5):
        measured = truth + standard_error * rng.normal(size=trials)
        noise = standard_error * rng.normal(size=400)
        found = [
            verdict_of(Condition("", np.concatenate([[m], m + noise]), Layout(400), PUBLISHED))
            for m in measured
        ]
        shares.append(found.count(right) / trials)
        coarse = found.count(LESS) if truth < PUBLISHED * 2 / 3 else 0
        wrong = trials - found.count(right) - coarse - found.count(UNDECIDED)
        assert wrong / trials < 0.08
        not_open.append(1 - found.count(UNDECIDED) / trials)
    error = 3 * np.sqrt(0.5 / trials)  # of a difference of two shares
    for rising in (shares, not_open):
        assert all(after > before - error for before, after in pairwise(rising))
    assert shares[-1] > 0.97


def test_text_of_values_and_limits():
    samples = between(-60.0, -40.0), between(-10.0, 20.0)
    assert values_text(PERCENT, samples) == "p -50.0 %, o +5.0 %"
    assert limits_text(PERCENT, samples, PATHS) == "p -60.0 % to -40.0 %, o -10.0 % to +20.0 %"
    failed = np.full(1001, np.inf), np.full(1001, np.nan)
    assert values_text(ERRORS, failed) == "p +infinite, o unknown"
    assert (
        limits_text(ERRORS, failed, PATHS) == "p +infinite to +infinite, o -infinite to +infinite"
    )


def test_a_verdict_says_which_thresholds_it_hangs_on():
    assert all_of([effect(50, 60, 55)]).turned == {}
    # Two thirds of 55 % are 36.7 %, three quarters 41.3 %, a half 27.5 %.
    assert all_of([effect(38, 60, 55)]).turned == {"replicated from 3/4": UNDECIDED}
    assert all_of([effect(6, 30, 55)]).turned == {
        "smallest effect 10 %": LESS,
        "replicated from 1/2": UNDECIDED,
    }
    assert all_of([effect(-4, 4)]).turned == {"smallest effect 2.5 %": UNDECIDED}
