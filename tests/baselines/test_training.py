"""Training, prediction and pretraining on data whose poses can be read off the images."""

import json
import math

import numpy as np
import pytest
import torch

from baselines.config.learning import MODELS, PretrainingConfig
from baselines.localizers.backbones.weights import build_backbone
from baselines.localizers.registry import build_localizer
from baselines.training.data import image_statistics, read_images, read_labelled_frames
from baselines.training.device import autocast, precision_on
from baselines.training.predict import predict_poses
from baselines.training.pretrain import pretrain_backbone
from baselines.training.score import score_run
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.records.tables import read_records
from tests.support.colored_frames import (
    CPU,
    HYPER,
    NETWORK,
    PX,
    TRAINING,
    Jitter,
    colored_frames,
    read_split,
    statistics_of,
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
        tables.append(read_pose_table(tmp_path / "out.csv", any_frames=True))
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
    _, table = colored_frames(1, np.random.default_rng(0))
    write_pose_table(tmp_path / "empty.csv", table.first(0))
    with pytest.raises(InputError, match="no rows"):
        read_labelled_frames(split[0], tmp_path / "empty.csv", PX, CPU)


@pytest.fixture(scope="module", params=["float32", "bfloat16"])
def learned(request, split, tmp_path_factory):
    """Truth and predictions of other frames, and the history, of a run in either precision."""
    folder = tmp_path_factory.mktemp(request.param)
    training = TRAINING.model_copy(update={"precision": request.param})
    model, history = train(split, folder, samples=2400, training=training)
    test = write_split(folder, "test", 60, 1)
    predict_poses(model, *test, folder / "predictions.csv")
    rows = [row for _, row in read_records(history)]
    return read_pose_table(test[1]), read_pose_table(folder / "predictions.csv"), rows


def test_training_learns_what_the_images_show(learned):
    table, predicted, rows = learned
    error = np.linalg.norm(predicted.position_m - table.position_m, axis=1)
    baseline = np.linalg.norm(table.position_m.mean(0) - table.position_m, axis=1)
    assert np.median(error) < 0.5 * np.median(baseline)
    np.testing.assert_allclose(np.linalg.norm(predicted.quat_wxyz, axis=1), 1.0, atol=1e-6)
    assert (predicted.quat_wxyz[:, 0] >= 0).all()
    assert np.array_equal(predicted.path, table.path)
    assert int(rows[-1]["samples_seen"]) == 2400
    assert float(rows[-1]["loss"]) < float(rows[0]["loss"]) - 0.5
    looked_at = [row for row in learned[2] if row["held_out_position_m"]]
    assert len(looked_at) == 20
    for name in ("held_out_position_m", "held_out_orientation_deg"):
        # The first look is after a twentieth of the run, when much is learned already.
        assert float(looked_at[-1][name]) < 0.75 * float(looked_at[0][name])


@pytest.mark.parametrize("name", MODELS)
def test_bfloat16_changes_predictions_by_its_rounding(name, split):
    """It has 8 bits, some 20 layers deep; weights, losses and gradients are float32."""
    frames = read_split(split)
    images, position_m, quat_wxyz = frames.batch(torch.arange(16))
    localizer = build_localizer(name, NETWORK, HYPER).eval()
    found = []
    for precision in ("float32", "bfloat16"):
        with autocast(CPU, precision):
            predictions = localizer(statistics_of(frames).normalise(images))
        loss = localizer.loss(predictions, position_m, quat_wxyz)
        loss.backward()
        gradients = [p.grad for p in localizer.parameters()]
        values = [loss, *gradients, *localizer.parameters(), *predictions[0]]
        assert {value.dtype for value in values} == {torch.float32}
        found.append(torch.cat(predictions[0], dim=1).detach())
    error = torch.linalg.vector_norm(found[1] - found[0], dim=1)
    size = torch.linalg.vector_norm(found[0], dim=1)
    assert (error <= 0.05 * size).all()
    assert (error > 0).any()


@pytest.mark.parametrize(
    ("found", "wanted", "expected"),
    [
        ({}, "auto", "float32"),
        ({"avx512_bf16": True}, "auto", "bfloat16"),
        ({"amx_bf16": True}, "auto", "bfloat16"),
        ({}, "bfloat16", "bfloat16"),
        ({"avx512_bf16": True}, "float32", "float32"),
    ],
)
def test_processors_round_unasked_where_they_multiply_in_bfloat16(
    found, wanted, expected, monkeypatch
):
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: found)
    assert precision_on(torch.device("cpu"), wanted) == expected
    assert precision_on(torch.device("cuda"), "auto") == "bfloat16"
