"""Rules of the verdicts on samples whose limits are known."""

import dataclasses

import numpy as np
import pytest

from synfeal.bootstrap import limits
from synfeal.report.claims.model import FAILS, HOLDS, UNDECIDED, published_claims
from synfeal.report.claims.text import (
    ERRORS,
    PERCENT,
    conditions_text,
    limits_text,
    reached_text,
    values_text,
)
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
        (0, 9, 1, UNDECIDED),
    ],
)
def test_below_zero(low, high, comparisons, verdict):
    assert below_zero(between(low, high), comparisons) == verdict
    if comparisons == 1:
        assert below_zero(between(low, high)) == verdict


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
        (-54.5, -50, -55, HOLDS),  # half a percent short is still rounding
        (-60, 0, -55, UNDECIDED),  # no change at all is not excluded
        (0.1, 0.6, 1, HOLDS),
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
        (0.56, 0.84, HOLDS),  # the bounds themselves
        (0.84, 0.90, UNDECIDED),
        (0.50, 0.56, UNDECIDED),
    ],
)
def test_near_a_published_level(low, high, verdict):
    assert near(between(low, high), 0.70) == verdict


def test_being_off_among_several_needs_more():
    assert near(between(0.90, 1.00), 0.70) == FAILS
    assert near(between(0.90, 1.00), 0.70, 2) == UNDECIDED
    assert near(between(0.40, 0.50), 0.70, 2) == UNDECIDED
    for low, high in ((0.5, 0.8), (1.2, 1.5)):  # one end on a bound
        assert near(between(low, high), 1.0) == UNDECIDED
    for low, high in ((0.8, 1.1), (0.9, 1.2)):
        assert near(between(low, high), 1.0) == HOLDS


def test_counts():
    assert at_least(between(3, 5), 3) == HOLDS
    assert at_least(between(2, 5), 3) == UNDECIDED
    assert at_least(between(0, 2), 3) == FAILS
    assert at_least(between(0, 3), 3) == UNDECIDED


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


def test_conditions_are_counted():
    assert conditions_text([HOLDS, FAILS, HOLDS, UNDECIDED, HOLDS, UNDECIDED, FAILS]) == (
        "of 7 conditions 3 borne out, 2 refuted, 2 undecided"
    )


def test_every_sample_needs_its_form_and_its_number():
    claim = next(claim for claim in published_claims() if claim.id == "C2")
    samples = [between(-60.0, -40.0)] * 3
    with pytest.raises(ValueError, match="zip"):
        values_text(PERCENT, samples)
    with pytest.raises(ValueError, match="zip"):
        limits_text(PERCENT, samples)
    with pytest.raises(ValueError, match="zip"):
        reached_text(samples, claim, [HOLDS] * 3)


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
    samples = between(-60.0, 0.0), between(-60.0, 10.0)
    assert reached_text(samples, claim, (UNDECIDED, UNDECIDED)) == (
        "position not told from the published and not told from no change, "
        "orientation not told from the published and not told from no change"
    )


def test_reasons_of_a_published_rise():
    claim = next(claim for claim in published_claims() if claim.id == "C2")
    rise = dataclasses.replace(claim, numbers=(40.0, 50.0))
    samples = between(10.0, 20.0), between(-20.0, 0.0)
    assert reached_text(samples, rise, (FAILS, FAILS)) == (
        "position short of the published, "
        "orientation short of the published and not told from no change"
    )
    assert reached_text(samples[::-1], rise, (FAILS, HOLDS)).endswith("as published or more")
    samples = between(-20.0, -10.0), between(10.0, 20.0)
    assert reached_text(samples, rise, (FAILS, FAILS)) == (
        "position short of the published and the other way, orientation short of the published"
    )
    least = dataclasses.replace(claim, numbers=(1.0, 1.0))  # the smallest that is not no change
    assert reached_text([between(0.1, 0.3)] * 2, least, (FAILS, FAILS)) == (
        "position short of the published, orientation short of the published"
    )


def test_an_effect_is_told_from_none_when_its_limits_leave_out_zero():
    claim = next(claim for claim in published_claims() if claim.id == "C2")
    fall = dataclasses.replace(claim, numbers=(-55.0, -60.0))
    ends = {(0.0, 30.0): " and not told from no change", (-30.0, -0.5): ""}
    ends |= {(-0.5, 30.0): " and not told from no change", (0.5, 30.0): " and the other way"}
    for (low, high), words in ends.items():
        text = reached_text([between(low, high)] * 2, fall, (FAILS, FAILS))
        assert text == ", ".join(
            f"{name} short of the published{words}" for name in ("position", "orientation")
        )
