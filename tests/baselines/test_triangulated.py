"""Depth from rays that meet, against points that are known; a map of a COLMAP model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from baselines.references.features import Features
from baselines.references.triangulated import depths_of, triangulated
from synfeal.cli import main
from synfeal.config.dataset import RenderConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.geometry.poses import inverse, pose_error, pose_from_quat, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.render.choose import open_renderer
from tests.support.capture_writers import HEIGHT, WIDTH, camera, seven_scenes, shots
from tests.support.small_room import SIZE_M, furnished_room

PIXEL = 1.0 / 500.0


def side_by_side(count: int, step_m: float = 0.3) -> np.ndarray:
    """Poses (N, 4, 4) side by side, looking along x, each turned a little."""
    return np.stack(
        [
            pose_matrix(rotation_from_rpy([0.02 * i, -0.03 * i, 0.05 * i]), [0.0, -step_m * i, 0.1])
            for i in range(count)
        ]
    )


def seen_from(poses: np.ndarray, point_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slopes (N, K, 2) and depths (N, K) of points (K, 3)."""
    inside = np.stack([point_m @ p[:3, :3].T + p[:3, 3] for p in map(inverse, poses)])
    return inside[..., :2] / inside[..., 2:], inside[..., 2]


def rays_between(poses: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Starts and steps (N - 1, K, 2, 3) of the first camera's rays in those of the others."""
    ray = np.column_stack([slope, np.ones(len(slope))])
    found = []
    for other in poses[1:]:
        to_other = inverse(other) @ poses[0]
        step = ray @ to_other[:3, :3].T
        found.append(np.stack([np.broadcast_to(to_other[:3, 3], step.shape), step], axis=1))
    return np.array(found)


@pytest.fixture
def points() -> np.ndarray:
    rng = np.random.default_rng(4)
    return rng.uniform([3.0, -1.5, -1.0], [6.0, 1.0, 1.0], (50, 3))


def matches(poses: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, rays and slopes of every point in every other frame."""
    slope, _ = seen_from(poses, points)
    others = len(poses) - 1
    rows = np.tile(np.arange(len(points)), others)
    return rows, rays_between(poses, slope[0]).reshape(-1, 2, 3), slope[1:].reshape(-1, 2)


def test_rays_that_meet_give_the_depth_exactly(points):
    poses = side_by_side(4)
    found = depths_of(*matches(poses, points), len(points), 2 * PIXEL)
    np.testing.assert_allclose(found, seen_from(poses, points)[1][0], rtol=1e-9)


def test_a_wrong_match_is_outvoted(points):
    poses = side_by_side(5)
    rows, rays, seen = matches(poses, points)
    seen = seen.copy()
    seen[: len(points)] += 0.1  # all of the second frame
    found = depths_of(rows, rays, seen, len(points), 2 * PIXEL)
    np.testing.assert_allclose(found, seen_from(poses, points)[1][0], rtol=1e-9)


def test_errors_of_a_pixel_average_out(points):
    """The error of a depth is that of a pixel times depth squared over the baseline."""
    poses = side_by_side(7)
    rows, rays, seen = matches(poses, points)
    noisy = seen + np.random.default_rng(0).normal(0.0, 0.3 * PIXEL, seen.shape)
    found = depths_of(rows, rays, noisy, len(points), 2 * PIXEL)
    true = seen_from(poses, points)[1][0]
    assert np.isfinite(found).all()
    expected = 0.3 * PIXEL * true**2 / 0.3  # of the nearest camera alone
    assert np.mean(np.abs(found - true) < expected) > 0.95


def test_two_rays_do_not_count_and_nor_do_nearly_parallel_ones(points):
    assert np.isnan(depths_of(*matches(side_by_side(2), points), len(points), 2 * PIXEL)).all()
    near = side_by_side(4, step_m=0.01)  # half a degree at 3 m
    assert np.isnan(depths_of(*matches(near, points), len(points), 2 * PIXEL)).all()


def test_points_behind_a_camera_are_none(points):
    poses = side_by_side(4)
    rows, rays, seen = matches(poses, points)
    behind = depths_of(rows, rays * np.array([[[1.0], [-1.0]]]), seen, len(points), 2 * PIXEL)
    assert np.isnan(behind).all()


def test_features_are_matched_by_their_descriptors(points):
    """Frames see the points in orders of their own; one feature of each is of nothing else."""
    poses = side_by_side(4)
    rng = np.random.default_rng(1)
    descriptor = rng.integers(0, 200, (len(points) + len(poses), 128)).astype(np.uint8)
    slope, depth = seen_from(poses, points)
    orders = [rng.permutation(len(points)) for _ in poses]
    parts = [
        (np.vstack([slope[i][order], [[0.3, 0.3]]]), descriptor[[*order, len(points) + i]])
        for i, order in enumerate(orders)
    ]
    features = Features(
        start=np.arange(len(poses) + 1) * (len(points) + 1),
        slope=np.concatenate([part[0] for part in parts]),
        depth_m=np.zeros(len(poses) * (len(points) + 1)),
        descriptor=np.concatenate([part[1] for part in parts]),
    )
    vectors = np.full((len(poses), 4), 0.5, np.float32)
    found = triangulated(features, poses, vectors, 1.0 / PIXEL)
    assert np.diff(found.start).tolist() == [len(points)] * len(poses)
    for frame, order in enumerate(orders):
        np.testing.assert_allclose(found.depth_m[found.of(frame)], depth[frame][order], rtol=1e-6)


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> tuple[Path, np.ndarray]:
    """Frames of a room, exported to COLMAP: poses and photographs, neither depth nor points."""
    folder = tmp_path_factory.mktemp("exported")
    data = folder / "data"
    world_from_room = seven_scenes(data / "seq-01")
    (data / "seq-01" / "manifest.json").rename(data / "manifest.json")
    assert main(["export", str(data), "--to", "colmap", "--out", str(folder / "model")]) == 0
    return folder / "model", world_from_room


@pytest.fixture(scope="module")
def mapped(exported, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("mapped") / "map"
    assert main(["map", str(exported[0]), "--out", str(out)]) == 0
    return out


def test_frames_of_a_model_come_back_exactly(mapped, exported):
    table = read_pose_table(mapped / "frames.csv")
    expected = exported[1] @ shots().room_from_cam
    np.testing.assert_allclose(table.world_from_cam, expected, atol=1e-6)
    names = pd.read_csv(mapped / "frames.csv")["image"]
    assert [Path(name).stem for name in names[:2]] == ["frame-000000.color", "frame-000001.color"]


def test_photographs_are_localized_in_a_map_of_a_model(mapped, exported, tmp_path):
    rng = np.random.default_rng(5)
    poses = np.stack(
        [
            pose_matrix(
                rotation_from_rpy([*rng.uniform([-0.1, 0.0], [0.1, 0.3]), yaw]),
                SIZE_M * [0.5, 0.45, 0.6] + rng.uniform(-0.3, 0.3, 3) * [1.0, 1.0, 0.5],
            )
            for yaw in np.linspace(0.2, 6.0, 8)
        ]
    )
    photos = tmp_path / "photos"
    photos.mkdir()
    one = camera(WIDTH, HEIGHT)
    with open_renderer(furnished_room((4.0, 12.0, 40.0)), one, RenderConfig()) as renderer:
        for number, pose in enumerate(poses):
            Image.fromarray(renderer.render(pose)).save(photos / f"{number}.png")
    calibration = tmp_path / "camera.json"
    calibration.write_text(json.dumps({"camera": one.record}))
    out = tmp_path / "poses.csv"
    words = ["localize", str(mapped), str(photos), "--camera", str(calibration), "--out", str(out)]
    assert main(words) == 0
    table = pd.read_csv(out)
    found = (table["status"] == "localized").to_numpy()
    assert found.mean() >= 0.75
    values = table.loc[found, ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]].to_numpy(float)
    answers = pose_from_quat(values[:, :3], values[:, 3:])
    error_m, error_rad = pose_error(answers, (exported[1] @ poses)[found])
    assert np.median(error_m) < 0.03
    assert np.median(np.degrees(error_rad)) < 0.5
