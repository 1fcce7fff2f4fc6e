"""Properties of the errors of labels, and of noise added to them."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from baselines.groundtruth.label_error import absolute_errors, relative_error, share_within, spread
from synfeal.labels import add_noise
from tests.property_support import (
    directions,
    few,
    pose_of,
    poses,
    poses_near,
    random_poses,
    seeds,
    table_of,
    turn,
)


@few
@given(st.lists(poses, min_size=1, max_size=5), directions, st.floats(0, 5), st.floats(0, 180))
def test_labels_off_by_a_known_motion_have_that_error(listed, axis, off_m, off_deg):
    truth = np.array(listed)
    motion = pose_of(off_m * axis, turn(axis, np.radians(off_deg)))
    errors = absolute_errors(table_of(truth @ motion), table_of(truth))
    np.testing.assert_allclose(errors[0], off_m, atol=1e-9)
    np.testing.assert_allclose(errors[1], off_deg, atol=1e-5)
    assert share_within(errors, off_m + 1e-6, off_deg + 1e-4) == 1.0
    assert share_within(errors, off_m - 1e-6, off_deg + 1e-4) == 0.0
    assert share_within(errors, off_m + 1e-6, off_deg - 1e-4) == 0.0


@few
@given(st.lists(st.floats(0.0, 1e3), min_size=1, max_size=9), st.floats(0.1, 10.0))
def test_spread_grows_with_the_errors_and_lies_in_order(errors, factor):
    found, scaled = spread(np.array(errors)), spread(factor * np.array(errors))
    n = len(errors)
    middle = sorted(errors)[(n - 1) // 2] / 2 + sorted(errors)[n // 2] / 2
    assert found.median == pytest.approx(middle)
    assert found.rmse == pytest.approx((sum(e * e for e in errors) / n) ** 0.5)
    assert found.max == max(errors)
    assert found.rmse <= found.max * (1 + 1e-12)
    assert (scaled.median, scaled.rmse, scaled.max) == pytest.approx(
        (factor * found.median, factor * found.rmse, factor * found.max)
    )


@few
@given(seeds, st.integers(2, 8), st.integers(1, 3), poses_near, st.floats(0.0, 0.5))
def test_relative_error_of_a_step_repeated_does_not_depend_on_the_world(
    seed, count, frames, world, off_m
):
    truth = random_poses(seed, count)
    drift = pose_of([off_m, 0, 0], turn([0, 0, 1.0], 0.1))
    pair = table_of(drifted(truth, drift)), table_of(truth)
    found = relative_error([pair], frames)
    if count <= frames:
        assert found is None
        return
    moved = table_of(world @ drifted(truth, drift)), table_of(world @ truth)
    for other in (relative_error([moved], frames), relative_error([pair, pair], frames)):
        assert vars(other) == pytest.approx(vars(found), rel=1e-6, abs=1e-6)
    if frames == 1:
        assert found.rmse_m == pytest.approx(off_m, abs=1e-9)
        assert found.rmse_deg == pytest.approx(np.degrees(0.1), rel=1e-6)
        way_m = np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1).sum()
        assert found.per_metre_m == pytest.approx(off_m * (count - 1) / way_m, abs=1e-9)
        assert found.per_metre_deg == pytest.approx(np.degrees(0.1) * (count - 1) / way_m, rel=1e-6)


def drifted(truth, drift):
    """Labels whose every step is the true one followed by ``drift``."""
    found = [truth[0]]
    for before, after in pairwise(truth):
        found.append(found[-1] @ np.linalg.inv(before) @ after @ drift)
    return np.array(found)


@few
@given(seeds, st.floats(0.0, 10.0), st.floats(0.0, 180.0), st.lists(poses, min_size=1, max_size=5))
@example(0, 0.0, 0.0, [np.eye(4)])
@example(0, 0.0, 180.0, [np.eye(4)])
def test_noise_moves_and_turns_every_pose_by_its_size(seed, noise_m, noise_deg, clean):
    table = table_of(clean)
    noisy = add_noise(table, noise_m, noise_deg, np.random.default_rng(seed))
    moved_m = np.linalg.norm(noisy.position_m - table.position_m, axis=1)
    np.testing.assert_allclose(moved_m, noise_m, atol=1e-12)
    before, after = (Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (table, noisy))
    turned_deg = np.degrees((after * before.inv()).magnitude())
    np.testing.assert_allclose(turned_deg, noise_deg, atol=1e-5)
    assert (noisy.quat_wxyz[:, 0] >= 0).all()
    np.testing.assert_array_equal(noisy.frame, table.frame)
    np.testing.assert_array_equal(noisy.path, table.path)
