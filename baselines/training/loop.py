"""Training of one localizer on one labelled set."""

from __future__ import annotations

import logging
from pathlib import Path

import torch

from baselines.localizers.backbones.weights import load_backbone_weights
from baselines.localizers.base import Localizer
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import save_checkpoint
from baselines.training.data import (
    ImageStatistics,
    LabelledFrames,
    image_statistics,
    read_labelled_frames,
)
from baselines.training.description import ModelDescription, frame_camera
from baselines.training.device import memory_errors, open_device, precision_on
from baselines.training.fit import Augmentation, fit
from baselines.training.optimizer import Schedule
from baselines.training.order import held_out_paths
from baselines.training.progress import write_history
from baselines.training.protocol import HALVE_EVERY, PROTOCOLS, Protocol
from baselines.training.resume import ResumeFile, digest
from baselines.training.rotation import random_rotation
from synfeal.config.models import LocalizerConfig, ModelName, NetworkConfig, TrainingConfig

log = logging.getLogger(__name__)

# Images that tell this training's frames from others, beside the statistics of all of them.
FINGERPRINT_IMAGES = 64


@memory_errors()
def train_localizer(
    name: ModelName,
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
    *,
    test: tuple[Path, Path] | None = None,
    protocol: Protocol | None = None,
    augment: Augmentation | None = None,
) -> None:
    """Train ``name`` and write its checkpoint and its history (columns of ``HistoryRow``).

    Beside the checkpoint lies ``resume.pt`` until the training is finished.

    Args:
        name: a key of ``LOCALIZERS``.
        frames: packed frames (N, px, px, 3); the first ones are those of ``labels``.
        labels: pose table of the training set.
        network: input side and width.
        hyper: of this localizer.
        training: protocol, batch size, precision and device.
        samples_seen: images shown in all.
        backbone_weights: state dict the backbone starts from; None trains from scratch.
        seed: of the initial weights, the paths held out, the order of the frames, their turns and
            dropout.
        out_model: checkpoint to write.
        out_history: CSV to write.
        test: packed frames and labels of the test set; read only where weights are chosen by it.
        protocol: in place of the one that ``training`` names.
        augment: in place of the rotations that ``training`` asks for.

    Raises:
        InputError: one of the files cannot be used.
        MemoryError: there is too little memory; no checkpoint is written.
    """
    protocol = protocol or PROTOCOLS[training.protocol]
    device = open_device(training.device)
    data = read_labelled_frames(frames, labels, network.input_px, device)
    statistics = image_statistics(data.images)
    learned, held_out = _split(data, protocol, training.validation_share, seed, test)
    localizer = _initial(name, network, hyper, backbone_weights, seed)
    localizer.place_on(device)
    localizer.set_pose_prior(learned.position_m.mean(0))
    _log_start(name, learned, held_out, protocol, samples_seen, device)
    settings = (name, network, hyper, training, protocol, samples_seen, seed)
    if augment is None and protocol.images == "turned":
        augment = random_rotation(frames, network, training.augmentation, seed)
    state = augment.state_dict() if augment else None
    resume = ResumeFile(
        out_model.with_name("resume.pt"),
        digest(*settings, state, *_fingerprints(localizer, statistics, learned, held_out)),
    )
    rows = fit(
        localizer,
        learned,
        statistics,
        Schedule(
            samples_seen,
            training.batch_size,
            hyper.learning_rate,
            hyper.weight_decay,
            HALVE_EVERY[name],
        ),
        seed,
        protocol=protocol,
        held_out=held_out,
        patience=training.patience,
        precision=precision_on(device, training.precision),
        augment=augment,
        resume=resume,
    )
    description = ModelDescription(
        localizer=name, network=network, hyper=hyper, camera=frame_camera(frames)
    )
    save_checkpoint(out_model, localizer, statistics, description)
    write_history(out_history, rows)
    resume.remove()


def _initial(
    name: ModelName,
    network: NetworkConfig,
    hyper: LocalizerConfig,
    backbone_weights: Path | None,
    seed: int,
) -> Localizer:
    """The localizer that training starts from; seeds the generator that dropout draws from too."""
    torch.manual_seed(seed)
    localizer = build_localizer(name, network, hyper)
    if backbone_weights is not None:
        load_backbone_weights(localizer.backbone, backbone_weights)
    return localizer


def _split(
    data: LabelledFrames,
    protocol: Protocol,
    validation_share: float,
    seed: int,
    test: tuple[Path, Path] | None,
) -> tuple[LabelledFrames, LabelledFrames | None]:
    """The frames to learn from, and those that choose the weights."""
    if protocol.selection == "test":
        if test is None:
            raise ValueError("this protocol chooses weights by the test set, which is not given")
        input_px, device = data.images.shape[-1], data.images.device
        return data, read_labelled_frames(*test, input_px, device)
    share = validation_share if protocol.selection == "validation" else 0.0
    mask = held_out_paths(data.path, share, seed)
    return (data.part(~mask), data.part(mask)) if mask.any() else (data, None)


def _log_start(
    name: str,
    learned: LabelledFrames,
    held_out: LabelledFrames | None,
    protocol: Protocol,
    samples_seen: int,
    device: torch.device,
) -> None:
    log.info("%s: %d frames, %d samples, on %s", name, len(learned), samples_seen, device)
    if held_out is None:
        log.info("no frames are held out: the last weights are kept")
    else:
        log.info("weights are chosen on %d frames (%s)", len(held_out), protocol.selection)


def _fingerprints(
    localizer: Localizer,
    statistics: ImageStatistics,
    learned: LabelledFrames,
    held_out: LabelledFrames | None,
) -> list[object]:
    """All that a training depends on beside its settings; of its images, samples."""
    values: list[object] = [torch.__version__, localizer.state_dict()]
    values += [statistics.mean, statistics.deviation, learned.images.device.type]
    for part in (learned, held_out):
        if part is not None:
            some = torch.arange(0, len(part), max(1, len(part) // FINGERPRINT_IMAGES))
            values += [*part.batch(some.to(part.rows.device)), part.position_m, part.quat_wxyz]
    return values
