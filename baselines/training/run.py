"""A training run as one job: train, record what from, predict."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baselines.training.loop import Job, train_localizer
from baselines.training.predict import predict_poses
from baselines.training.record import write_training_record
from synfeal.config.models import LocalizerConfig, ModelName, NetworkConfig, TrainingConfig


def train_and_predict(
    model: ModelName,  # which localizer
    frames: Path,  # packed frames to learn from, the first of which are those of ``labels``
    labels: Path,  # their poses
    test_frames: Path,  # packed frames of the test set
    # their poses, of which only the frames are read, but by a published protocol
    test_labels: Path,
    run: dict[str, Any],  # see :func:`baselines.training.record.training_parameters`
    out_model: Path,  # checkpoint
    out_history: Path,  # losses
    out_record: Path,  # what the run was trained from
    out_predictions: Path,  # poses of the test frames
    weights: Path | None = None,  # of the backbone; none from scratch
    # pose table of the common test set, of whose frames one in ``every`` is predicted
    common: Path | None = None,
    every: int = 1,  # see there
    out_common: Path | None = None,  # poses of the common test set
) -> None:
    """Train a localizer, and predict the test frames it is scored on."""
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
