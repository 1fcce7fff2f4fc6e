"""Kinds of label error: their sizes and shapes, from closed forms."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from baselines.labels.drift import CORRELATED_FRAMES, drift_along_paths, walks
from baselines.labels.injected import (
    LABEL_ERRORS,
    add_noise,
    seed_names,
    with_error,
    write_erroneous_labels,
)
from baselines.labels.label_error import absolute_errors, share_within
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.geometry.poses import pose_error, position_error_m
from tests import ROOT
from tests.support.property_support import (
    directions,
    few,
    pose_of,
    poses,
    random_table,
    seeds,
    table_of,
    turn,
)


def noise_of(clean, noisy):
    """Displacements in metres and turns as rotation vectors."""
    before, after = (Rotation.from_quat(t.quat_wxyz, scalar_first=True) for t in (clean, noisy))
    return noisy.position_m - clean.position_m, (after * before.inv()).as_rotvec()


def test_no_noise_changes_no_bit_and_the_seed_decides_part_by_part():
    clean = random_table(50, 0, 7)
    for noise_m, noise_deg in ((0.0, 0.0), (0.2, 0.0), (0.0, 10.0)):
        noisy = add_noise(clean, noise_m, noise_deg, np.random.default_rng(2))
        assert np.array_equal(noisy.position_m, clean.position_m) == (noise_m == 0)
        assert np.array_equal(noisy.quat_wxyz, clean.quat_wxyz) == (noise_deg == 0)
        np.testing.assert_array_equal(noisy.frame, clean.frame)
        np.testing.assert_array_equal(noisy.path, clean.path)
    one, other = (add_noise(clean, 0.1, 5.0, np.random.default_rng(seed)) for seed in (4, 5))
    assert not np.array_equal(one.position_m, other.position_m)
    alone = add_noise(clean, 0.1, 0.0, np.random.default_rng(4))
    np.testing.assert_array_equal(alone.position_m, one.position_m)


def test_directions_are_uniform_on_the_sphere():
    count = 40_000
    clean = random_table(count, 0, 7)
    shift, turn = noise_of(clean, add_noise(clean, 1.0, 20.0, np.random.default_rng(3)))
    for vectors in (shift, turn / np.radians(20.0)):
        # A coordinate of a uniform unit vector is uniform on [-1, 1]: mean 0, variance 1/3.
        bound = 5 / np.sqrt(count)
        np.testing.assert_allclose(vectors.mean(axis=0), 0, atol=bound)
        np.testing.assert_allclose(vectors.T @ vectors / count, np.eye(3) / 3, atol=bound)
        below_half = (np.abs(vectors) < 0.5).mean(axis=0)
        np.testing.assert_allclose(below_half, 0.5, atol=bound)
    assert abs((shift * turn).sum(axis=1).mean()) < 5 / np.sqrt(count)


@pytest.mark.parametrize(("noise_m", "noise_deg"), [(-0.1, 0.0), (0.0, -0.5), (-0.1, -5.0)])
def test_negative_noise_is_refused(noise_m, noise_deg):
    with pytest.raises(ValueError, match=f"must not be negative: {noise_m} m, {noise_deg} deg$"):
        add_noise(random_table(2, 0, 7), noise_m, noise_deg, np.random.default_rng(0))


SIZES = [(0.1, 5.0), (0.3, 20.0)]


def erroneous(kind, table, train, noise_m=0.3, noise_deg=20.0, seed=1):
    noise_deg = 0.0 if kind == "scale" else noise_deg
    return with_error(kind, table, train, noise_m, noise_deg, np.random.default_rng(seed))


@pytest.mark.parametrize("kind", LABEL_ERRORS)
@pytest.mark.parametrize(("noise_m", "noise_deg"), SIZES)
def test_every_kind_has_the_same_median_error_on_the_training_poses(kind, noise_m, noise_deg):
    train = random_table(501, 0, 7)
    found = erroneous(kind, train, train, noise_m, noise_deg)
    position_m, orientation_rad = pose_error(found.world_from_cam, train.world_from_cam)
    assert np.median(position_m) == pytest.approx(noise_m, rel=1e-9)
    expected = 0.0 if kind == "scale" else noise_deg
    assert np.degrees(np.median(orientation_rad)) == pytest.approx(expected, abs=1e-6)
    np.testing.assert_array_equal(found.frame, train.frame)
    np.testing.assert_array_equal(found.path, train.path)
    np.testing.assert_allclose(np.linalg.norm(found.quat_wxyz, axis=1), 1)


def test_an_offset_is_one_rigid_error_per_path_and_another_for_the_next():
    clean = random_table(70, 0, 7)  # seven frames to a path
    shift, turn = noise_of(clean, erroneous("offset", clean, clean))
    for vectors, size in ((shift, 0.3), (turn, np.radians(20))):
        by_path = vectors.reshape(10, 7, 3)
        np.testing.assert_allclose(by_path, by_path[:, :1].repeat(7, axis=1), atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), size)
        assert position_error_m(by_path[1:, 0], by_path[:-1, 0]).min() > 1e-3


def test_a_scale_multiplies_all_distances_from_the_first_camera_on():
    train, test = random_table(101, 0, 7), random_table(40, 2, 7)
    median_m = np.median(np.linalg.norm(train.position_m - train.position_m[0], axis=1))
    found = [erroneous("scale", table, train).position_m for table in (train, test)]
    np.testing.assert_array_equal(found[0][0], train.position_m[0])
    for labels, truth in zip(found, (train, test), strict=True):
        distances = [position_error_m(p[1:], p[:-1]) for p in (labels, truth.position_m)]
        np.testing.assert_allclose(distances[0], (1 + 0.3 / median_m) * distances[1])
    np.testing.assert_array_equal(erroneous("scale", test, train).quat_wxyz, test.quat_wxyz)


def test_a_bend_belongs_to_space_and_is_smooth():
    train = random_table(400, 0, 7)
    low, high = train.position_m.min(axis=0), train.position_m.max(axis=0)
    steps = np.linspace(0, 1, 2001)[:, None]
    line = low + steps * (high - low)
    still = np.tile([1.0, 0, 0, 0], (len(line), 1))
    along = PoseTable(np.arange(len(line)), np.zeros(len(line), int), line, still)
    shift, turn = noise_of(along, erroneous("bend", along, train))
    # A sine of amplitude a and wavelength L changes by no more than 2 pi a / L per metre; the
    # median length of the vectors is that of three sines, so a is below the median times 2.
    travelled = np.linalg.norm(line[1] - line[0])
    steepest = 2 * np.pi / (high - low).max() * np.sqrt(3)
    for vectors, median in ((shift, 0.3), (turn, np.radians(20))):
        change = np.linalg.norm(np.diff(vectors, axis=0), axis=1)
        assert change.max() < steepest * 2 * median * travelled
        assert np.ptp(vectors, axis=0).max() > median  # and yet it bends
    # The same place has the same error, whichever split and path it is in.
    again = PoseTable(train.frame, train.path[::-1], train.position_m, train.quat_wxyz)
    one, two = (erroneous("bend", table, train).position_m for table in (train, again))
    np.testing.assert_array_equal(one, two)


def test_errors_of_space_are_seeded_alike_and_what_stands_still_is_not_scaled():
    alike = [kind for kind in LABEL_ERRORS if seed_names(kind, "train") == seed_names(kind, "test")]
    assert sorted(alike) == ["bend", "scale"]
    assert [name for name, kind in LABEL_ERRORS.items() if not kind.turns] == ["scale"]
    table = replace(random_table(3, 0, 7), position_m=np.ones((3, 3)))
    np.testing.assert_array_equal(erroneous("scale", table, table).position_m, table.position_m)


def test_a_drift_is_stationary_along_each_path_and_of_no_other():
    n_paths, n_frames = 2000, 60
    path = np.repeat(np.arange(n_paths), n_frames)
    walk = walks(path, np.random.default_rng(0)).reshape(n_paths, n_frames, 3)
    bound = 5 / np.sqrt(3 * n_paths)  # standard errors of a mean over paths and components
    for place in (0, 1, 30, 59):
        at = walk[:, place]
        np.testing.assert_allclose(at.mean(), 0, atol=bound)
        np.testing.assert_allclose(at.T @ at / n_paths, np.eye(3), atol=np.sqrt(6) * bound)
    # Ornstein and Uhlenbeck: the correlation after k frames is exp(-k / length).
    for first, lag in ((0, 1), (30, 1), (0, 25), (20, 25), (0, 59)):
        found = (walk[:, first] * walk[:, first + lag]).mean()
        assert found == pytest.approx(np.exp(-lag / 150), abs=np.sqrt(2) * bound)
    moved = walk[:, 1:] - walk[:, :-1]
    assert (moved**2).mean() == pytest.approx(2 * (1 - np.exp(-1 / 150)), rel=0.02)
    # The next path begins anew.
    between = (walk[:-1, -1] * walk[1:, 0]).mean(), (walk[:-1, 0] * walk[1:, 0]).mean()
    np.testing.assert_allclose(between, 0, atol=bound)
    # Shift and turn of a frame are drawn apart.
    clean = random_table(6000, 0, 60)
    shift, turn = noise_of(clean, erroneous("drift", clean, clean))
    assert abs(np.corrcoef(shift.ravel(), turn.ravel())[0, 1]) < 5 / np.sqrt(3 * 100)


def test_a_drift_goes_on_where_frames_of_paths_alternate():
    in_turn = np.arange(4000) % 2
    walk = walks(in_turn, np.random.default_rng(3)).reshape(2000, 2, 3)
    steps = walk[1:] - walk[:-1]
    # A step has a variance of 2 (1 - exp(-1 / 150)), that between two paths one of 2.
    assert (steps**2).mean() == pytest.approx(2 * (1 - np.exp(-1 / 150)), rel=0.1)


def test_a_drift_of_zero_changes_no_bit():
    clean = random_table(50, 0, 7)
    for noise_m, noise_deg in ((0.0, 0.0), (0.2, 0.0), (0.0, 10.0)):
        found = drift_along_paths(clean, clean, noise_m, noise_deg, np.random.default_rng(2))
        assert (found.position_m.tobytes() == clean.position_m.tobytes()) == (noise_m == 0)
        assert (found.quat_wxyz.tobytes() == clean.quat_wxyz.tobytes()) == (noise_deg == 0)


def test_the_size_of_a_drift_is_exact_in_the_test_split_too():
    train, test = random_table(301, 0, 7), random_table(40, 2, 7)
    found = erroneous("drift", test, train, 0.057, 1.3)
    position_m, orientation_rad = pose_error(found.world_from_cam, test.world_from_cam)
    assert np.median(position_m) == pytest.approx(0.057, rel=1e-9)
    assert np.degrees(np.median(orientation_rad)) == pytest.approx(1.3, rel=1e-6)


def test_the_design_has_the_drift_that_real_label_sets_differ_by():
    measured = pd.read_csv(ROOT / "results/benchmarks/label_differences.csv")
    scenes = measured[measured.removed == "worlds and cameras"]
    assert len(scenes) == 7
    middle = scenes.median(numeric_only=True)
    design = pd.read_csv(ROOT / "config/experiments.csv").query("table == 'table6_label_errors'")
    for kind in ("drift", "noise"):
        smallest = design[design.labels == kind].iloc[0]
        assert smallest.noise_m == round(middle.position_m, 3)
        assert smallest.noise_deg == round(middle.orientation_deg, 1)
    for lag in (1, 25):
        ours = np.exp(-lag / CORRELATED_FRAMES)
        both = [f"{part}_correlation_{lag}" for part in ("position", "orientation")]
        assert middle[both].min() < ours < middle[both].max()


@pytest.mark.parametrize("kind", LABEL_ERRORS)
def test_two_sizes_of_a_kind_differ_in_size_alone(kind):
    train = random_table(201, 0, 7)
    small, large = (noise_of(train, erroneous(kind, train, train, *size)) for size in SIZES)
    np.testing.assert_allclose(3 * small[0], large[0], atol=1e-9)
    if kind != "scale":
        np.testing.assert_allclose(4 * small[1], large[1], atol=1e-9)


@pytest.mark.parametrize("kind", LABEL_ERRORS)
def test_the_published_codes_dose_is_longer_by_the_root_of_three(kind, tmp_path):
    train = random_table(201, 0, 7)
    write_pose_table(tmp_path / "true.csv", train)
    found = {}
    for dose in ("text", "code"):
        write_erroneous_labels(
            error_kind=kind,
            truth=tmp_path / "true.csv",
            train=tmp_path / "true.csv",
            noise_m=0.3,
            noise_deg=0.0 if kind == "scale" else 20.0,
            dose=dose,
            seed=1,
            out_labels=tmp_path / "labels.csv",
        )
        found[dose] = noise_of(train, read_pose_table(tmp_path / "labels.csv"))
    median_m = {d: np.median(np.linalg.norm(shift, axis=1)) for d, (shift, _) in found.items()}
    assert median_m == pytest.approx({"text": 0.3, "code": 0.3 * np.sqrt(3)}, rel=1e-6)
    # The root mean square over the axes is what the code calls the size.
    if kind in ("noise", "offset"):
        assert np.sqrt((found["code"][0] ** 2).mean()) == pytest.approx(0.3, rel=1e-6)
    np.testing.assert_array_equal(found["code"][1], found["text"][1])
    np.testing.assert_allclose(found["code"][0], np.sqrt(3) * found["text"][0], atol=1e-6)


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
