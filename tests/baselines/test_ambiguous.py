"""A photograph of what looks the same elsewhere has no pose; one of something unique has."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.references.photographs import Finder
from tests.support.bays import N_FEATURES, Bays


@pytest.fixture(autouse=True)
def all_frames_are_retrieved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Finder, "alike", lambda self, _, among: among)


def test_two_equal_places_are_ambiguous() -> None:
    bays = Bays(0)
    answer = bays.found()
    assert answer.support.confidence > 0.999
    assert answer.is_ambiguous
    assert answer.rival is not None
    places = (answer.world_from_cam, answer.rival.world_from_cam)
    np.testing.assert_allclose(sorted(map(bays.error_m, places)), [0.0, 1.95], atol=0.01)


def test_a_few_features_of_its_own_do_not_decide() -> None:
    assert Bays(N_FEATURES // 20).found().is_ambiguous


def test_enough_features_of_its_own_do() -> None:
    bays = Bays(N_FEATURES // 2)
    answer = bays.found()
    assert answer.support.inliers > 0.9 * N_FEATURES
    assert not answer.is_ambiguous
    assert bays.error_m(answer.world_from_cam) < 0.01
    assert answer.rival is not None
    assert abs(bays.error_m(answer.rival.world_from_cam) - 1.95) < 0.05


def test_one_of_many_repeats_is_found_by_the_features_that_only_it_has() -> None:
    """All matches together hold so many places that RANSAC rarely samples one of the right one."""
    bays = Bays(N_FEATURES // 2, n_bays=24, n_frames=2)
    answer = bays.found()
    assert bays.error_m(answer.world_from_cam) < 0.01
    assert not answer.is_ambiguous
    assert answer.rival is not None
    assert answer.rival.inliers < 0.6 * N_FEATURES
