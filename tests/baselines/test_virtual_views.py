"""Poses averaged over virtual rotations: turned back exactly, and the mean rotation of others."""

import dataclasses

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.transform import Rotation

from baselines.config.learning import AugmentationConfig
from baselines.localizers.base import PosePrediction
from baselines.training.checkpoint import FrameCamera
from baselines.training.predict import predict
from baselines.training.virtual_views import VirtualViews, mean_quat_wxyz, paired_rotations_rad
from synfeal.cli import main
from tests.support.collected import refused
from tests.support.colored_frames import NETWORK, save, untrained

CAMERA = FrameCamera(width=80, height=60, fx=70.0, fy=72.0, cx=39.0, cy=31.0)
TURNS = AugmentationConfig(tilt_deg=8.0, roll_deg=15.0)
PAIRS, PX = 5, NETWORK.input_px


def trained_with(turns=TURNS, camera=CAMERA):
    trained = untrained(camera=camera)
    description = trained.description.model_copy(update={"rotations": turns})
    return dataclasses.replace(trained, description=description)


def images(count=4):
    rng = np.random.default_rng(7)
    return torch.from_numpy(rng.integers(0, 256, (count, 3, PX, PX), dtype=np.uint8))


class Oracle:
    """In place of a network: knows by how much each view is turned, and is wrong as it is told.

    It is asked about four pictures at once, all of them under the first rotation, then the next.
    """

    def __init__(self, world_from_cam, position_m, error_m):
        self._world_from_cam, self._position_m, self._error_m = world_from_cam, position_m, error_m

    def __call__(self, normalised):
        assert len(normalised) == 4 * (1 + 2 * PAIRS)
        positions_m, quats_wxyz = [], []
        for number, rotvec_rad in enumerate(paired_rotations_rad(TURNS, PAIRS).numpy()):
            turned = self._world_from_cam * Rotation.from_rotvec(rotvec_rad)
            # Of any length, and with either sign: one rotation all the same.
            lengths = np.array([[3.0], [-0.2], [1.0], [-7.0]])
            quats_wxyz.append(lengths * np.roll(turned.as_quat(), 1, axis=1))
            positions_m.append(self._position_m + (-1) ** number * self._error_m)
        values = np.concatenate(positions_m), np.concatenate(quats_wxyz)
        return [PosePrediction(*(torch.tensor(part, dtype=torch.float32) for part in values))]


def test_answers_to_turned_views_are_turned_back():
    rng = np.random.default_rng(3)
    truth, position_m = Rotation.random(4, random_state=5), rng.normal(size=(4, 3))
    trained = trained_with()
    oracle = Oracle(truth, position_m, error_m=np.zeros(3))
    views = VirtualViews(dataclasses.replace(trained, network=oracle), PAIRS)
    assert views.count == 1 + 2 * PAIRS
    # Of every view alone, for rotations there and back cancel in the mean however they are turned.
    for positions_m, quats_wxyz in zip(*views.answers(images()), strict=True):
        np.testing.assert_allclose(positions_m, position_m, atol=2e-6)
        found = Rotation.from_quat(np.roll(quats_wxyz, -1, axis=1))
        assert (truth.inv() * found).magnitude().max() < 3e-6
    _, quat_wxyz = views.predict(images())
    found = Rotation.from_quat(np.roll(quat_wxyz, -1, axis=1))
    assert (truth.inv() * found).magnitude().max() < 3e-6
    assert (quat_wxyz[:, 0] >= 0).all()


def test_errors_that_differ_between_views_average_out():
    truth, position_m = Rotation.random(4, random_state=5), np.zeros((4, 3))
    oracle = Oracle(truth, position_m, error_m=np.full(3, 0.11))
    views = VirtualViews(dataclasses.replace(trained_with(), network=oracle), PAIRS)
    found_m, _ = views.predict(images())
    np.testing.assert_allclose(found_m, 0.11 / (1 + 2 * PAIRS), atol=2e-6)


@pytest.mark.parametrize(
    ("turns", "camera", "pairs"), [(None, CAMERA, 8), (TURNS, None, 8), (TURNS, CAMERA, 0)]
)
def test_without_rotations_a_picture_is_seen_once_and_as_it_is(turns, camera, pairs):
    trained = trained_with(turns, camera)
    views = VirtualViews(trained, pairs)
    assert views.count == 1
    for ours, plain in zip(views.predict(images()), predict(trained, images()), strict=True):
        np.testing.assert_array_equal(ours, plain)


def test_rotations_fill_the_range_and_cancel():
    rotvecs_deg = np.degrees(paired_rotations_rad(TURNS, 64).numpy())
    np.testing.assert_allclose(rotvecs_deg.mean(axis=0), 0.0, atol=1e-5)
    largest = np.abs(rotvecs_deg).max(axis=0)
    assert (largest <= [8.0, 8.0, 15.0]).all()
    assert (largest > 0.9 * np.array([8.0, 8.0, 15.0])).all()


def test_the_mean_rotation_is_that_of_scipy():
    rng = np.random.default_rng(11)
    base = Rotation.random(6, random_state=1)
    spread = Rotation.from_rotvec(rng.normal(scale=0.3, size=(9 * 6, 3)))
    quat_xyzw = np.array([base.as_quat()] * 9).reshape(-1, 4)
    quats = (Rotation.from_quat(quat_xyzw) * spread).as_quat().reshape(9, 6, 4)
    quats *= rng.choice([-1.0, 1.0], size=(9, 6, 1))
    expected = [Rotation.from_quat(quats[:, i]).mean() for i in range(6)]
    quats[4, 2, 1] = np.nan
    found = mean_quat_wxyz(np.roll(quats, 1, axis=2))
    assert np.isnan(found[2]).all()
    for i in (0, 1, 3, 4, 5):
        ours = Rotation.from_quat(np.roll(found[i], -1))
        assert (expected[i].inv() * ours).magnitude() < 1e-7


def test_the_command_says_how_many_views(tmp_path, capfd):
    model = save(tmp_path / "model.pt", trained_with())
    Image.new("RGB", (80, 60), "teal").save(tmp_path / "a.png")
    given = ["localize", str(model), str(tmp_path / "a.png"), "--out", str(tmp_path / "p.csv")]
    assert main(given) == 0
    assert " on 17 views" in capfd.readouterr().out
    (tmp_path / "p.csv").unlink()
    assert main([*given, "--turns", "0"]) == 0
    assert "views" not in capfd.readouterr().out
    assert "--turns" in refused(capfd, *given, "--turns", "-1")
