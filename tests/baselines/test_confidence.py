"""Confidence of a pose, against a simulation of chance."""

import math

import numpy as np
import pytest

from baselines.references.confidence import NO_SUPPORT, Support, support_of

SIZE = (320, 240)


def test_chance_alone_is_almost_never_confident():
    """Random points in front of random pixels: no pose among 40 is accepted.

    The poses tried are the best of many, as RANSAC's are: each agrees with three of the matches by
    construction, as P3P does, and with others by luck.
    """
    rng = np.random.default_rng(0)
    best = []
    for _ in range(40):
        n_matches = int(rng.integers(40, 400))
        pixel = rng.uniform([0, 0], SIZE, (n_matches, 2))
        most = NO_SUPPORT
        for _ in range(100):
            agree = rng.random(n_matches) < math.pi * 4.0**2 / (SIZE[0] * SIZE[1])
            agree[rng.choice(n_matches, 3, replace=False)] = True
            found = support_of(pixel, np.arange(n_matches), agree, SIZE, 4.0)
            most = min(most, found, key=lambda support: support.log10_nfa)
        best.append(most.confidence)
    assert max(best) < 0.9


def test_the_bound_is_that_of_the_binomial_tail():
    """With one match a patch, NFA bounds the expected number of triples with so many followers.

    The exact expectation of groups is the number of triples times the binomial tail beyond it.
    """
    support = Support(inliers=12, patches=12, tried=60, chance=0.004)
    n_triples = math.comb(60, 3)
    tail = sum(math.comb(57, k) * 0.004**k * 0.996 ** (57 - k) for k in range(9, 58))
    assert 10**support.log10_nfa >= n_triples * tail


def test_more_support_of_the_same_matches_is_more_confidence():
    values = [Support(n, n, 100, 0.004).log10_nfa for n in range(6, 60)]
    assert (np.diff(values) < 0).all()
    assert Support(60, 60, 100, 0.004).confidence == pytest.approx(1.0)
    assert Support(3, 3, 100, 0.004).confidence == 0.0
    assert NO_SUPPORT.confidence == 0.0


def test_a_repeated_pattern_in_one_corner_is_no_support():
    """Thirty matches within one patch are one piece of evidence; spread over the image, thirty."""
    rng = np.random.default_rng(1)
    elsewhere = rng.uniform([0, 0], SIZE, (100, 2))
    corner = np.concatenate([rng.uniform(2, 18, (30, 2)), elsewhere])
    spread = np.concatenate([rng.uniform([0, 0], SIZE, (30, 2)), elsewhere])
    agree = np.arange(130) < 30
    in_corner = support_of(corner, np.arange(130), agree, SIZE, 4.0)
    over_all = support_of(spread, np.arange(130), agree, SIZE, 4.0)
    assert (in_corner.inliers, in_corner.patches) == (30, 1)
    assert in_corner.confidence == 0.0
    assert over_all.confidence > 0.999


def test_a_feature_counts_once_however_many_frames_it_is_matched_with():
    rng = np.random.default_rng(2)
    place = rng.uniform([0, 0], SIZE, (20, 2))
    own = np.tile(np.arange(20), 15)
    many = support_of(place[own], own, np.ones(300, bool), SIZE, 4.0)
    once = support_of(place, np.arange(20), np.ones(20, bool), SIZE, 4.0)
    assert many.inliers == once.inliers == 20
    assert many.patches == once.patches
    assert many.log10_nfa > once.log10_nfa  # fifteen attempts make luck likelier
