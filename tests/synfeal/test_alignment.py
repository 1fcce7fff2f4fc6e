"""Similarity transforms between point sets."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from synfeal.geometry.poses import umeyama_sim3
from synfeal.geometry.rotations import matrix_from_quat_wxyz
from tests.support import property_support as drawn

pytestmark = pytest.mark.portable

AXIS = np.array([2.0, -3.0, 6.0]) / 7.0


def test_umeyama_agrees_with_scipy_on_noisy_and_on_planar_points():
    rng = np.random.default_rng(1)
    for flat in (1.0, 0.0):
        source = rng.normal(size=(30, 3)) * [1, 1, flat]
        target = source @ matrix_from_quat_wxyz(drawn.turn(AXIS, 1.3)).T + 0.05 * rng.normal(
            size=(30, 3)
        )
        _, rotation, _ = umeyama_sim3(source, target)
        centred = source - source.mean(0), target - target.mean(0)
        expected = Rotation.align_vectors(centred[1], centred[0])[0].as_matrix()
        np.testing.assert_allclose(rotation, expected, atol=1e-6)


def test_umeyama_takes_points_that_are_barely_apart_and_far_away():
    # 1 mm aside of a line of 1 m, 100 km from the origin: little, but far above rounding.
    source = np.array([[1e5, 0, 0], [1e5 + 0.5, 1e-3, 0], [1e5 + 1.0, 0, 0]])
    np.testing.assert_allclose(umeyama_sim3(source, source)[1], np.eye(3), atol=1e-4)
    thin = np.array([[0.0, 0, 0], [0.5, 2e-9, 0], [1.0, 0, 0]])  # spread 2 : 1e9
    np.testing.assert_allclose(umeyama_sim3(thin, thin)[1], np.eye(3), atol=1e-6)
    for scale in (1e-3, 1.0, 1e3):  # what counts is the spread aside against that along
        with pytest.raises(ValueError, match="collinear"):
            umeyama_sim3(scale * thin * [1, 0.1, 1], thin)


LINE = np.outer(np.arange(5.0), [1, 2, 3])
FAR_LINE = np.linspace(0, 0.1, 20)[:, None] * [0.3, -0.5, 0.81] + [1e6, -7e5, 3e5]


@pytest.mark.parametrize(
    ("source", "target", "words"),
    [
        (np.zeros((4, 3)), np.zeros((5, 3)), r"got \(4, 3\) and \(5, 3\)"),
        (np.zeros(9), np.zeros(9), r"got \(9,\) and \(9,\)"),
        (np.eye(3)[:2], np.eye(3)[:2], "N >= 3"),
        (LINE, LINE, "^the points are collinear: the rotation about their line is undetermined$"),
        (np.random.default_rng(0).normal(size=LINE.shape), LINE, "collinear"),
        (np.zeros((4, 3)), np.zeros((4, 3)), "collinear"),  # all in one place
        (FAR_LINE, FAR_LINE, "collinear"),  # up to rounding
    ],
)
def test_umeyama_refuses_other_shapes_and_what_leaves_the_rotation_free(source, target, words):
    with pytest.raises(ValueError, match=words):
        umeyama_sim3(source, target)


@drawn.few
@given(drawn.seeds, st.integers(3, 12), drawn.quats, drawn.positions, st.floats(0.1, 10.0))
def test_umeyama_finds_the_similarity_and_its_inverse(seed, count, quat, offset, scale):
    source = np.random.default_rng(seed).uniform(-1, 1, (count, 3))
    assume(np.linalg.svd(source - source.mean(0), compute_uv=False)[1] > 0.1)
    target = scale * source @ drawn.rotation_of(quat).T + offset
    found = umeyama_sim3(source, target)
    np.testing.assert_allclose(found[0], scale, rtol=1e-9)
    np.testing.assert_allclose(found[1], drawn.rotation_of(quat), atol=1e-9)
    np.testing.assert_allclose(found[2], offset, atol=1e-9)
    back = umeyama_sim3(target, source)
    np.testing.assert_allclose(back[0], 1 / scale, rtol=1e-9)
    np.testing.assert_allclose(back[1], drawn.rotation_of(quat).T, atol=1e-9)


@drawn.few
@given(drawn.seeds, drawn.directions, st.floats(1e-4, 1e-2), drawn.vectors(1e-2))
def test_umeyama_leaves_no_better_similarity_beside_its_own(seed, axis, angle, step):
    rng = np.random.default_rng(seed)
    source, target = rng.normal(size=(2, 8, 3))
    scale, rotation, offset = umeyama_sim3(source, target)

    def loss(s, r, t):
        return np.sum((target - (s * source @ r.T + t)) ** 2)

    least = loss(scale, rotation, offset)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, rtol=1e-12)
    assert loss(scale, drawn.rotation_of(drawn.turn(axis, angle)) @ rotation, offset) > least
    assert loss(scale * (1 + angle), rotation, offset) > least
    assert loss(scale, rotation, offset + step) >= least
