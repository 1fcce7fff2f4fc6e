"""Rotated training images are those that the rotated camera takes."""

import itertools
import json
import math

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.transform import Rotation

from baselines.config.learning import AugmentationConfig, NetworkConfig
from baselines.training.checkpoint import FrameCamera
from baselines.training.rotation import (
    RandomRotation,
    packed_intrinsics,
    quat_of,
    random_rotation,
    rotation_of,
)
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.packed import fit_frame
from synfeal.errors import InputError
from synfeal.render import open_renderer
from tests.support.small_room import PYOPENGL_WARNS, furnished_room, room_poses

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

PX = 64
# Unequal focal lengths and a principal point off the centre, so that none can stand for another.
CAMERA = CameraConfig(width=128, height=96, fx=110.0, fy=118.0, cx=60.0, cy=52.0)
TURNS_DEG = [(8.0, 0.0, 0.0), (0.0, 8.0, 0.0), (0.0, 0.0, 15.0), (-5.0, 6.0, -12.0)]
NETWORK = NetworkConfig(input_px=PX)
# Columns and rows that are inside both images for all of these turns.
INSIDE = slice(20, PX - 20)


def frame_camera(camera):
    """As packed frames record it."""
    size = {"width": camera.width, "height": camera.height}
    return FrameCamera(**size, **camera.intrinsics._asdict())


def rotation(seed=0, side_px=PX):
    """For packed frames of ``CAMERA``."""
    intrinsics = packed_intrinsics(frame_camera(CAMERA), NETWORK)
    return RandomRotation(
        intrinsics, side_px, AugmentationConfig(tilt_deg=8.0, roll_deg=15.0), seed
    )


def packed_views(poses):
    """Return what localizers see at ``world_from_cam`` (N, 4, 4): (N, 3, PX, PX) float levels."""
    # Paint coarse enough that sampling an image twice does not blur it away.
    with open_renderer(furnished_room((20.0,)), CAMERA) as renderer:
        frames = [fit_frame(Image.fromarray(renderer.render(pose)), PX) for pose in poses]
    return torch.from_numpy(np.array(frames)).permute(0, 3, 1, 2).float()


def test_a_turned_image_is_what_the_turned_camera_sees():
    poses = room_poses(3, seed=5)
    turns_rad = np.radians(TURNS_DEG)
    originals = packed_views(poses)
    for turn_rad in turns_rad:
        turned_poses = poses.copy()
        turned_poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(turn_rad).as_matrix()
        truth = packed_views(turned_poses)[:, :, INSIDE, INSIDE]
        vectors = torch.tensor(turn_rad, dtype=torch.float32).expand(len(poses), 3)

        def level_error(vectors, truth=truth):
            found = rotation().rotated(originals, vectors)[:, :, INSIDE, INSIDE]
            return float((found - truth).abs().mean())

        right = level_error(vectors)
        assert right < 2.0
        # The wrong way round, or not at all, is another image.
        assert level_error(-vectors) > 5 * right
        assert level_error(0 * vectors) > 3 * right


def test_labels_turn_with_the_images():
    """The same generator draws what is applied to images and labels; scipy multiplies them."""
    quat = torch.tensor(Rotation.random(6, rng=1).as_quat(scalar_first=True), dtype=torch.float32)
    images = torch.rand(6, 3, PX, PX)
    turned, labels = rotation(seed=4)(images, quat)
    draws = torch.rand(6, 3, generator=torch.Generator().manual_seed(4))
    vectors = (2 * draws - 1) * torch.tensor(np.radians([8.0, 8.0, 15.0]), dtype=torch.float32)
    expected = Rotation.from_quat(quat, scalar_first=True) * Rotation.from_rotvec(vectors)
    off_rad = (expected.inv() * Rotation.from_quat(labels, scalar_first=True)).magnitude()
    assert off_rad.max() < 1e-6
    assert torch.equal(turned, rotation().rotated(images, vectors))
    assert turned.is_contiguous(memory_format=torch.channels_last)


@pytest.mark.parametrize("angle_rad", [0.0, 1e-12, 1e-4, 1.0, math.pi - 1e-6])
def test_rotations_of_vectors_are_scipys(angle_rad):
    vector = angle_rad * np.array([[2.0, -1.0, 2.0]]) / 3.0
    truth = Rotation.from_rotvec(vector)
    tensor = torch.tensor(vector)
    np.testing.assert_allclose(rotation_of(tensor), truth.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(quat_of(tensor), truth.as_quat(scalar_first=True), atol=1e-15)


def test_draws_fill_the_box_and_repeat_with_the_seed():
    identity = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).expand(4000, 4)
    images = torch.zeros(4000, 3, 1, 1).expand(4000, 3, 1, 1)
    small = rotation(side_px=1)
    start = small.state_dict()
    _, labels = small(images, identity)
    degrees = np.degrees(Rotation.from_quat(labels, scalar_first=True).as_rotvec())
    largest = np.abs(degrees).max(axis=0)
    assert (largest <= [8.0001, 8.0001, 15.0001]).all()
    assert (largest > [7.9, 7.9, 14.8]).all()
    assert np.abs(degrees.mean(axis=0)).max() < 0.5
    small.load_state_dict(start)
    assert torch.equal(small(images, identity)[1], labels)


def test_no_angles_or_no_pinhole_camera(tmp_path):
    frames, record = tmp_path / "train.npy", tmp_path / "train.json"
    turned = AugmentationConfig(roll_deg=5.0)
    assert random_rotation(frames, NETWORK, AugmentationConfig(), 0) is None
    with pytest.raises(InputError, match=r"train\.json: names no perspective camera"):
        random_rotation(frames, NETWORK, turned, 0)
    camera = frame_camera(CAMERA).model_dump()
    record.write_text(json.dumps({"camera": camera | {"distortion": [0.1, 0, 0, 0, 0]}}))
    with pytest.raises(InputError, match=r"distortion.*training\.augmentation"):
        random_rotation(frames, NETWORK, turned, 0)
    record.write_text(json.dumps({"camera": camera}))
    assert random_rotation(frames, NETWORK, turned, 0) is not None


@pytest.mark.parametrize("view", ["square", "whole"])
@pytest.mark.parametrize(("width", "height"), [(128, 96), (96, 128), (640, 480), (65, 65)])
def test_packed_intrinsics_are_those_of_the_packed_image(width, height, view):
    """A dot at a known direction is found where the packed intrinsics project it to."""
    camera = FrameCamera(width=width, height=height, fx=90.0, fy=80.0, cx=width / 2, cy=height / 2)
    packed = packed_intrinsics(camera, NETWORK.model_copy(update={"view": view}))
    for dx, dy in itertools.product((-0.15, 0.2), (-0.1, 0.12)):
        u, v = camera.fx * dx + camera.cx, camera.fy * dy + camera.cy
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        spread_px = 2.0 * min(width, height) / PX
        blob = 255 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * spread_px**2))
        image = Image.fromarray(np.repeat(blob.round().astype(np.uint8)[..., None], 3, axis=2))
        small = fit_frame(image, PX, view)[..., 0].astype(float)
        weights = small / small.sum()
        centres = np.arange(PX) + 0.5
        assert (weights.sum(0) * centres).sum() == pytest.approx(
            packed.fx * dx + packed.cx, abs=0.1
        )
        assert (weights.sum(1) * centres).sum() == pytest.approx(
            packed.fy * dy + packed.cy, abs=0.1
        )
