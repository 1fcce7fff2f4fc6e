"""Reference methods against closed forms, naive twins, and rooms whose poses are known."""

import json
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from baselines.config.references import ReferencesConfig
from baselines.references import interpolated
from baselines.references.arrays import most_alike
from baselines.references.correspondences import (
    Tracks,
    join_matches,
    match_test_frames,
    mutual_matches,
)
from baselines.references.descriptors import Vlad, dense_sift, residuals, thumbnails
from baselines.references.evidence import Evidence
from baselines.references.features import Features, write_features
from baselines.references.interpolated import RIDGE, affine_weights, by_interpolation, combined
from baselines.references.registry import in_group
from baselines.references.retrieval import METRES_PER_RADIAN, nearest_rows
from baselines.references.run import answer_and_score
from baselines.references.structure import on_depth, triangulate
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.geometry.poses import (
    inverse,
    pose_error,
    pose_from_quat,
    pose_matrix,
    position_error_m,
)
from synfeal.geometry.rotations import rotation_angle_rad, rotation_from_rpy
from synfeal.records.files import read_json, write_json
from tests.support.property_support import random_table, table_of
from tests.support.room_scene import CAMERA, pose_at, write_room

ROOT = Path(__file__).parents[2]
CFG = ReferencesConfig(max_features=400)


def frames(count, side=32, seed=0):
    return np.random.default_rng(seed).integers(0, 200, (count, side, side, 3), dtype=np.uint8)


@pytest.mark.parametrize("turn", range(4))
def test_dense_sift_of_a_ramp_has_one_direction(turn):
    ramp = np.rot90(np.broadcast_to(4 * np.arange(32), (32, 32)), turn)
    picture = np.repeat(ramp[None, ..., None], 3, axis=3).astype(np.uint8)
    inner = dense_sift(picture)[0].reshape(-1, 16, 8)
    inner = inner[len(inner) // 2]  # a descriptor that touches no border
    direction = [0, 6, 4, 2][turn]  # a turn to the left points the gradient up, against y
    expected = torch.zeros(16, 8)
    expected[:, direction] = 0.25  # sixteen equal cells, roots of an L1 norm of 1
    torch.testing.assert_close(inner, expected, atol=1e-5, rtol=0)


def test_vlad_is_the_sum_of_residuals_from_the_nearest_word():
    words = torch.tensor([[0.0, 0.0], [10.0, 0.0]])
    found = residuals(np.array([[[1.0, 0.0], [0.0, 2.0], [9.0, 0.0]]], np.float32), words)
    # Word 0: (1, 0) + (0, 2), word 1: (-1, 0); each at length 1, then both together.
    expected = np.array([1, 2, -np.sqrt(5), 0]) / np.sqrt(5) / np.sqrt(2)
    np.testing.assert_allclose(found[0], expected, rtol=1e-6)


@pytest.mark.parametrize("method", ["thumbnail", "vlad"])
def test_an_image_is_found_again_darker_and_shifted_in_tone(method):
    train = frames(20)
    describe = thumbnails if method == "thumbnail" else Vlad.learn(train, 3).describe
    queries = (train[[4, 17, 9]] * 0.7 + 20).astype(np.uint8)
    vectors = describe(train)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, rtol=1e-5)
    assert most_alike(vectors, describe(queries), 1)[:, 0].tolist() == [4, 17, 9]


def test_the_most_alike_and_the_nearest_are_those_of_a_full_search():
    rng = np.random.default_rng(1)
    train, test = (rng.standard_normal((n, 6)).astype(np.float32) for n in (30, 11))
    expected = np.argsort(-(test @ train.T), axis=1)
    assert (most_alike(train, test, 5) == expected[:, :5]).all()
    assert most_alike(train, test, 99).shape == (11, 30)
    train, test = random_table(40, 0, 3), random_table(9, 1, 3)
    cost = position_error_m(test.position_m[:, None], train.position_m)
    angles = rotation_angle_rad(test.quat_wxyz[:, None], train.quat_wxyz[None])
    expected = np.argmin(cost + METRES_PER_RADIAN * angles, axis=1)
    assert (nearest_rows(train, test) == expected).all()
    # Nor does it matter how far from the origin they are.
    far_m = np.array([5e6, -4e6, 300.0])
    moved = [replace(table, position_m=table.position_m + far_m) for table in (train, test)]
    assert (nearest_rows(*moved) == expected).all()


def test_matches_are_those_of_a_naive_search():
    rng = np.random.default_rng(2)
    own = np.abs(rng.standard_normal((30, 8))).astype(np.float32)
    other = np.concatenate([own[:20] + 0.05, np.abs(rng.standard_normal((15, 8)))]).astype("f4")
    own, other = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (own, other))
    expected = []
    for i, vector in enumerate(own):
        distance = np.linalg.norm(other - vector, axis=1)
        j, second = np.argsort(distance)[:2]
        back = np.argmin(np.linalg.norm(own - other[j], axis=1))
        if distance[j] < 0.8 * distance[second] and back == i:
            expected.append((i, j))
    assert list(zip(*mutual_matches(own, other), strict=True)) == expected
    assert expected
    assert [len(part) for part in mutual_matches(own[:0], other)] == [0, 0]
    assert [len(part) for part in mutual_matches(own, other[:1])] == [0, 0]


TRAIN = [pose_at([-2 + 0.3 * i, -0.2 + 0.05 * i, 1.3], yaw_deg=3 * i - 9) for i in range(7)]
TEST = [pose_at([-1.85, -0.2, 1.25], yaw_deg=-6), pose_at([-0.95, 0.1, 1.4], yaw_deg=5)]


def evidence_of(labels, truth):
    files = {split: labels / f"{split}.csv" for split in ("train", "test")}
    files |= {f"{split}_truth": truth / f"{split}.csv" for split in ("train", "test")}
    evidence = Evidence(files, CAMERA, 0)
    evidence.__dict__["query_costs"] = defaultdict(float)  # of features and matches made here
    return evidence


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """Features of a furnished room's frames, matched; labels are the true poses."""
    folder = tmp_path_factory.mktemp("room")
    splits = {}
    for split, poses in (("train", TRAIN), ("test", TEST)):
        write_room(folder / split, poses)
        found = folder / f"{split}.npz"
        write_features([folder / split], split, len(poses), CAMERA, CFG, found)
        splits[split] = Features.read(found)
        write_pose_table(folder / "labels" / f"{split}.csv", table_of(poses))
    evidence = evidence_of(folder / "labels", folder / "labels")
    near = np.tile(np.arange(len(TRAIN)), (len(TEST), 1))
    evidence.__dict__["correspondences"] = match_test_frames(*splits.values(), near)
    return evidence


def test_structure_finds_poses_that_move_with_the_labels(room):
    position_m, angle_rad = pose_error(on_depth(room), np.stack(TEST))
    assert position_m.max() < 0.02  # the depth is rounded to millimetres, features to half a pixel
    assert np.degrees(angle_rad).max() < 0.5
    # Labels in another world give the same answers in that world: nothing else is looked at.
    moved = pose_matrix(rotation_from_rpy([0.3, -0.2, 1.9]), [4.0, -7.0, 0.5])
    other = replace(room)
    other.__dict__["correspondences"] = room.correspondences
    other.__dict__["train"] = room.train.with_poses(moved @ room.train.world_from_cam)
    np.testing.assert_allclose(on_depth(other), moved @ on_depth(room), atol=2e-3)


def test_tracks_join_the_matches_of_a_point():
    """Features 0 1 | 2 3 | 4 5 of three frames; the last two matches make a frame see one twice."""
    features = Features(np.array([0, 2, 4, 6]), np.zeros((6, 2)), np.zeros(6), np.zeros((6, 128)))
    tracks = join_matches(features, np.array([[0, 2], [2, 4]]))
    assert tracks.of_feature.tolist() == [0, -1, 0, -1, 0, -1]
    assert tracks.frame.tolist() == [0, 1, 2]
    assert tracks.count == 1
    tracks = join_matches(features, np.array([[0, 2], [2, 4], [1, 3], [3, 5], [1, 2]]))
    assert tracks.count == 0
    assert (tracks.of_feature == -1).all()


BESIDE = [pose_at([0.02 * i**2, 0.3 * i - 0.9, 1.3], yaw_deg=3 * i - 9) for i in range(7)]


def seen(poses, point_m):
    """Tracks of points (T, 3) that every frame sees exactly, whatever stands between."""
    point = inverse(poses)[:, None] @ np.append(point_m, np.ones((len(point_m), 1)), 1)[..., None]
    slope = point[..., :2, 0] / point[..., 2:3, 0]
    frame = np.repeat(np.arange(len(poses)), len(point_m))
    track = np.tile(np.arange(len(point_m)), len(poses))
    return Tracks(frame, slope.reshape(-1, 2), track, track)


def test_exact_rays_meet_in_their_points_and_one_wrong_ray_is_outvoted():
    poses, rng = np.stack(BESIDE), np.random.default_rng(0)
    point_m = np.array([3.0, 0, 1.3]) + rng.uniform(-1, 1, (20, 3))
    exact = seen(poses, point_m)
    np.testing.assert_allclose(triangulate(exact, poses), point_m, atol=1e-9)
    wrong = replace(exact, slope=exact.slope.copy())
    wrong.slope[3 * len(point_m)] += 0.2  # frame 3's ray to point 0
    np.testing.assert_allclose(triangulate(wrong, poses)[0], point_m[0], atol=0.02)
    behind = seen(poses, point_m - [10, 0, 0])  # the same slopes, but behind the cameras
    assert np.isnan(triangulate(behind, poses)).all()


def test_a_frame_without_matches_fails_and_is_counted(room, tmp_path):
    found = room.correspondences
    first = found.of(0)
    bare = replace(found, point_m=found.point_m.copy())
    bare.point_m[first] = np.nan
    other = replace(room)
    other.__dict__["correspondences"] = bare
    other.__dict__["query_costs"] = room.query_costs
    answer_and_score(other, ["structure-depth"], tmp_path, {"scene": "room"})
    folder = tmp_path / "structure-depth"
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["failed"] == 1
    assert metrics["n_test"] == 2
    assert metrics["reference"] == "structure-depth"
    rows = (folder / "predictions.csv").read_text().splitlines()
    assert rows[1].endswith("nan,nan,nan,nan,nan,nan,nan")
    assert np.isfinite([float(cell) for cell in rows[2].split(",")]).all()


def test_retrieval_and_oracle_answer_with_labels(room, tmp_path):
    """On test images that are training images, retrieval is exact, against labels and all."""
    labels = tmp_path / "labels"
    half = np.radians(4) / 2
    step = pose_from_quat([0.1, 0, 0], [np.cos(half), 0, np.sin(half), 0])
    noisy = room.train.with_poses(room.train.world_from_cam @ step)
    write_pose_table(labels / "train.csv", noisy)
    write_pose_table(labels / "test.csv", noisy.first(4))
    write_pose_table(tmp_path / "truth" / "train.csv", room.train)
    write_pose_table(tmp_path / "truth" / "test.csv", room.train.first(4))
    evidence = evidence_of(labels, tmp_path / "truth")
    vectors = thumbnails(frames(len(noisy)))
    evidence.__dict__["descriptors"] = dict.fromkeys(("thumbnail", "vlad"), (vectors, vectors[:4]))
    answer_and_score(evidence, in_group("images"), tmp_path / "out", {})
    for name in in_group("images"):
        # Interpolation is exact but for the ridge that its weights are held small by.
        off_m = 5e-3 if name == "interpolated-vlad" else 0
        answered = read_pose_table(tmp_path / "out" / name / "predictions.csv")
        np.testing.assert_allclose(answered.position_m, noisy.position_m[:4], rtol=0, atol=off_m)
        metrics = json.loads((tmp_path / "out" / name / "metrics.json").read_text())
        assert metrics["position_m"] <= off_m
        assert metrics["position_m_true"] == pytest.approx(0.1, abs=off_m or None)
        assert metrics["orientation_deg_true"] == pytest.approx(4.0, abs=0.2 if off_m else None)


def test_a_query_costs_what_was_done_for_it_before(room, tmp_path):
    """Preparing is not answering; the descriptor that a method does not use costs it nothing."""
    costs = tmp_path / "descriptors-costs.json"
    write_json(costs, {"vlad": 0.25, "thumbnail": 4.0})
    vectors = np.eye(len(TRAIN), dtype=np.float32)
    evidence = Evidence({**room.files, "descriptor_costs": costs}, CAMERA, 0)
    evidence.__dict__["descriptors"] = {"vlad": (vectors, vectors[: len(TEST)])}
    answer_and_score(evidence, ["nearest-vlad", "nearest-pose"], tmp_path, {})
    with_vlad, oracle = (
        read_json(tmp_path / name / "facts.json") for name in ("nearest-vlad", "nearest-pose")
    )
    assert (with_vlad["query_s"], oracle["query_s"]) == (0.25, 0)
    assert all(
        facts[name] >= 0 for facts in (with_vlad, oracle) for name in ("answer_s", "prepare_s")
    )
    write_json(costs, {"vlad": "cheap"})
    unread = Evidence({"descriptor_costs": costs}, CAMERA, 0)
    with pytest.raises(InputError, match=r"costs\.json: must hold seconds by name; make it again"):
        _ = unread.query_costs


def test_what_is_prepared_is_not_part_of_answers():
    evidence = Evidence({}, CAMERA, 0)
    for _ in range(2):
        with evidence.preparing():
            begin = time.process_time()
            while time.process_time() < begin + 0.02:
                pass
    assert evidence.spent["prepare_s"] >= 0.04


@pytest.mark.parametrize("count", [1, 4, 20])
def test_images_that_are_the_query_itself_weigh_alike(count):
    descriptors = np.tile(np.random.default_rng(0).normal(size=(1, 1, 8)), (1, count, 1))
    weights = affine_weights(descriptors, descriptors[:, 0])
    np.testing.assert_allclose(weights, np.full((1, count), 1 / count), rtol=1e-12)


def test_interpolated_poses_lie_where_the_descriptor_does():
    """A query at three quarters of the way between two descriptors, with six others about."""
    rng = np.random.default_rng(0)
    descriptors = rng.standard_normal((1, 8, 30)).astype(np.float32)
    query = 0.25 * descriptors[:, 0] + 0.75 * descriptors[:, 1]
    weights = affine_weights(descriptors, query)
    assert weights == pytest.approx(np.array([[0.25, 0.75, *[0] * 6]]), abs=0.01)
    ends = np.stack([pose_at([0, 0, 1], yaw_deg=170), pose_at([4, 0, 1], yaw_deg=-150)])
    others = np.tile(pose_at([9, 9, 9], yaw_deg=10), (6, 1, 1))
    found = combined(np.concatenate([ends, others])[None], np.array([[0.5, 0.5, *[0] * 6]]))
    position_m, angle_rad = pose_error(found[0], pose_at([2, 0, 1], yaw_deg=-170))
    assert (position_m, angle_rad) == (pytest.approx(0), pytest.approx(0, abs=1e-9))


def test_weights_solve_the_constrained_least_squares():
    """By Lagrange's equations, another way to the same weights, of other descriptors."""
    rng = np.random.default_rng(1)
    retrieved, query = rng.standard_normal((5, 6, 40)), rng.standard_normal((5, 40))
    for own, wanted, found in zip(retrieved, query, affine_weights(retrieved, query), strict=True):
        ridge = RIDGE * np.square(own - wanted).sum(axis=1).mean()
        system = np.ones((7, 7))
        system[:6, :6] = own @ own.T + ridge * np.eye(6)
        system[6, 6] = 0.0
        expected = np.linalg.solve(system, [*(own @ wanted), 1.0])[:6]
        assert found == pytest.approx(expected)
        assert found.sum() == pytest.approx(1)


def test_negative_weights_lead_beyond_the_poses():
    """Half as far beyond the first pose as the second one lies before it, turned likewise."""
    ends = np.stack([pose_at([0, 0, 1], yaw_deg=0), pose_at([4, 2, 1], yaw_deg=20)])
    (found,) = combined(ends[None], np.array([[1.5, -0.5]]))
    np.testing.assert_allclose(found[:3, 3], [-2, -1, 1])
    # The sum of turns about one axis points where the sum of arrows of these directions does.
    yaw_deg = np.degrees(np.angle(1.5 - 0.5 * np.exp(1j * np.radians(20))))
    expected = pose_at([-2, -1, 1], yaw_deg=yaw_deg)
    assert pose_error(found, expected)[1] == pytest.approx(0, abs=1e-7)


def test_combined_rotations_are_the_nearest_ones_even_where_the_sum_is_a_reflection():
    """The nearest rotation by Wahba's problem, which SciPy solves."""
    rng = np.random.default_rng(2)
    rotations = Rotation.random(80 * 4, rng=rng).as_matrix().reshape(80, 4, 3, 3)
    weights = rng.normal(size=(80, 4))
    weights += (1 - weights.sum(axis=1, keepdims=True)) / 4
    sums = np.einsum("nk,nkij->nij", weights, rotations)
    assert 5 < (np.linalg.det(sums) < 0).sum() < 75
    found = combined(pose_matrix(rotations, np.zeros((80, 4, 3))), weights)[:, :3, :3]
    nearest = [Rotation.align_vectors(each.T, np.eye(3))[0].as_matrix() for each in sums]
    np.testing.assert_allclose(found, np.stack(nearest), atol=1e-6)


def test_each_of_many_queries_has_its_own_answer(monkeypatch):
    """In parts of three or all at once; each lies between two training images of its own."""
    train = random_table(24, 5)
    vectors = np.linalg.qr(np.random.default_rng(3).normal(size=(40, 24)))[0].T.astype(np.float32)
    first, second = np.arange(0, 22, 2), np.arange(1, 23, 2)
    evidence = Evidence({}, CAMERA, 0)
    queries = (vectors[first] + vectors[second]) / 2
    evidence.__dict__.update(train=train, descriptors={"vlad": (vectors, queries)})
    expected_m = (train.position_m[first] + train.position_m[second]) / 2
    for at_once in (3, 500):
        monkeypatch.setattr(interpolated, "CHUNK", at_once)
        found = by_interpolation(evidence)
        np.testing.assert_allclose(found[:, :3, 3], expected_m, atol=0.01)
