"""What training runs learn, in either precision."""

import numpy as np
import pytest
import torch

from baselines.localizers.registry import build_localizer
from baselines.training.device import autocast, precision_on
from baselines.training.predict import predict_poses
from synfeal.config.models import MODELS
from synfeal.dataset.pose_table import read_pose_table
from synfeal.frames import read_records
from tests.coloured_frames import (
    CPU,
    HYPER,
    NETWORK,
    TRAINING,
    read_split,
    statistics_of,
    train,
    write_split,
)


@pytest.fixture(scope="module")
def split(tmp_path_factory):
    """Packed frames and labels."""
    return write_split(tmp_path_factory.mktemp("split"), "train", 120, 0)


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
