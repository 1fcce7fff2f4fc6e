"""Scene-coordinate regression on a wall whose colour says where on it one looks."""

import numpy as np
import pytest
import torch

from baselines.references.evidence import Evidence
from baselines.references.features import Views, output_centres_px, write_views
from baselines.references.scene_coordinates import (
    CoordinateNetwork,
    by_coordinates,
    distance_m,
    poses_of,
    world_points,
)
from synfeal.camera.projection import normalised_of_pixels
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error
from tests.support.property_support import table_of
from tests.support.room_scene import CAMERA, FURNISHED, cast, color_of, pose_at, write_room

WALL_M = 3.0  # x of the wall
SMALL = CameraConfig(width=32, height=24, horizontal_fov_deg=60.0)


def wall_poses(count, seed):
    rng = np.random.default_rng(seed)
    poses = []
    for _ in range(count):
        position = rng.uniform([0.2, -0.6, 1.0], [0.8, 0.6, 1.6])
        poses.append(pose_at(position, rng.uniform(-12, 12), rng.uniform(-8, 8)))
    return np.stack(poses)


def wall_views(poses):
    """Views of the wall, red by y and green by z; depth in closed form."""
    column, row = np.meshgrid(np.arange(SMALL.width) + 0.5, np.arange(SMALL.height) + 0.5)
    point_m, _ = on_wall(poses, np.stack([column, row], axis=-1))
    color = np.clip(255 * (point_m[..., 1:] - [-2.5, -1.0]) / [5.0, 4.5], 0, 255)
    images = np.concatenate([color, np.full((*color.shape[:3], 1), 90.0)], axis=-1)
    pixel = output_centres_px(SMALL, SMALL.width, SMALL.height)
    slope = normalised_of_pixels(SMALL, pixel)
    return Views(images.astype(np.uint8), slope, on_wall(poses, pixel)[1].astype(np.float32))


def on_wall(poses, pixel):
    """Points (N, ..., 3) of the wall that pixels (..., 2) show, and their depth."""
    slope = normalised_of_pixels(SMALL, pixel)
    ray = np.concatenate([slope, np.ones((*slope.shape[:-1], 1))], axis=-1)
    direction = np.einsum("nij,rcj->nrci", poses[:, :3, :3], ray)
    centre = poses[:, None, None, :3, 3]
    depth_m = (WALL_M - centre[..., 0]) / direction[..., 0]
    return centre + depth_m[..., None] * direction, depth_m


TRAIN, TEST = wall_poses(48, 0), wall_poses(6, 1)


def evidence_of(labels, samples_seen):
    evidence = Evidence({}, SMALL, 3, samples_seen)
    evidence.__dict__["train"] = table_of(list(labels))
    evidence.__dict__["views"] = (wall_views(TRAIN), wall_views(TEST))
    return evidence


def test_lifted_cells_are_the_points_of_the_wall():
    views, pixel = wall_views(TRAIN), output_centres_px(SMALL, SMALL.width, SMALL.height)
    assert pixel.shape == (6, 8, 2)
    found = np.moveaxis(world_points(views, TRAIN), 1, -1)
    np.testing.assert_allclose(found, on_wall(TRAIN, pixel)[0], atol=1e-5)
    np.testing.assert_allclose(found[..., 0], WALL_M, atol=1e-5)


def test_frames_are_reduced_and_cells_have_the_depth_behind_their_middle(tmp_path):
    """Cell (2, 3) is centred on pixel (8, 12) of 32 x 24, on (60.0, 40.0) + half a cell of 160."""
    poses = [pose_at([-1.0, 0.0, 1.3]), pose_at([-0.5, 0.2, 1.2], 20)]
    write_room(tmp_path / "seq-01", poses)
    write_views([tmp_path / "seq-01"], "train", 2, CAMERA, (32, 24), tmp_path / "views.npz")
    views = Views.read(tmp_path / "views.npz")
    for frame, pose in enumerate(poses):
        depth_m, point_m = cast(pose, FURNISHED)
        assert views.depth_m[frame, 2, 3] == pytest.approx(depth_m[42, 62], abs=6e-4)
        blocks = color_of(point_m, FURNISHED).reshape(24, 5, 32, 5, 3).astype(float)
        np.testing.assert_allclose(views.images[frame], blocks.mean((1, 3)), atol=1)
    with pytest.raises(InputError, match="seq-02: cannot be read as a sequence"):
        write_views([tmp_path / "seq-02"], "train", 2, CAMERA, (32, 24), tmp_path / "none.npz")


def test_exact_coordinates_give_the_pose_and_useless_ones_none():
    evidence, views = evidence_of(TRAIN, 0), wall_views(TEST)
    exact = on_wall(TEST, output_centres_px(SMALL, SMALL.width, SMALL.height))[0]
    exact[2] = 0.0  # one point for all cells
    found = poses_of(views, exact, evidence)
    assert np.isnan(found[2]).all()
    good = [0, 1, 3, 4, 5]
    position_m, angle_rad = pose_error(found[good], TEST[good])
    assert position_m.max() < 1e-3
    assert np.degrees(angle_rad).max() < 0.05


def test_a_network_learns_the_wall_and_answers_in_the_world_of_the_labels():
    """Closer than the training positions that are nearest, which no retrieval beats."""
    nearest = np.linalg.norm(TEST[:, None, :3, 3] - TRAIN[:, :3, 3], axis=-1).min(axis=1)
    world = pose_at([4.0, -7.0, 0.5], 70.0)
    found = by_coordinates(evidence_of(world @ TRAIN, 800))
    position_m, angle_rad = pose_error(found, world @ TEST)
    assert np.median(position_m) < 0.7 * np.median(nearest)
    assert np.degrees(np.median(angle_rad)) < 3


def test_the_networks_size_stride_and_loss_are_those_of_its_source():
    network = CoordinateNetwork(torch.tensor([1.0, 2.0, 3.0]))
    size = sum(4 * p.numel() for p in network.parameters())
    assert 3.5e6 < size < 4.5e6  # DSAC* small: 4 MB
    found = network(torch.rand(2, 3, 66, 88))
    assert found.shape == (2, 3, 17, 22)
    assert (found == network.mean_m).all()  # untrained: the mean
    assert output_centres_px(CAMERA, 88, 66).shape == (17, 22, 2)
    wanted = torch.zeros(1, 3, 1, 3)
    wanted[..., 2] = torch.inf
    found = torch.tensor([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0], [9.0, 9.0, 9.0]]).T[None, :, None]
    found.requires_grad_()
    loss = distance_m(found, wanted)
    assert loss.item() == pytest.approx(2.5)  # 5 m and 0 m
    loss.backward()
    assert found.grad.isfinite().all()
    torch.testing.assert_close(found.grad[0, :, 0, 0], torch.tensor([0.3, 0.4, 0.0]))
