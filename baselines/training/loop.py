"""Training of one localizer on one labelled set."""

from __future__ import annotations

import logging
from pathlib import Path

import torch

from baselines.localizers.backbones.weights import load_backbone_weights
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import save_checkpoint
from baselines.training.data import image_statistics, read_labelled_frames
from baselines.training.device import open_device
from baselines.training.fit import Schedule, fit, write_history
from synfeal.config.models import LocalizerConfig, NetworkConfig, TrainingConfig

log = logging.getLogger(__name__)


def train_localizer(
    name: str,
    frames: Path,
    labels: Path,
    network: NetworkConfig,
    hyper: LocalizerConfig,
    training: TrainingConfig,
    samples_seen: int,
    backbone_weights: Path | None,
    seed: int,
    out_model: Path,
    out_history: Path,
) -> None:
    """Train ``name`` and write its checkpoint and its history (columns of ``HistoryRow``).

    Args:
        name: a key of ``LOCALIZERS``.
        frames: packed frames (N, px, px, 3); the first ones are those of ``labels``.
        labels: pose table of the training set.
        network: input side and width.
        hyper: of this localizer.
        training: batch size and device.
        samples_seen: images shown in all.
        backbone_weights: state dict the backbone starts from; None trains from scratch.
        seed: of the initial weights, the order of the frames and dropout.
        out_model: checkpoint to write.
        out_history: CSV to write.

    Raises:
        InputError: one of the files cannot be used.
    """
    device = open_device(training.device)
    data = read_labelled_frames(frames, labels, network.input_px, device)
    statistics = image_statistics(data.images)
    torch.manual_seed(seed)
    localizer = build_localizer(name, network, hyper)
    if backbone_weights is not None:
        load_backbone_weights(localizer.backbone, backbone_weights)
    localizer.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
    localizer.set_pose_prior(data.position_m.mean(0))
    log.info("%s: %d frames, %d samples, on %s", name, len(data), samples_seen, device)
    schedule = Schedule(samples_seen, training.batch_size, hyper.learning_rate, hyper.weight_decay)
    rows = fit(localizer, data, statistics, schedule, seed)
    save_checkpoint(out_model, localizer, statistics)
    write_history(out_history, rows)
