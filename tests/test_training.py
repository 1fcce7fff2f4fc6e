"""Training, prediction and pretraining on data whose poses can be read off the images."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from baselines.localizers.backbones.weights import build_backbone
from baselines.localizers.registry import build_localizer
from baselines.training.data import image_statistics, read_images, read_labelled_frames
from baselines.training.device import open_device
from baselines.training.fit import Schedule, fit, shuffled_batches
from baselines.training.loop import train_localizer
from baselines.training.predict import predict_poses
from baselines.training.pretrain import pretrain_backbone
from synfeal.config.models import (
    LocalizerConfig,
    NetworkConfig,
    PretrainingConfig,
    TrainingConfig,
)
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError

NETWORK = NetworkConfig(input_px=32, width=0.125)
HYPER = LocalizerConfig(learning_rate=4e-3, dropout=0.0, beta=1.0, s_orientation=-1.0)
TRAINING = TrainingConfig(batch_size=16, samples_seen={}, device="cpu")
PX = NETWORK.input_px


def coloured_frames(count: int, rng: np.random.Generator) -> tuple[np.ndarray, PoseTable]:
    """Frames whose colour is the position and whose gradient is the yaw, with a little noise."""
    position_m = rng.uniform(-1, 1, (count, 3))
    yaw = rng.uniform(-0.5, 0.5, count)
    ramp = np.linspace(-1, 1, PX)[None, None, :, None]
    images = 128 + 60 * position_m[:, None, None, :] + 80 * yaw[:, None, None, None] * ramp
    images = images + rng.normal(scale=2.0, size=(count, PX, PX, 3))
    quat = Rotation.from_euler("z", yaw[:, None]).as_quat(canonical=True, scalar_first=True)
    frame = np.arange(count)
    table = PoseTable(frame, frame // 10, position_m, quat)
    return images.clip(0, 255).astype(np.uint8), table


@pytest.fixture(scope="module")
def split(tmp_path_factory):
    """Packed frames with more images than labels, and the labels."""
    folder = tmp_path_factory.mktemp("split")
    images, table = coloured_frames(140, np.random.default_rng(0))
    np.save(folder / "frames.npy", images)
    write_pose_table(folder / "labels.csv", table.first(120))
    return folder / "frames.npy", folder / "labels.csv"


def train(split, folder, *, samples=96, seed=1, weights=None, name="posenet2"):
    """A short training; returns the paths of checkpoint and history."""
    model, history = folder / "model.pt", folder / "history.csv"
    train_localizer(name, *split, NETWORK, HYPER, TRAINING, samples, weights, seed, model, history)
    return model, history


def test_training_learns_what_the_images_show(split, tmp_path):
    model, history = train(split, tmp_path, samples=2400)
    images, table = coloured_frames(60, np.random.default_rng(1))
    np.save(tmp_path / "test.npy", images)
    write_pose_table(tmp_path / "test.csv", table)
    out = tmp_path / "predictions.csv"
    predict_poses(
        "posenet2", model, tmp_path / "test.npy", tmp_path / "test.csv", NETWORK, HYPER, out
    )
    predicted = read_pose_table(out)
    error = np.linalg.norm(predicted.position_m - table.position_m, axis=1)
    baseline = np.linalg.norm(table.position_m.mean(0) - table.position_m, axis=1)
    assert np.median(error) < 0.5 * np.median(baseline)
    np.testing.assert_allclose(np.linalg.norm(predicted.quat_wxyz, axis=1), 1.0, atol=1e-12)
    assert (predicted.quat_wxyz[:, 0] >= 0).all()
    assert np.array_equal(predicted.path, table.path)
    with history.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert int(rows[-1]["samples_seen"]) == 2400
    assert float(rows[-1]["loss"]) < float(rows[0]["loss"]) - 0.5


def test_the_same_seed_gives_the_same_network_and_another_seed_another(split, tmp_path):
    states = []
    for run, seed in (("a", 1), ("b", 1), ("c", 2)):
        folder = tmp_path / run
        model, _ = train(split, folder, seed=seed)
        states.append(torch.load(model, weights_only=True)["localizer"])
    first, second, third = states
    assert all(torch.equal(first[key], second[key]) for key in first)
    assert any(not torch.equal(first[key], third[key]) for key in first)
    assert (tmp_path / "a/history.csv").read_text() == (tmp_path / "b/history.csv").read_text()


def test_pretrained_weights_are_where_training_starts(split, tmp_path):
    """At a learning rate of nothing, what training ends with is what it started from."""
    backbone = build_backbone("googlenet", NETWORK.width)
    torch.save(backbone.state_dict(), tmp_path / "weights.pt")
    hyper = HYPER.model_copy(update={"learning_rate": 1e-30})
    model = tmp_path / "model.pt"
    train_localizer(
        "posenet2",
        *split,
        NETWORK,
        hyper,
        TRAINING,
        32,
        tmp_path / "weights.pt",
        1,
        model,
        tmp_path / "history.csv",
    )
    state = torch.load(model, weights_only=True)["localizer"]
    for key, parameter in backbone.named_parameters():
        torch.testing.assert_close(state[f"backbone.{key}"], parameter.data, atol=1e-20, rtol=0)


@pytest.mark.parametrize("name", ["googlenet", "resnet34"])
def test_the_pretext_trains_the_backbone_and_saves_it(name, split, tmp_path):
    pretraining = PretrainingConfig(source="pretext", samples_seen=64)
    out = tmp_path / f"{name}.pt"
    pretrain_backbone(name, *split, NETWORK, pretraining, 3, out)
    state = torch.load(out, weights_only=True)
    torch.manual_seed(3)
    untrained = build_backbone(name, NETWORK.width)
    assert state.keys() == untrained.state_dict().keys()
    for key, initial in untrained.named_parameters():
        assert not torch.equal(state[key], initial), key


def test_imagenet_weights_are_passed_on(tmp_path, monkeypatch):
    backbone = build_backbone("resnet34", 0.125)
    official = dict(backbone.state_dict()) | {"fc.bias": torch.zeros(1000)}
    torch.save(official, tmp_path / "resnet34-b627a593.pth")
    pretraining = PretrainingConfig(source="imagenet", weights_dir=tmp_path)
    out = tmp_path / "out.pt"
    pretrain_backbone("resnet34", None, None, NETWORK, pretraining, 0, out)
    passed_on = torch.load(out, weights_only=True)
    assert set(passed_on) == set(backbone.state_dict())
    assert all(torch.equal(passed_on[k], v) for k, v in backbone.state_dict().items())


def test_a_diverged_training_stops(split):
    device = open_device("cpu")
    data = read_labelled_frames(*split, PX, device)
    localizer = build_localizer("posenet2", NETWORK, HYPER)
    with torch.no_grad():
        localizer.regressor[-1].position.bias.fill_(math.nan)
    rows = fit(localizer, data, image_statistics(data.images), Schedule(10_000, 16, 1e-3, 0.0), 0)
    assert rows[-1].samples_seen < 1000
    assert math.isnan(rows[-1].loss)


@pytest.mark.parametrize(("n_frames", "batch_size"), [(10, 4), (3, 8)])
def test_every_frame_is_shown_equally_often(n_frames, batch_size):
    steps = 15
    batches = list(shuffled_batches(n_frames, batch_size, steps, seed=0))
    assert [len(batch) for batch in batches] == [batch_size] * steps
    shown = torch.bincount(torch.cat(batches), minlength=n_frames)
    assert shown.max() - shown.min() <= 1
    assert not torch.equal(torch.cat(batches)[:n_frames], torch.arange(n_frames))


def test_normalised_images_have_zero_mean_and_unit_deviation(split):
    images = read_images(split[0], 120, PX, torch.device("cpu"))
    expected = np.load(split[0])[:120].astype(np.float64)
    statistics = image_statistics(images)
    np.testing.assert_allclose(statistics.mean.ravel(), expected.mean((0, 1, 2)), rtol=1e-5)
    np.testing.assert_allclose(statistics.deviation.ravel(), expected.std((0, 1, 2)), rtol=1e-4)
    normalised = statistics.normalise(images)
    torch.testing.assert_close(normalised.mean((0, 2, 3)), torch.zeros(3), atol=1e-4, rtol=0)
    torch.testing.assert_close(normalised.std((0, 2, 3)), torch.ones(3), atol=1e-3, rtol=0)
    assert normalised.is_contiguous(memory_format=torch.channels_last)


def test_frames_keep_their_pixels_and_their_order(split):
    images = read_images(split[0], 5, PX, torch.device("cpu"))
    assert np.array_equal(images.permute(0, 2, 3, 1).numpy(), np.load(split[0])[:5])


def test_too_few_frames_or_another_size_are_refused(split, tmp_path):
    with pytest.raises(InputError, match="holds 140 frames, but 141 are labelled"):
        read_images(split[0], 141, PX, torch.device("cpu"))
    with pytest.raises(InputError, match=r"network\.input_px"):
        read_images(split[0], 5, 64, torch.device("cpu"))
    with pytest.raises(InputError, match="packed frames"):
        read_images(tmp_path / "absent.npy", 5, PX, torch.device("cpu"))


def test_an_empty_label_table_is_refused(split, tmp_path):
    _, table = coloured_frames(1, np.random.default_rng(0))
    write_pose_table(tmp_path / "empty.csv", table.first(0))
    with pytest.raises(InputError, match="no rows"):
        read_labelled_frames(split[0], tmp_path / "empty.csv", PX, torch.device("cpu"))


def test_a_checkpoint_of_another_localizer_is_refused(split, tmp_path):
    model, _ = train(split, tmp_path, samples=16)
    with pytest.raises(InputError, match=r"model\.pt: is no checkpoint of Hourglass"):
        predict_poses("hourglass", model, *split, NETWORK, HYPER, tmp_path / "out.csv")
