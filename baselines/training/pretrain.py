"""Weights that pretrained backbones start from: ImageNet's, or those of a pretext task.

The pretext is camera localization itself, in a room that no experiment uses: where ImageNet cannot
be downloaded, or no published weights fit a narrow network, it teaches features that carry over.
"""

from __future__ import annotations

import logging
from pathlib import Path

import torch
from torch import Tensor

from baselines.localizers.backbones.weights import (
    Backbone,
    build_backbone,
    imagenet_weights_path,
    load_backbone_weights,
)
from baselines.localizers.base import Localizer
from baselines.localizers.heads import PooledRegressor
from baselines.localizers.losses import LearnedWeightLoss, PosePrediction
from baselines.localizers.names import BackboneName
from baselines.training.checkpoint import save_atomically
from baselines.training.data import image_statistics, read_labelled_frames
from baselines.training.device import memory_errors, open_device
from baselines.training.fit import fit
from baselines.training.optimizer import Schedule
from baselines.training.rotation import random_rotation
from synfeal.config.models import NetworkConfig, PretrainingConfig

log = logging.getLogger(__name__)

WEIGHT_DECAY = 1e-4


class PretextLocalizer(Localizer):
    """A backbone, one regressor without dropout, learned weights."""

    backbone: Backbone

    def __init__(self, backbone: BackboneName, width: float) -> None:
        super().__init__()
        self.backbone = build_backbone(backbone, width)
        self.regressor = PooledRegressor(self.backbone.n_out, width, dropout=0.0)
        self.criterion = LearnedWeightLoss(s_position=0.0, s_orientation=-1.0)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """One prediction."""
        return [self.regressor(self.backbone(images)[-1])]


@memory_errors()
def pretrain_backbone(
    backbone: BackboneName,
    frames: Path | None,
    labels: Path | None,
    network: NetworkConfig,
    pretraining: PretrainingConfig,
    seed: int,
    out: Path,
) -> None:
    """Write the state dict that ``init: pretrained`` starts from.

    Args:
        backbone: which one.
        frames: packed frames of the pretext scene; None with ``source: imagenet``.
        labels: their true poses; None with ``source: imagenet``.
        network: input side and width.
        pretraining: where the weights come from and how long the pretext is trained.
        seed: of the pretext's initial weights and order of frames.
        out: state dict to write.

    Raises:
        InputError: a file cannot be used, or the ImageNet weights cannot be had.
        MemoryError: there is too little memory.
    """
    if frames is None or labels is None:
        trained = build_backbone(backbone, network.width)
        load_backbone_weights(trained, imagenet_weights_path(backbone, pretraining.weights_dir))
    else:
        trained = _train_pretext(backbone, frames, labels, network, pretraining, seed)
    save_atomically(out, {name: value.cpu() for name, value in trained.state_dict().items()})


def _train_pretext(
    backbone: BackboneName,
    frames: Path,
    labels: Path,
    network: NetworkConfig,
    pretraining: PretrainingConfig,
    seed: int,
) -> Backbone:
    device = open_device("auto")
    data = read_labelled_frames(frames, labels, network.input_px, device)
    torch.manual_seed(seed)
    localizer = PretextLocalizer(backbone, network.width)
    localizer.place_on(device)
    localizer.set_pose_prior(data.position_m.mean(0))
    log.info("%s: %d frames of the pretext on %s", backbone, len(data), device)
    schedule = Schedule(
        pretraining.samples_seen, pretraining.batch_size, pretraining.learning_rate, WEIGHT_DECAY
    )
    augment = random_rotation(frames, network.input_px, pretraining.augmentation, seed)
    fit(localizer, data, image_statistics(data.images), schedule, seed, augment=augment)
    return localizer.backbone
