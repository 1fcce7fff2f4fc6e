"""Limits over test paths and training runs, against simulations whose truth is known."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t as student

from reproduction.claims.judge import Condition, verdict_of
from reproduction.claims.verdicts import Verdict
from reproduction.report.deviations import seed_deviations
from reproduction.statistics.limits import score_of
from reproduction.statistics.seeds import (
    BORROWED,
    Group,
    Layout,
    borrowed_deviations,
    half_width,
    limits,
    seed_variance,
)

# Share of the seeds in the variance of what is estimated.
SHARES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95)
SEEDS, RESAMPLES = 3, 400
NORMAL = 1.959964  # tabulated 97.5 % point
INF = math.inf


def test_half_widths_at_the_ends_are_those_of_the_textbook():
    assert half_width(2.0, 0.0, 2) == 2.0
    # Student's t with 2 and 4 degrees of freedom, tabulated: 4.3027 and 2.7764.
    assert half_width(0.0, 1.0, 2) == pytest.approx(4.3027, abs=1e-4)
    assert half_width(0.0, 3.0, 4) == pytest.approx(3 * 2.7764, abs=1e-3)
    # With many degrees of freedom both parts are normal, and add in quadrature.
    assert half_width(3.0, 4 / NORMAL, 1e9) == pytest.approx(5.0, abs=1e-5)
    assert half_width(INF, 1.0, 2) == INF


def test_three_runs_in_a_table_are_covered_as_often_as_95_percent_say():
    """Medians of three runs: one deviation that they share, from the test paths, one of each."""
    rng = np.random.default_rng(2)
    trials = 1500
    for share in SHARES:
        # Variances of the mean; the test paths' is known well, as of dozens of paths.
        of_paths, of_seeds = math.sqrt(1 - share), math.sqrt(share * SEEDS)
        hits = 0
        for _ in range(trials):
            values = 50 + of_paths * rng.normal() + of_seeds * rng.normal(size=SEEDS)
            margin = NORMAL * of_paths
            runs = [{"e": v, "e_low": v - margin, "e_high": v + margin} for v in values]
            found = score_of(runs, "e")
            hits += found["e_low"] <= 50 <= found["e_high"]
        assert 0.93 <= hits / trials <= 0.97 + 0.012, (
            share
        )  # two standard errors of a share of 97 %


def simulated(rng, truth, share, error, n_localizers, n_seeds, borrowed=0.0):
    """A mean effect over localizers as a claim has it, from logarithms of errors.

    Its standard error is ``error`` percent, of whose variance ``share`` is the training runs'.
    """
    degrees = n_seeds - 1 if n_seeds > 1 else 16
    groups = tuple(Group(n_seeds, degrees, n_seeds == 1) for _ in range(n_localizers))
    layout = Layout(RESAMPLES, groups)
    of_paths = error * math.sqrt(1 - share)
    of_run = error * math.sqrt(share * n_localizers * n_seeds)
    observed = of_paths * rng.normal()
    drawn = np.concatenate([[0.0], of_paths * rng.normal(size=RESAMPLES)])
    samples = []
    for place in range(n_localizers):
        runs = 100 + truth + observed + of_run * rng.normal(size=(n_seeds, 1)) + drawn
        # What a single run borrows is known to so many degrees of freedom.
        spread = math.sqrt(rng.chisquare(degrees) / degrees)
        relative = of_run * spread / (100 + truth) if n_seeds == 1 else 0.0
        samples.append(layout.sample(list(runs), place, relative))
    return np.mean(samples, axis=0) - 100, layout


@pytest.mark.parametrize("n_localizers", [1, 5])
def test_claims_about_one_and_five_localizers_are_covered(n_localizers):
    rng = np.random.default_rng(3)
    trials = 800
    for share in SHARES:
        hits = 0
        for _ in range(trials):
            low, high = limits(*simulated(rng, 10.0, share, 3.0, n_localizers, SEEDS))
            hits += low <= 10.0 <= high
        assert 0.93 - 0.016 <= hits / trials <= 0.97 + 0.012, (n_localizers, share)


TRUTHS = (-12.0, 0.0, 12.0, 30.0, 55.0)
RIGHT = {
    -12.0: {Verdict.OPPOSITE, Verdict.LESS},
    0.0: {Verdict.NEGLIGIBLE, Verdict.LESS},
    12.0: {Verdict.SMALLER, Verdict.LESS},
    30.0: {Verdict.SMALLER, Verdict.LESS},
    55.0: {Verdict.HOLDS},
}


@pytest.mark.parametrize(("n_seeds", "most"), [(3, 0.025), (1, 0.05)])
def test_wrong_verdicts_are_rare(n_seeds, most):
    """Over effects from opposite to published, standard errors, and shares of the seeds."""
    rng = np.random.default_rng(4)
    wrong = {}
    for share in (0.1, 0.5, 0.95):
        found = []
        for truth in TRUTHS:
            for error in (2.0, 6.0, 12.0):
                for _ in range(60):
                    sample, layout = simulated(rng, truth, share, error, 1, n_seeds)
                    logs = np.log1p(sample / 100)
                    of_sample = partial(limits, logs, layout)
                    verdict = verdict_of(Condition("size", 1, of_sample, math.log1p(0.55)))
                    found.append(verdict not in {*RIGHT[truth], Verdict.UNDECIDED})
        wrong[share] = np.mean(found)
    assert max(wrong.values()) <= most, wrong


def test_without_the_spread_over_seeds_most_verdicts_of_one_run_could_not_be_trusted():
    """The borrowed deviation is needed: limits over the test paths alone miss the truth often."""
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(400):
        sample, layout = simulated(rng, 10.0, 0.75, 3.0, 1, 1)
        alone = Layout(layout.resamples)
        low, high = limits(sample[: alone.length], alone)
        hits += low <= 10.0 <= high
    assert hits / 400 < 0.75


def test_seed_rows_give_the_variance_of_a_mean_and_pool_their_degrees_of_freedom():
    layout = Layout(2, (Group(3, 2), Group(3, 2), Group(1, 16, borrowed=True)))
    first, second = np.array([1.0, 2.0, 6.0]), np.array([4.0, 5.0, 6.0])
    runs = [np.full((1, 3), v) for v in first], [np.full((1, 3), v) for v in second]
    a, b = (layout.sample([r[0] for r in of_cell], k) for k, of_cell in enumerate(runs))
    # Variances by hand: 7 and 1, of means 7/3 and 1/3.
    assert seed_variance(a, layout) == (pytest.approx(7 / 3), pytest.approx(2))
    variance, degrees = seed_variance(a + b, layout)
    assert variance == pytest.approx(8 / 3)
    assert degrees == pytest.approx((8 / 3) ** 2 / ((7 / 3) ** 2 / 2 + (1 / 3) ** 2 / 2))
    single = layout.sample([np.full(3, 2.0)], 2, relative_sd=0.1)
    assert seed_variance(np.log(single), layout) == (pytest.approx(0.01), pytest.approx(16))
    assert seed_variance(layout.constant(np.ones(3)), layout)[0] == 0
    with pytest.raises(ValueError, match="are laid out"):
        limits(a[:-1], layout)


def test_rows_leave_out_one_run_and_all_else_is_as_observed():
    layout = Layout(2, (Group(3, 2), Group(2, 1)))
    runs = [np.array([1.0, 2.0, 3.0]), np.array([3.0, 4.0, 5.0]), np.array([8.0, 9.0, 10.0])]
    expected = [4, 5, 6, (3 + 8) / 2, (1 + 8) / 2, (1 + 3) / 2, 4, 4]
    np.testing.assert_allclose(layout.sample(runs, 0), expected)
    np.testing.assert_allclose(layout.sample(runs[:2], 1), [2, 3, 4, 2, 2, 2, 3, 1])
    np.testing.assert_array_equal(layout.constant(np.array([7.0, 1.0, 2.0])), [7, 1, 2, *[7] * 5])


def test_limits_of_several_conditions_are_those_of_the_textbook():
    """Student's t with two degrees of freedom at 95 and 99 %, tabulated: 4.3027 and 9.9248."""
    layout = Layout(4, (Group(3, 2),))
    sample = layout.sample([np.full(5, value) for value in (1.0, 2.0, 6.0)], 0)
    error = math.sqrt(7 / 3)  # of the mean of these three
    for comparisons, quantile in ((1, 4.3027), (5, 9.9248)):
        expected = 3 - quantile * error, 3 + quantile * error
        assert limits(sample, layout, comparisons) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(("comparisons", "left_out"), [(1, 0.025), (5, 0.005)])
def test_runs_that_hardly_differ_leave_the_limits_of_the_paths_on_each_side(comparisons, left_out):
    """The resamples reach from 9 below what was observed to 1 above it, evenly."""
    layout = Layout(1000, (Group(3, 2),))
    resampled = np.array([9.0, *np.linspace(0.0, 10.0, 1000)])
    sample = layout.sample([resampled + step for step in (-1e-6, 0.0, 1e-6)], 0)
    expected = 10 * left_out, 10 * (1 - left_out)
    assert limits(sample, layout, comparisons) == pytest.approx(expected, abs=0.02)


def test_a_row_that_is_not_a_number_could_be_anything():
    layout = Layout(4, (Group(3, 2),))
    sample = layout.sample([np.full(5, value) for value in (1.0, 2.0, 3.0)], 0)
    sample[-1] = np.nan
    assert limits(sample, layout) == (-INF, INF)


def test_half_widths_between_the_ends_lie_between_those_of_two_rules():
    """Welch and Satterthwaite's, and Banerjee's, by hand; the first is the narrower one."""
    for of_paths, seed_error, degrees in ((1.0, 1.0, 2), (2.0, 0.5, 2), (0.5, 1.0, 4)):
        path_error = of_paths / NORMAL
        variance = path_error**2 + seed_error**2
        effective = variance**2 / (seed_error**4 / degrees)
        welch = student.ppf(0.975, effective) * math.sqrt(variance)
        banerjee = math.hypot(of_paths, student.ppf(0.975, degrees) * seed_error)
        found = half_width(of_paths, seed_error, degrees)
        assert welch < found < banerjee
        assert found == pytest.approx((welch + banerjee) / 2, rel=0.05)


def test_a_failed_run_leaves_its_side_open():
    layout = Layout(4, (Group(3, 2),))
    runs = [np.full(5, v) for v in (1.0, INF, 3.0)]
    assert limits(layout.sample(runs, 0), layout) == (2.0, INF)


def test_what_a_single_run_borrows_is_of_the_published_tables(tmp_path):
    published = pd.read_csv(BORROWED)
    fresh = seed_deviations(Path("results/published/night"))
    pd.testing.assert_frame_equal(published, fresh, rtol=1e-5, check_dtype=False)
    # One cell of Table 4 by hand: three seeds of PoseNet at 6k vary by 6 % in position, and the
    # pooled deviation lies among those of the cells.
    assert 0.03 < borrowed_deviations()["posenet", "position_m"].relative_sd < 0.0228159 / 0.373547
