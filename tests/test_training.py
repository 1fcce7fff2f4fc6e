"""Training, prediction and pretraining on data whose poses can be read off the images."""

import json
import math

import numpy as np
import pytest
import torch

from baselines.localizers.backbones.weights import build_backbone
from baselines.training.data import image_statistics, read_images, read_labelled_frames
from baselines.training.predict import predict_poses
from baselines.training.pretrain import pretrain_backbone
from baselines.training.score import score_run
from synfeal.config.models import PretrainingConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.frames import read_records
from tests.coloured_frames import (
    CPU,
    HYPER,
    NETWORK,
    PX,
    Jitter,
    coloured_frames,
    train,
    write_split,
)


@pytest.fixture(scope="module")
def split(tmp_path_factory):
    """Packed frames with more images than labels, and the labels."""
    return write_split(tmp_path_factory.mktemp("split"), "train", 120, 0, spare=20)


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
    model, _ = train(split, tmp_path, samples=32, weights=tmp_path / "weights.pt", hyper=hyper)
    state = torch.load(model, weights_only=True)["localizer"]
    for key, parameter in backbone.named_parameters():
        torch.testing.assert_close(state[f"backbone.{key}"], parameter.data, atol=1e-20, rtol=0)


@pytest.mark.parametrize("name", ["googlenet", "resnet34"])
def test_the_pretext_trains_the_backbone_and_saves_it(name, split, tmp_path):
    pretraining = PretrainingConfig(source="rooms", samples_seen=64)
    out = tmp_path / f"{name}.pt"
    pretrain_backbone(name, NETWORK, pretraining, 3, out, *zip(split, split, strict=True))
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
    pretrain_backbone("resnet34", NETWORK, pretraining, 0, out)
    passed_on = torch.load(out, weights_only=True)
    assert set(passed_on) == set(backbone.state_dict())
    assert all(torch.equal(passed_on[k], v) for k, v in backbone.state_dict().items())


class Poison(Jitter):
    """Images that are no numbers, from one call on."""

    def __call__(self, images, quat_wxyz):
        images, quat_wxyz = super().__call__(images, quat_wxyz)
        return (images if self.calls < 40 else images * math.nan), quat_wxyz


def test_a_diverged_training_stops_and_has_failed(split, tmp_path):
    """Although it had good weights before, which had been looked at twice and kept."""
    model, history = train(split, tmp_path, samples=1600, augment=Poison())
    rows = [row for _, row in read_records(history)]
    assert rows[-1]["loss"] == ""  # no number
    assert len([row for row in rows if row["held_out_position_m"]]) >= 2
    assert 40 * 16 <= int(rows[-1]["samples_seen"]) < 1600
    out = tmp_path / "predictions.csv"
    predict_poses(model, *split, out)
    metrics = tmp_path / "metrics.json"
    score_run(out, split[1], split[1], split[1], tmp_path / "errors.csv", metrics, {})
    found = json.loads(metrics.read_text())
    assert found["failed"] == found["n_test"] == 120
    assert found["position_m"] is None


def test_every_seventh_frame_is_predicted_as_it_is_among_all(split, tmp_path):
    model, _ = train(split, tmp_path, samples=640)
    tables = []
    for every in (1, 7):
        predict_poses(model, *split, tmp_path / "out.csv", "cpu", every)
        tables.append(read_pose_table(tmp_path / "out.csv"))
    whole, part = tables
    np.testing.assert_array_equal(part.frame, whole.frame[::7])
    np.testing.assert_allclose(part.position_m, whole.position_m[::7], atol=1e-4)
    np.testing.assert_allclose(part.quat_wxyz, whole.quat_wxyz[::7], atol=1e-4)
    assert np.ptp(part.position_m, axis=0).max() > 1e-3


def test_normalised_images_have_zero_mean_and_unit_deviation(split):
    images = read_images(split[0], 120, PX, CPU)
    expected = np.load(split[0])[:120].astype(np.float64)
    statistics = image_statistics(images)
    np.testing.assert_allclose(statistics.mean.ravel(), expected.mean((0, 1, 2)), rtol=1e-5)
    np.testing.assert_allclose(statistics.deviation.ravel(), expected.std((0, 1, 2)), rtol=1e-4)
    normalised = statistics.normalise(images)
    torch.testing.assert_close(normalised.mean((0, 2, 3)), torch.zeros(3), atol=1e-4, rtol=0)
    torch.testing.assert_close(normalised.std((0, 2, 3)), torch.ones(3), atol=1e-3, rtol=0)
    assert normalised.is_contiguous(memory_format=torch.channels_last)


def test_too_few_frames_another_size_and_no_labels_are_refused(split, tmp_path):
    with pytest.raises(InputError, match="holds 140 frames, but 141 are labelled"):
        read_images(split[0], 141, PX, CPU)
    with pytest.raises(InputError, match=r"network\.input_px"):
        read_images(split[0], 5, 64, CPU)
    with pytest.raises(InputError, match="packed frames"):
        read_images(tmp_path / "absent.npy", 5, PX, CPU)
    _, table = coloured_frames(1, np.random.default_rng(0))
    write_pose_table(tmp_path / "empty.csv", table.first(0))
    with pytest.raises(InputError, match="no rows"):
        read_labelled_frames(split[0], tmp_path / "empty.csv", PX, CPU)
