"""Rules of the verdicts on samples whose limits are known."""

import numpy as np
import pytest

from synfeal.bootstrap import limits
from synfeal.report.claims.model import FAILS, HOLDS, UNDECIDED, published_claims
from synfeal.report.claims.text import ERRORS, PERCENT, limits_text, reached_text, values_text
from synfeal.report.claims.verdicts import all_of, at_least, below_zero, near, reaches


def between(low, high):
    """A sample with exactly these 95 % limits, and wider ones at a corrected level."""
    inner = np.linspace(low, high, 950)
    width = high - low
    outer = np.concatenate([np.full(25, low - width), inner, np.full(25, high + width)])
    return np.concatenate([[(low + high) / 2], outer])


def test_the_samples_are_what_they_are_said_to_be():
    assert limits(between(-3.0, 5.0)) == (-3, 5)
    assert limits(between(-3.0, 5.0), 10) == (-11, 13)


@pytest.mark.parametrize(
    ("parts", "verdict"),
    [
        ([HOLDS, HOLDS], HOLDS),
        ([HOLDS, UNDECIDED], UNDECIDED),
        ([HOLDS, UNDECIDED, FAILS], FAILS),
        ([FAILS, FAILS], FAILS),
    ],
)
def test_conditions_together(parts, verdict):
    assert all_of(parts) == verdict


@pytest.mark.parametrize(
    ("low", "high", "comparisons", "verdict"),
    [
        (-9, -1, 1, HOLDS),
        (-9, -1, 30, HOLDS),  # no correction where all have to pass
        (1, 9, 1, FAILS),
        (1, 9, 30, UNDECIDED),  # too little among thirty
        (9, 10, 30, FAILS),
        (-9, 1, 1, UNDECIDED),
        (-9, 0, 1, UNDECIDED),
    ],
)
def test_below_zero(low, high, comparisons, verdict):
    assert below_zero(between(low, high), comparisons) == verdict


@pytest.mark.parametrize(
    ("low", "high", "published", "verdict"),
    [
        (-60, -40, -55, HOLDS),  # holds the published change
        (-90, -70, -55, HOLDS),  # goes beyond it
        (-54.6, -50, -55, HOLDS),  # short by no more than rounding
        (-54.4, -50, -55, FAILS),
        (-30, -10, -55, FAILS),  # a gain, but a smaller one
        (10, 30, -55, FAILS),
        (-60, 5, -55, UNDECIDED),  # holds the published change and none at all
        (40, 70, 65, HOLDS),
        (10, 30, 65, FAILS),
        (-5, 70, 65, UNDECIDED),
    ],
)
def test_reaching_a_published_change(low, high, published, verdict):
    assert reaches(between(low, high), published) == verdict


def test_falling_short_among_several_needs_more():
    assert reaches(between(-50, -40), -55) == FAILS
    assert reaches(between(-50, -40), -55, 2) == UNDECIDED


@pytest.mark.parametrize(
    ("low", "high", "verdict"),
    [
        (0.60, 0.80, HOLDS),  # 0.56 to 0.84 is within 20 % of 0.70
        (0.50, 0.80, UNDECIDED),
        (0.20, 1.50, UNDECIDED),
        (0.90, 1.20, FAILS),
        (0.10, 0.50, FAILS),
    ],
)
def test_near_a_published_level(low, high, verdict):
    assert near(between(low, high), 0.70) == verdict


def test_counts():
    assert at_least(between(3, 5), 3) == HOLDS
    assert at_least(between(2, 5), 3) == UNDECIDED
    assert at_least(between(0, 2), 3) == FAILS


def test_unknown_is_undecided():
    unknown = np.full(1001, np.nan)
    assert below_zero(unknown) == reaches(unknown, -55) == near(unknown, 0.7) == UNDECIDED


def test_text_of_values_and_limits():
    samples = between(-60.0, -40.0), between(-10.0, 20.0)
    assert values_text(PERCENT, samples) == "p -50.0 %, o +5.0 %"
    assert limits_text(PERCENT, samples) == "p -60.0 % to -40.0 %, o -10.0 % to +20.0 %"
    failed = np.full(1001, np.inf), np.full(1001, np.nan)
    assert values_text(ERRORS, failed) == "p +infinite, o unknown"
    assert limits_text(ERRORS, failed) == "p +infinite to +infinite, o -infinite to +infinite"


def test_reasons_tell_a_smaller_effect_from_none_and_from_the_opposite():
    claim = next(claim for claim in published_claims() if claim.id == "C2")  # -55 and -60 %
    samples = between(-30.0, -10.0), between(-30.0, 10.0)
    assert reached_text(samples, claim, (FAILS, FAILS)) == (
        "position short of the published, "
        "orientation short of the published and not told from no change"
    )
    samples = between(-60.0, -50.0), between(10.0, 20.0)
    assert reached_text(samples, claim, (HOLDS, FAILS)) == (
        "position as published or more, orientation short of the published and the other way"
    )
