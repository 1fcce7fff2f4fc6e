import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error
from synfeal.geometry.rotations import canonical_quat_wxyz
from synfeal.labels.noise import add_noise


def table_of(count, seed=0):
    rng = np.random.default_rng(seed)
    quat = canonical_quat_wxyz(Rotation.random(count, rng=rng).as_quat(scalar_first=True))
    return PoseTable(np.arange(count), np.arange(count) // 7, rng.normal(size=(count, 3)), quat)


def noise_of(clean, noisy):
    """Displacements in metres and turns as rotation vectors."""
    before, after = (Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (clean, noisy))
    return noisy.position_m - clean.position_m, (after * before.inv()).as_rotvec()


@pytest.mark.parametrize(("noise_m", "noise_deg"), [(0.1, 0.0), (0.0, 5.0), (0.3, 20.0)])
def test_every_pose_is_off_by_exactly_the_nominal_noise(noise_m, noise_deg):
    clean = table_of(200)
    noisy = add_noise(clean, noise_m, noise_deg, np.random.default_rng(1))
    position_m, orientation_rad = pose_error(noisy.world_from_cam, clean.world_from_cam)
    np.testing.assert_allclose(position_m, noise_m, atol=1e-12)
    np.testing.assert_allclose(np.degrees(orientation_rad), noise_deg, atol=1e-6)


def test_no_noise_is_bit_identical_part_by_part():
    clean = table_of(50)
    for noise_m, noise_deg in ((0.0, 0.0), (0.2, 0.0), (0.0, 10.0)):
        noisy = add_noise(clean, noise_m, noise_deg, np.random.default_rng(2))
        assert np.array_equal(noisy.position_m, clean.position_m) == (noise_m == 0)
        assert np.array_equal(noisy.quat_wxyz, clean.quat_wxyz) == (noise_deg == 0)
        np.testing.assert_array_equal(noisy.frame, clean.frame)
        np.testing.assert_array_equal(noisy.path, clean.path)


def test_no_noise_keeps_the_sign_of_zero():
    clean = table_of(20)
    clean.position_m[:] = -0.0
    noisy = add_noise(clean, 0.0, 5.0, np.random.default_rng(0))
    assert np.signbit(noisy.position_m).all()


def test_directions_are_uniform_on_the_sphere():
    count = 40_000
    clean = table_of(count)
    shift, turn = noise_of(clean, add_noise(clean, 1.0, 20.0, np.random.default_rng(3)))
    for vectors in (shift, turn / np.radians(20.0)):
        # A coordinate of a uniform unit vector is uniform on [-1, 1]: mean 0, variance 1/3.
        bound = 5 / np.sqrt(count)
        np.testing.assert_allclose(vectors.mean(axis=0), 0, atol=bound)
        np.testing.assert_allclose(vectors.T @ vectors / count, np.eye(3) / 3, atol=bound)
        below_half = (np.abs(vectors) < 0.5).mean(axis=0)
        np.testing.assert_allclose(below_half, 0.5, atol=bound)
    assert abs((shift * turn).sum(axis=1).mean()) < 5 / np.sqrt(count)


def test_seed_decides_and_both_parts_keep_their_directions():
    clean = table_of(30)
    one, same, other = (
        add_noise(clean, 0.1, 5.0, np.random.default_rng(seed)) for seed in (4, 4, 5)
    )
    np.testing.assert_array_equal(one.position_m, same.position_m)
    np.testing.assert_array_equal(one.quat_wxyz, same.quat_wxyz)
    assert not np.array_equal(one.position_m, other.position_m)
    alone = add_noise(clean, 0.1, 0.0, np.random.default_rng(4))
    np.testing.assert_array_equal(alone.position_m, one.position_m)


def test_input_is_left_alone_and_quaternions_stay_canonical():
    clean = table_of(100)
    before = clean.position_m.copy(), clean.quat_wxyz.copy()
    noisy = add_noise(clean, 0.5, 90.0, np.random.default_rng(6))
    np.testing.assert_array_equal(clean.position_m, before[0])
    np.testing.assert_array_equal(clean.quat_wxyz, before[1])
    assert (noisy.quat_wxyz[:, 0] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(noisy.quat_wxyz, axis=1), 1)


@pytest.mark.parametrize(("noise_m", "noise_deg"), [(-0.1, 0.0), (0.0, -5.0), (-0.1, -5.0)])
def test_negative_noise_is_refused(noise_m, noise_deg):
    with pytest.raises(ValueError, match=f"must not be negative: {noise_m} m, {noise_deg} deg$"):
        add_noise(table_of(2), noise_m, noise_deg, np.random.default_rng(0))
