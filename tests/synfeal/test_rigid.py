"""One bound for rigid motions: what text of few digits delivers is within, real defects are not."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from synfeal.errors import InputError
from synfeal.geometry.rigid import RIGID_BOUND, is_rigid, refuse_non_rigid, rigid_defects


def poses(count):
    found = np.tile(np.eye(4), (count, 1, 1))
    found[:, :3, :3] = Rotation.random(count, random_state=0).as_matrix()
    found[:, :3, 3] = np.random.default_rng(0).normal(size=(count, 3))
    return found


def test_rotations_written_with_three_decimals_are_rigid_and_with_two_seldom_are():
    three, two = (rigid_defects(poses(20_000).round(digits)).worst for digits in (3, 2))
    assert three.max() <= RIGID_BOUND
    # The bound is no wider than it must be: of two decimals, most are refused.
    assert np.mean(two <= RIGID_BOUND) < 0.05


def test_rounding_moves_the_determinant_most_where_all_entries_are_equal_in_size():
    """Half a digit for each entry, whose sizes add up to 5, of at most 3 sqrt(3)."""
    rows = np.array([[2.0, -1, -2], [2, 2, 1], [1, -2, 2]]) / 3  # no entry is small
    worst = np.eye(4)[None].copy()
    worst[0, :3, :3] = rows + 0.5e-3 * np.sign(rows)
    assert rigid_defects(worst).determinant[0] == pytest.approx(0.5e-3 * 5, rel=0.01)
    assert is_rigid(worst[0])


def test_defects_are_those_of_the_definition():
    scaled, slanted, mirrored = poses(3)
    scaled[:3, :3] *= 1.01
    slanted[3] = [0.1, 0, 0, 1]
    mirrored[:3, 0] *= -1
    found = rigid_defects([scaled, slanted, mirrored])
    assert found.orthonormal == pytest.approx([0.0201, 0, 0], abs=1e-9)
    assert found.determinant == pytest.approx([1.01**3 - 1, 0, 2], abs=1e-9)
    assert found.last_row == pytest.approx([0, 0.1, 0], abs=1e-9)


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1.003, 1.003, 1.003, 1.0]),
        np.diag([-1.0, 1, 1, 1]),
        np.zeros((4, 4)),
        np.full((4, 4), np.nan),
        np.full((4, 4), 1e300),
        np.eye(3),
    ],
)
def test_others_are_refused_in_one_line(matrix):
    assert not is_rigid(matrix)
    with pytest.raises(InputError, match=r"^poses\.txt: is not a rigid pose; its upper left 3x3"):
        refuse_non_rigid(matrix, "poses.txt")
