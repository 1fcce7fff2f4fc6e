"""Weights that pretrained backbones start from: those shipped, ImageNet's, or new ones.

New ones learn camera localization itself, in rooms that no experiment uses: where ImageNet cannot
be downloaded, or no published weights fit a narrow network, it teaches features that carry over.
One backbone learns all rooms at once; each room has a regressor of its own, because the same pose
in another room is another picture.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import torch
from torch import Tensor, nn

from baselines.config.learning import NetworkConfig, PretrainingConfig
from baselines.localizers.backbones.shipped import shipped_weights_path
from baselines.localizers.backbones.weights import (
    Backbone,
    build_backbone,
    imagenet_weights_path,
    load_backbone_weights,
)
from baselines.localizers.base import Localizer, OutputLayer, PooledFeature
from baselines.localizers.losses import LearnedWeightLoss, PosePrediction
from baselines.localizers.memory import memory_errors
from baselines.localizers.registry import BackboneName
from baselines.training.checkpoint import save_atomically
from baselines.training.data import LabelledFrames, image_statistics, read_labelled_frames
from baselines.training.device import open_device, precision_on
from baselines.training.fit import LAST_WEIGHTS, fit
from baselines.training.optimizer import Schedule
from baselines.training.resume import ResumeFile, digest
from baselines.training.rotation import random_rotation

log = logging.getLogger(__name__)

WEIGHT_DECAY = 1e-4


class RoomHeads(OutputLayer):
    """One linear regressor for each room."""

    def __init__(self, n_in: int, n_rooms: int) -> None:
        super().__init__()
        self.poses = nn.Linear(n_in, 7 * n_rooms)

    def forward(self, features: Tensor, room: Tensor) -> PosePrediction:
        """Regress poses from features (B, n_in) in their rooms (B,)."""
        poses = self.poses(features).view(len(features), -1, 7)
        own = poses[torch.arange(len(features), device=features.device), room]
        return PosePrediction(own[:, :3], own[:, 3:])


class RoomsNetwork(Localizer):
    """A backbone, one feature, a regressor for each room, learned weights of the two errors."""

    backbone: Backbone

    def __init__(self, backbone: BackboneName, width: float, n_rooms: int) -> None:
        super().__init__()
        self.backbone = build_backbone(backbone, width)
        self.feature = PooledFeature(self.backbone.n_out, width)
        self.heads = RoomHeads(self.feature.n_out, n_rooms)
        self.criterion = LearnedWeightLoss(s_position=0.0, s_orientation=-1.0)

    def forward(self, images: Tensor) -> Tensor:  # type: ignore[override]
        """Compute features (B, n) of normalised images (B, 3, H, W)."""
        features: Tensor = self.feature(self.backbone(images)[-1])
        return features

    def loss(  # type: ignore[override]
        self, features: Tensor, place: Tensor, quat_wxyz: Tensor
    ) -> Tensor:
        """Compute the loss of the poses that the rooms' regressors predict.

        Args:
            features: Features (B, n).
            place: True positions in metres, relative to the mean of the room, then the room (B, 4).
            quat_wxyz: True rotations (B, 4), unit quaternions.

        Returns:
            A scalar.
        """
        prediction = self.heads(features.float(), place[:, 3].long())
        loss: Tensor = self.criterion(prediction, place[:, :3], quat_wxyz)
        return loss


@memory_errors()
def pretrain_backbone(
    backbone: BackboneName,
    network: NetworkConfig,
    pretraining: PretrainingConfig,
    seed: int,
    out_weights: Path,
    frames: Sequence[Path] = (),
    labels: Sequence[Path] = (),
) -> None:
    """Write the state dict that ``init: pretrained`` starts from.

    Args:
        backbone: Name of the backbone.
        network: Input side and width.
        pretraining: Source of the weights, and length of the training that makes new ones.
        seed: Seed of the initial weights, the order of frames and their rotations.
        out_weights: State dict to write.
        frames: Packed frames of each room; none unless ``source`` is ``rooms``.
        labels: Their true poses, likewise.

    Raises:
        InputError: a file cannot be used, or the ImageNet weights cannot be had.
        MemoryError: there is too little memory.
    """
    if pretraining.source == "rooms":
        rooms = list(zip(frames, labels, strict=True))
        trained = _train_on_rooms(backbone, rooms, network, pretraining, seed, out_weights)
    else:
        trained = build_backbone(backbone, network.width)
        path = (
            shipped_weights_path(backbone)
            if pretraining.source == "shipped"
            else imagenet_weights_path(backbone, pretraining.weights_dir)
        )
        load_backbone_weights(trained, path)
    save_atomically(
        out_weights, {name: value.cpu() for name, value in trained.state_dict().items()}
    )


def _train_on_rooms(
    backbone: BackboneName,
    rooms: Sequence[tuple[Path, Path]],
    network: NetworkConfig,
    pretraining: PretrainingConfig,
    seed: int,
    out: Path,
) -> Backbone:
    device = open_device("auto")
    data = _read_rooms(rooms, network.input_px, device)
    statistics = image_statistics(data.images)
    torch.manual_seed(seed)
    student = RoomsNetwork(backbone, network.width, len(rooms))
    student.place_on(device)
    log.info("%s: %d frames of %d rooms on %s", backbone, len(data), len(rooms), device)
    identity = digest(network, pretraining, seed, student.state_dict(), statistics.mean)
    resume = ResumeFile(out.with_name(f"resume-{backbone}.pt"), identity)
    # Not Muon: ten thousand of its steps leave kernels fifteen times as long, and channels that one
    # image in a batch excites; what starts from there learns no faster than from scratch.
    fit(
        localizer=student,
        frames=data,
        statistics=statistics,
        schedule=Schedule(
            samples_seen=pretraining.samples_seen,
            batch_size=pretraining.batch_size,
            learning_rate=pretraining.learning_rate,
            weight_decay=WEIGHT_DECAY,
        ),
        seed=seed,
        protocol=LAST_WEIGHTS._replace(optimiser="adamw"),
        precision=precision_on(device, "auto"),
        augment=random_rotation(rooms[0][0], network, pretraining.augmentation, seed, device),
        resume=resume,
    )
    resume.remove()
    return student.backbone


def _read_rooms(
    rooms: Sequence[tuple[Path, Path]], input_px: int, device: torch.device
) -> LabelledFrames:
    """Read frames of all rooms; positions are relative to a room's mean, with its number as 4th."""
    sets = [read_labelled_frames(frames, labels, input_px, device) for frames, labels in rooms]
    places = [
        nn.functional.pad(some.position_m - some.position_m.mean(0), (0, 1), value=room)
        for room, some in enumerate(sets)
    ]
    return LabelledFrames(
        torch.cat([some.images for some in sets]),
        torch.cat(places),
        torch.cat([some.quat_wxyz for some in sets]),
        sets[0].path,
        torch.arange(sum(map(len, sets)), device=device),
    )
