"""Errors after alignment where they are known: straight paths, scaled, turned and noisy labels."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.labels.alignment import aligned_errors, fit
from baselines.labels.label_error import absolute_errors
from synfeal.geometry.poses import pose_matrix, umeyama_sim3
from tests.support.property_support import table_of

N_FRAMES = 101
TURN = Rotation.from_euler("xyz", [3, -2, 5], degrees=True).as_matrix()
SHIFT_M = np.array([0.2, -0.1, 0.05])


def line(step_m=0.03):
    """A straight path whose camera turns; its centres leave the rotation about it free."""
    time = np.arange(N_FRAMES)
    rotation = Rotation.from_euler("zy", np.column_stack([0.5 * time, 0.1 * time]), degrees=True)
    return pose_matrix(rotation.as_matrix(), step_m * time[:, None] * [0.8, 0.6, 0.0])


def moved(poses, scale=1.0):
    """The poses scaled, then turned and shifted as one."""
    centre_m = scale * poses[:, :3, 3] @ TURN.T + SHIFT_M
    return pose_matrix(TURN @ poses[:, :3, :3], centre_m)


def test_a_straight_path_that_was_turned_and_shifted_has_no_error_left():
    truth = table_of(line())
    pair = table_of(moved(line())), truth
    assert absolute_errors(*pair)[1] == pytest.approx(
        np.degrees(Rotation.from_matrix(TURN).magnitude())
    )
    for alignment in ("rigid", "similarity"):
        position_m, orientation_deg = aligned_errors([pair], alignment)
        np.testing.assert_allclose(position_m, 0, atol=1e-12)
        np.testing.assert_allclose(orientation_deg, 0, atol=1e-5)
    with pytest.raises(ValueError, match="collinear"):
        umeyama_sim3(moved(line())[:, :3, 3], line()[:, :3, 3])


def test_a_wrong_scale_is_left_by_the_rigid_and_taken_by_the_similarity_alignment():
    """2 % of the distance to the middle of the path, which is where both are laid together."""
    pair = table_of(moved(line(), 1.02)), table_of(line())
    from_middle_m = np.abs(np.arange(N_FRAMES) - (N_FRAMES - 1) / 2) * 0.03
    np.testing.assert_allclose(aligned_errors([pair], "rigid")[0], 0.02 * from_middle_m, atol=1e-12)
    np.testing.assert_allclose(aligned_errors([pair], "similarity")[0], 0, atol=1e-12)
    assert fit(*(table.world_from_cam for table in pair), "similarity").scale == pytest.approx(
        1 / 1.02
    )


def test_given_the_rotation_scale_and_shift_are_those_of_least_squares():
    rng = np.random.default_rng(0)
    truth, labels = line(), moved(line(), 1.1)
    labels[:, :3, 3] += rng.normal(0, 0.05, (N_FRAMES, 3))
    found = fit(labels, truth, "similarity")

    def cost(scale, shift_m):
        centre_m = scale * labels[:, :3, 3] @ found.rotation.T + shift_m
        return np.square(centre_m - truth[:, :3, 3]).sum()

    least = cost(found.scale, found.shift_m)
    for scale, shift_m in (
        (1e-3, np.zeros(3)),
        (-1e-3, np.zeros(3)),
        *((0, 1e-3 * e) for e in np.eye(3)),
    ):
        assert cost(found.scale + scale, found.shift_m + shift_m) > least


def test_each_sequence_is_aligned_on_its_own():
    truth = table_of(line())
    pairs = [(table_of(moved(line())), truth), (table_of(moved(moved(line()))), truth)]
    position_m, _ = aligned_errors(pairs, "rigid")
    assert len(position_m) == 2 * N_FRAMES
    np.testing.assert_allclose(position_m, 0, atol=1e-12)


def test_labels_that_stand_still_keep_their_scale():
    still = np.repeat(line()[:1], 5, axis=0)
    assert fit(still, line()[:5], "similarity").scale == 1.0


def test_a_reflection_is_no_motion():
    rng = np.random.default_rng(0)
    truth = line()
    truth[:, :3, 3] = rng.normal(size=(N_FRAMES, 3))
    mirrored = truth.copy()
    mirrored[:, :3, 3] *= -1.0  # in a point, with the cameras as they were
    assert fit(mirrored, truth, "similarity").scale == 0.0
    position_m, _ = aligned_errors([(table_of(mirrored), table_of(truth))], "similarity")
    expected_m = np.linalg.norm(truth[:, :3, 3] - truth[:, :3, 3].mean(axis=0), axis=1)
    np.testing.assert_allclose(position_m, expected_m, rtol=1e-9)
