"""Repeats of a place are the motions that it was built with, and lead to where retrieval does not.

Places are bays in a row, 1.95 m apart, so a look-alike of a frame is a shift by whole bays.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from baselines.references.mapped import StructureMap
from baselines.references.photographs import Finder
from baselines.references.repeats import FEWEST, PosedFeatures, Repeats, find_repeats
from tests.support.bays import N_FEATURES, REPEAT_M, Bays

N_BAYS, N_FRAMES = 3, 5


def searched(place: StructureMap) -> Repeats:
    return find_repeats(
        PosedFeatures(
            place.world_from_cam, place.camera, place.features, place.point_m, place.vectors
        )
    )


@pytest.fixture(scope="module")
def bays() -> Bays:
    return Bays(N_FEATURES // 2, n_bays=N_BAYS, n_frames=N_FRAMES)


@pytest.fixture(scope="module")
def repeats(bays) -> Repeats:
    return searched(bays.map)


def test_look_alikes_are_shifts_by_whole_bays(repeats):
    bay = repeats.frame // N_FRAMES
    shift = repeats.elsewhere_from_here[:, :3, 3] / REPEAT_M[0]
    steps = np.round(shift[:, 0])
    np.testing.assert_allclose(shift, steps[:, None] * [1, 0, 0], atol=0.01)
    np.testing.assert_allclose(
        repeats.elsewhere_from_here[:, :3, :3],
        np.broadcast_to(np.eye(3), (len(bay), 3, 3)),
        atol=0.01,
    )
    assert ((bay + steps >= 0) & (bay + steps < N_BAYS) & (steps != 0)).all()
    found = {(int(here), int(step)) for here, step in zip(bay, steps, strict=True)}
    assert found == {(0, 1), (0, 2), (1, -1), (1, 1), (2, -2), (2, -1)}


def test_they_explain_what_is_common_to_both_bays(repeats):
    with_last = (repeats.frame // N_FRAMES == N_BAYS - 1) | (
        np.abs(repeats.elsewhere_from_here[:, 0, 3]) > 1.5 * REPEAT_M[0]
    )
    assert (repeats.inliers[with_last] <= N_FEATURES // 2).all()
    assert (repeats.inliers[with_last] > 0.9 * N_FEATURES // 2).all()


def test_frames_that_see_the_same_things_are_no_repeats():
    one_bay = Bays(0, n_bays=1, n_frames=6)
    poses = one_bay.map.world_from_cam.copy()
    features = one_bay.map.features
    # Steps of a metre to the side: the same points, seen from poses that are not near each other.
    step_m = np.arange(len(poses))[:, None] * np.array([0.7, 0.0, 0.0])
    poses[:, :3, 3] += step_m
    in_cam = features.point_m - step_m[features.frame]
    moved = replace(features, slope=in_cam[:, :2] / in_cam[:, 2:], depth_m=in_cam[:, 2])
    place = replace(one_bay.map, world_from_cam=poses, features=moved)
    assert len(searched(place).frame) == 0


def test_places_with_nothing_in_common_have_none():
    other = Bays(N_FEATURES - FEWEST // 2, n_bays=2, n_frames=2)
    assert len(searched(other.map).frame) == 0


@pytest.fixture
def only_the_first_bay_is_retrieved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Finder, "alike", lambda self, _, among: among[:N_FRAMES])


@pytest.mark.usefixtures("only_the_first_bay_is_retrieved")
def test_the_right_bay_is_found_where_retrieval_names_a_wrong_one(bays, repeats):
    photograph = bays.seen_from_last()
    without = Finder(bays.map).find(photograph)
    assert bays.error_m(without.world_from_cam) == pytest.approx(2 * REPEAT_M[0], abs=0.05)
    found = Finder(replace(bays.map, repeats=repeats)).find(photograph)
    assert bays.error_m(found.world_from_cam) < 0.01
    assert not found.is_ambiguous
    assert found.rival is not None
    assert found.rival.share == pytest.approx(0.5, abs=0.05)


@pytest.mark.usefixtures("only_the_first_bay_is_retrieved")
def test_what_the_other_bays_show_too_is_ambiguous():
    alike = Bays(0, n_bays=N_BAYS, n_frames=N_FRAMES)
    photograph = alike.seen_from_last()
    assert not Finder(alike.map).find(photograph).is_ambiguous
    assert Finder(replace(alike.map, repeats=searched(alike.map))).find(photograph).is_ambiguous


def test_a_pose_may_be_mistaken_for_those_that_the_frames_near_it_look_like(bays, repeats):
    first, last = bays.map.world_from_cam[0], bays.map.world_from_cam[-1]
    for pose, signs in ((first, 1.0), (last, -1.0)):
        shift_m = repeats.look_alikes(pose, bays.map.world_from_cam)[:, :3, 3] - pose[:3, 3]
        steps = np.unique(np.round(shift_m[:, 0] / REPEAT_M[0]) * signs)
        np.testing.assert_array_equal(steps, [1.0, 2.0])


def test_arrays_of_another_map_do_not_fit(repeats):
    assert repeats.fits(N_BAYS * N_FRAMES)
    assert not repeats.fits(int(repeats.frame.max()))
    assert not replace(repeats, inliers=repeats.inliers[1:]).fits(N_BAYS * N_FRAMES)
