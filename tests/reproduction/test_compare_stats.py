"""Differences of medians: known shifts, SciPy's bootstrap and t-test, and how often limits hold."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from reproduction.compare.stats import RunErrors, compare_errors, draws_of
from reproduction.statistics.limits import MEASURES
from reproduction.statistics.seeds import borrowed_deviations

N = 120
UNPUBLISHED = "other"  # a localizer without published runs: a single run tells of paths alone


def run(*seeds, path=None):
    """A run with the same errors in every measure, one path per frame unless told."""
    frame = np.arange(seeds[0].shape[-1])
    errors = np.stack([np.broadcast_to(values, (4, len(frame))) for values in seeds])
    return RunErrors(frame, frame if path is None else path, errors)


def difference(a, b, paired=True, model=UNPUBLISHED):
    found = compare_errors(a, b, paired, model)
    assert found.measure.tolist() == list(MEASURES)
    return found.iloc[0]


@pytest.fixture
def errors():
    return np.random.default_rng(1).lognormal(size=N)


@pytest.mark.parametrize(
    ("shift", "verdict"), [(0.25, "worse"), (-0.25, "better"), (0.0, "no difference seen")]
)
def test_paired_limits_of_a_constant_shift_are_the_shift(errors, shift, verdict):
    found = difference(run(errors + 1), run(errors + 1 + shift))
    assert [found.low, found.difference, found.high] == pytest.approx([shift] * 3, abs=1e-12)
    assert found.verdict == verdict
    assert found.change_percent == pytest.approx(100 * shift / (1 + np.median(errors)))


@pytest.mark.parametrize("paired", [True, False])
def test_limits_are_those_of_scipy(paired):
    rng = np.random.default_rng(4)
    a = rng.lognormal(size=200)
    b = 1.1 * a * np.exp(0.3 * rng.normal(size=200))
    found = difference(run(a), run(b), paired)
    scipy_limits = stats.bootstrap(
        (a, b),
        lambda x, y, axis: np.median(y, axis=axis) - np.median(x, axis=axis),
        paired=paired,
        method="percentile",
        n_resamples=5000,
        rng=np.random.default_rng(5),
    ).confidence_interval
    width = scipy_limits.high - scipy_limits.low
    assert [found.low, found.high] == pytest.approx(list(scipy_limits), abs=0.12 * width)


def test_failures_make_a_run_worst_and_few_move_the_median_as_large_errors_would(errors):
    failed = np.full(N, np.inf)
    worse = difference(run(errors), run(failed))
    assert (worse.verdict, worse.difference, worse.change_percent) == ("worse", math.inf, math.inf)
    better = difference(run(failed), run(errors))
    assert (better.verdict, better.difference, better.change_percent) == ("better", -math.inf, -100)
    both = difference(run(failed), run(failed))
    assert (both.verdict, both.difference, both.change_percent) == ("no difference seen", 0, 0)
    some, large = errors.copy(), errors.copy()
    some[::3], large[::3] = np.inf, 1e9
    pd.testing.assert_series_equal(*(difference(run(errors), run(b)) for b in (some, large)))
    assert difference(run(errors), run(some)).difference > 0


def test_limits_of_seeds_that_differ_by_a_constant_are_those_of_welchs_t_test(errors):
    a, b = [errors + s for s in (0.0, 0.3, 0.1)], [errors + s for s in (0.5, 0.9)]
    found = difference(run(*a), run(*b))
    medians = [[float(np.median(values)) for values in seeds] for seeds in (a, b)]
    assert found.difference == pytest.approx(0.7 - 0.4 / 3)
    assert [found.sd_a, found.sd_b] == pytest.approx([np.std(m, ddof=1) for m in medians])
    welch = stats.ttest_ind(medians[1], medians[0], equal_var=False).confidence_interval(0.95)
    assert [found.low, found.high] == pytest.approx(list(welch))
    failed = np.full(N, np.inf)
    found = difference(run(errors, errors + 1, failed), run(errors, errors + 3))
    assert found.sd_a == pytest.approx(math.sqrt(0.5))  # of the two that are finite
    assert found.sd_b == pytest.approx(math.sqrt(4.5))
    assert (found.low, found.difference) == (-math.inf, -math.inf)  # one of three has failed
    assert np.isnan(difference(run(errors, errors + 1), run(errors)).sd_b)
    assert np.isnan(difference(run(errors, failed), run(errors, errors + 1)).sd_a)


def test_single_runs_borrow_the_deviation_of_published_ones(errors):
    found = difference(run(errors), run(errors + 1.0), model="posenet2")
    known = borrowed_deviations()["posenet2", "position_m"]
    medians = np.array([np.median(errors), np.median(errors) + 1.0])
    deviation = medians * np.sinh(known.relative_sd)  # half of what one deviation up and down span
    error = math.hypot(*deviation)
    freedom = error**4 / ((deviation**4).sum() / known.degrees_of_freedom)
    width = stats.t.ppf(0.975, freedom) * error
    assert [found.low, found.high] == pytest.approx([1.0 - width, 1.0 + width])


def test_another_seed_of_the_same_training_is_rarely_told_apart():
    rng = np.random.default_rng(3)
    path = np.arange(N) // 4
    known = borrowed_deviations()["posenet2", "position_m"]
    told = {"posenet2": 0, UNPUBLISHED: 0}
    for _ in range(40):
        hard = rng.lognormal(sigma=0.5, size=N)
        a, b = (
            hard * np.exp(known.relative_sd * rng.normal() + 0.1 * rng.normal(size=N))
            for _ in range(2)
        )
        for model in told:
            found = difference(run(a, path=path), run(b, path=path), model=model)
            told[model] += found.verdict != "no difference seen"
    assert told["posenet2"] <= 6  # 2 on average; more than 6 in one of two hundred cases
    assert told[UNPUBLISHED] >= 8  # by paths alone a quarter are


def test_each_measure_is_compared_with_itself(errors):
    frame = np.arange(N)
    a, b = (np.stack([(k + 1) * errors + shift * k for k in range(4)])[None] for shift in (0, 1))
    found = compare_errors(
        RunErrors(frame, frame, a), RunErrors(frame, frame, b), paired=True, model=UNPUBLISHED
    )
    assert found.a.tolist() == pytest.approx([(k + 1) * np.median(errors) for k in range(4)])
    assert found.difference.tolist() == pytest.approx([0, 1, 2, 3])


def test_draws_are_a_thousand_and_others_for_the_other_tree():
    path = np.array([7, 7, 2, 9])
    (place, a), (_, again), (_, b) = (draws_of(path, tree) for tree in "aab")
    assert place.tolist() == [1, 1, 0, 2]
    assert a.shape == (1001, 3)
    assert (a[0] == 1).all()  # what was observed
    assert (a.sum(axis=1) == 3).all()
    np.testing.assert_array_equal(a, again)
    assert not np.array_equal(a, b)


def test_limits_are_differences_that_occur_between_the_outer_two_and_a_half_percent():
    a, b = np.random.default_rng(8).lognormal(size=(2, 30))
    found = difference(run(a), run(b))
    _, counts = draws_of(np.arange(30), "a")
    drawn = np.array([np.median(np.repeat(b, k)) - np.median(np.repeat(a, k)) for k in counts[1:]])
    assert (drawn < found.low).mean() <= 0.026 <= (drawn <= found.low).mean()
    assert (drawn > found.high).mean() <= 0.026 <= (drawn >= found.high).mean()
    whole = np.arange(N, dtype=float)
    half_failed = np.where(np.arange(N) % 2 == 0, np.inf, 1.0)
    found = difference(run(whole), run(half_failed), paired=False)
    assert found.high == math.inf
    assert not math.isnan(found.low)
