"""Statistics of the claims against hand-worked cases, NumPy and SciPy."""

import math
from fractions import Fraction

import numpy as np
import pytest

from reproduction.claims.evidence import Cell, evidence_of
from reproduction.statistics.limits import share_limits, sign_test
from synfeal.evaluation import bootstrap
from synfeal.evaluation.bootstrap import (
    difference,
    limits,
    mean_of,
    medians,
    path_counts,
    relative_change,
)
from tests.support.claims_results import Results, rows_where
from tests.support.report_results import design_of

INF, NAN = math.inf, math.nan


@pytest.mark.parametrize(
    ("changes", "negative", "counted", "chance"),
    [
        ([-1] * 10, 10, 10, Fraction(2, 2**10)),
        ([-1] * 9 + [1], 9, 10, Fraction(2 * (1 + 10), 2**10)),
        ([-1] * 5 + [1] * 5, 5, 10, 1),
        ([0, 0, -2, -0.5, 3], 2, 3, 1),  # those at 0 do not count
        ([-INF, -1, INF, NAN], 2, 3, 1),
        ([-0.5, 0.25, 0.5], 1, 3, 1),
        ([0.0], 0, 0, 1),
        ([], 0, 0, 1),
    ],
)
def test_sign_test_by_counting_splits(changes, negative, counted, chance):
    assert sign_test(changes) == (negative, counted, pytest.approx(float(chance)))


def test_share_limits_are_the_closed_form_at_the_ends():
    # None of n: the upper limit u solves (1 - u)^n = 0.025.
    assert share_limits(0, 17) == pytest.approx((0, 1 - 0.025 ** (1 / 17)))
    assert share_limits(17, 17) == pytest.approx((0.025 ** (1 / 17), 1))
    assert share_limits(0, 17, 0.99) == pytest.approx((0, 1 - 0.005 ** (1 / 17)))


@pytest.mark.parametrize(
    ("errors", "counts", "expected"),
    [
        ([3, 1, 2], [1, 1, 1], 2),
        ([4, 1, 3, 2], [1, 1, 1, 1], 2.5),  # an even count: mean of the middle two
        ([4, 1, 3, 2], [0, 3, 0, 1], 1),  # 1 1 1 2
        ([4, 1, 3, 2], [2, 2, 0, 0], 2.5),  # 1 1 4 4
        ([1, NAN, 2], [1, 1, 1], 2),  # not a number is as bad as infinite
        ([1, NAN], [1, 1], INF),
        ([1, INF, NAN], [1, 1, 1], INF),
        ([1, INF, 2, 3], [1, 1, 1, 1], 2.5),
    ],
)
def test_medians_by_hand(errors, counts, expected):
    values = np.array(errors, dtype=float)
    assert medians(values, np.arange(len(values)), np.array([counts])).tolist() == [expected]


def test_medians_of_resamples_are_numpys_and_made_block_by_block(monkeypatch):
    rng = np.random.default_rng(5)
    path = np.repeat(np.arange(9), rng.integers(1, 6, size=9))
    errors = rng.lognormal(size=len(path))
    errors[rng.integers(len(path), size=6)] = INF
    counts = path_counts(9, rng, 200)
    repeated = [np.median(np.repeat(errors, row[path])) for row in counts]
    assert medians(errors, path, counts).tolist() == repeated
    assert repeated[0] == np.median(errors)
    held, plain = [], bootstrap._medians
    monkeypatch.setattr(bootstrap, "BLOCK", 60)
    monkeypatch.setattr(bootstrap, "_medians", lambda r, c: held.append(c.shape) or plain(r, c))
    counts = path_counts(4, np.random.default_rng(0), 24)  # 25 rows of 12 frames: 300 counts
    medians(np.arange(12.0), np.arange(12) % 4, counts)
    assert held == [(5, 12)] * 5


def test_draws_are_of_whole_paths_and_as_many_as_there_are():
    counts = path_counts(20, np.random.default_rng(0), 4000)
    assert counts.shape == (4001, 20)
    assert (counts[0] == 1).all()
    assert (counts.sum(axis=1) == 20).all()
    assert counts.dtype == np.int64
    assert path_counts(2, np.random.default_rng(0)).shape == (1 + bootstrap.RESAMPLES, 2)
    # Each path is drawn Binomial(20, 1/20) times: mean 1, and left out with chance 0.95^20.
    assert counts[1:].mean(axis=0) == pytest.approx(np.ones(20), abs=0.08)
    assert (counts[1:] == 0).mean() == pytest.approx(0.95**20, abs=0.005)


def test_changes_of_failures():
    new = np.array([0.5, INF, 1.0, INF])
    old = np.array([1.0, 1.0, INF, INF])
    assert relative_change(new, old)[:3].tolist() == [-50, INF, -100]
    assert np.isnan(relative_change(new, old)[3])
    zero = np.array([0.0, 0.0])  # no error at all, as of a set that repeats its training frames
    assert relative_change(np.array([1.0, 0.0]), zero)[0] == INF
    assert np.isnan(relative_change(np.array([1.0, 0.0]), zero)[1])
    assert np.isnan(difference(np.array([INF]), np.array([INF]))[0])
    assert mean_of([np.array([1.0, INF]), np.array([3.0, 1.0])]).tolist() == [2, INF]
    assert np.isnan(mean_of([np.array([INF]), np.array([-INF])])[0])


def test_limits_leave_two_and_a_half_percent_on_either_side_of_what_is_known(monkeypatch):
    sample = np.concatenate([[50.0], np.random.default_rng(1).permutation(np.arange(1, 1001))])
    assert limits(sample) == (26, 975)
    assert limits(sample, 5) == (6, 995)
    drawn = np.arange(1000.0)
    drawn[500:550] = NAN
    assert limits(np.concatenate([[0], drawn])) == (-INF, INF)
    few = np.concatenate([[0], np.arange(995.0), [NAN] * 5])
    assert limits(few) == (20, 974)  # without the five: 24 and 970
    monkeypatch.setattr(bootstrap, "CONFIDENCE", 0.9)  # 1 - 0.9 is a little less than 0.1
    assert limits(np.concatenate([[0.0], np.arange(1.0, 1001.0)])) == (51, 950)


SHIFT = -20.0  # percent, the true change of the median


@pytest.mark.parametrize(("n_paths", "trials"), [(17, 1000), (40, 1000)])
def test_limits_hold_the_truth(n_paths, trials):
    """As often as 95 % promise: the change of two log-normal medians, paired, whose errors vary
    from path to path."""
    rng = np.random.default_rng(11)
    path = np.repeat(np.arange(n_paths), 6)
    hits = 0
    for _ in range(trials):
        shared, counts = rng.normal(0, 0.5, n_paths), path_counts(n_paths, rng, 400)
        sides = []
        for factor in (1 + SHIFT / 100, 1.0):
            logs = (shared + rng.normal(0, 0.28, n_paths))[path] + rng.normal(0, 0.2, len(path))
            sides.append(medians(factor * np.exp(logs), path, counts))
        low, high = limits(relative_change(*sides))
        hits += low <= SHIFT <= high
    assert 0.93 <= hits / trials <= 0.97


def test_repetitions_are_averaged(tmp_path):
    results = Results(tmp_path)
    for row in rows_where(results, table="table2_ground_truth"):
        for model in ("posenet", "posenet2"):
            results.write(row, model, (0.2, 10.0))
            results.write(row, model, (0.4, 20.0), repetition=1)
    evidence = evidence_of(design_of(results.design, 2), results.root)
    position, orientation = evidence.errors(Cell("posenet", labels="sfm"))[0]
    assert (position[0], orientation[0]) == pytest.approx((0.3, 15.0))
    # Without one of two repetitions the other is left, in the rows of these runs alone.
    layout = evidence.layout
    place = [name[:4] for name, _ in evidence.groups].index(Cell("posenet", labels="")[:4])
    own, others = layout.rows()[place], layout.rows()[place - 1]
    assert len(position) == layout.length
    assert sorted(position[own].round(9)) == [0.2, 0.4]
    assert set(position[others].round(9)) == {0.3}
    # The same repetition is left out of both sides of a comparison of labels: no label matters.
    clean, noisy = evidence.errors(*(Cell("posenet", labels=name) for name in ("synfeal", "sfm")))
    assert (clean[0] == noisy[0]).all()
    [other] = evidence.errors(Cell("posenet2"))
    assert not (clean[0] == other[0]).all()
