"""A training run as one job: train, record what from, predict."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baselines.training.loop import Job, train_localizer
from baselines.training.predict import predict_poses
from baselines.training.record import write_training_record
from synfeal.config.models import LocalizerConfig, ModelName, NetworkConfig, TrainingConfig


def train_and_predict(
    model: ModelName,
    frames: Path,
    labels: Path,
    test_frames: Path,
    test_labels: Path,
    run: dict[str, Any],
    out_model: Path,
    out_history: Path,
    out_record: Path,
    out_predictions: Path,
    weights: Path | None = None,
    common: Path | None = None,
    every: int = 1,
    out_common: Path | None = None,
) -> None:
    """Train a localizer, and predict the test frames it is scored on.

    Args:
        model: which localizer.
        frames: packed frames to learn from, the first of which are those of ``labels``.
        labels: their poses.
        test_frames: packed frames of the test set.
        test_labels: their poses, of which only the frames are read, but by a published protocol.
        run: see :func:`baselines.training.record.training_parameters`.
        out_model: checkpoint.
        out_history: losses.
        out_record: what the run was trained from.
        out_predictions: poses of the test frames.
        weights: of the backbone; none from scratch.
        common: pose table of the common test set, of whose frames one in ``every`` is predicted.
        every: see there.
        out_common: poses of the common test set.
    """
    inputs = {"frames": frames, "labels": labels, "test_frames": test_frames}
    inputs |= {"test_labels": test_labels} | ({"weights": weights} if weights else {})
    training = TrainingConfig(**run["training"], samples_seen={})
    network, hyper = NetworkConfig(**run["network"]), LocalizerConfig(**run["localizer"])
    job = Job(model, network, hyper, training, run["samples_seen"], run["seed"])
    test = test_frames, test_labels
    train_localizer(job, frames, labels, out_model, out_history, weights=weights, test=test)
    write_training_record(out_record, run, inputs)
    predict_poses(out_model, *test, out_predictions, training.device)
    if common and out_common:
        predict_poses(out_model, test_frames, common, out_common, training.device, every)
