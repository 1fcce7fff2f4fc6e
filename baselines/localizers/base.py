"""Base class of the localizers, and the regressors that turn feature maps into poses."""

from __future__ import annotations

from contextlib import nullcontext
from typing import ClassVar

import torch
from torch import Tensor, nn

from baselines.config.learning import LocalizerConfig
from baselines.localizers.backbones import scaled_channels
from baselines.localizers.losses import BetaLoss, LearnedWeightLoss, PoseLoss, PosePrediction
from baselines.registry.kinds import LocalizerKind
from synfeal.errors import InputError

# Width of the localisation feature of PoseNet and its successors.
N_FEATURES = 2048


class OutputLayer(nn.Module):
    """Layer that predicts; every layer before it is hidden. Optimisers tell the two apart."""


class PoseRegressor(OutputLayer):
    """Two linear maps from a feature (B, n_in) to position and quaternion."""

    def __init__(self, n_in: int) -> None:
        super().__init__()
        self.position = nn.Linear(n_in, 3)
        self.quat = nn.Linear(n_in, 4)

    def forward(self, features: Tensor) -> PosePrediction:
        """Regress poses from features (B, n_in), in float32: bfloat16 rounds positions to 1 cm."""
        device = features.device.type
        mixed = torch.amp.is_autocast_available(device)  # not on "meta", where shapes are planned
        with torch.autocast(device, enabled=False) if mixed else nullcontext():
            return PosePrediction(self.position(features.float()), self.quat(features.float()))


class PooledFeature(nn.Sequential):
    """Global average pooling, a fully connected layer of 2048 units times the width, ReLU."""

    def __init__(self, n_in: int, width: float) -> None:
        self.n_out = scaled_channels(N_FEATURES, width)
        super().__init__(
            nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(n_in, self.n_out), nn.ReLU()
        )


class PooledRegressor(nn.Sequential):
    """PoseNet's regressor: pooled feature, dropout, pose."""

    def __init__(self, n_in: int, width: float, dropout: float) -> None:
        feature = PooledFeature(n_in, width)
        super().__init__(feature, nn.Dropout(dropout), PoseRegressor(feature.n_out))


# Weight of each auxiliary prediction in the loss (Szegedy et al., CVPR 2015, section 5).
AUXILIARY_WEIGHT = 0.3


class Localizer(nn.Module):
    """A network from images to poses with its own loss.

    Attributes:
        kind: Declaration of the class.
        backbone: Part that may start from pretrained weights. It returns maps (B, C, h, w) or
            features (B, F), or several of them with the last ones last.
        criterion: Loss of one prediction; its parameters, if any, are trained with the network.
    """

    kind: ClassVar[LocalizerKind]
    backbone: nn.Module
    criterion: PoseLoss

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses of normalised images (B, 3, H, W): the main one, then auxiliary ones."""
        raise NotImplementedError

    def loss(
        self, predictions: list[PosePrediction], position_m: Tensor, quat_wxyz: Tensor
    ) -> Tensor:
        """Compute the loss of the main prediction plus 0.3 times that of each auxiliary one.

        Args:
            predictions: What the network returned: the main prediction, then auxiliary ones.
            position_m: True positions (B, 3), metres.
            quat_wxyz: True rotations (B, 4), unit quaternions.

        Returns:
            A scalar.
        """
        main, *auxiliary = (self.criterion(p, position_m, quat_wxyz) for p in predictions)
        return torch.as_tensor(main + AUXILIARY_WEIGHT * sum(auxiliary))

    def place_on(self, device: torch.device) -> None:
        """Move to a device, channels last in memory as the frames are."""
        self.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]

    @torch.no_grad()
    def set_pose_prior(self, mean_position_m: Tensor) -> None:
        """Let every regressor start at the mean training position (3,).

        Otherwise part of a short training is spent on finding the room.
        """
        for module in self.modules():
            if isinstance(module, PoseRegressor):
                module.position.bias.copy_(mean_position_m)


def beta_loss(name: str, hyper: LocalizerConfig) -> BetaLoss:
    """Make the loss with a fixed weight.

    Raises:
        InputError: the configuration gives no ``beta``.
    """
    if hyper.beta is None:
        raise InputError(
            f"localizers.{name}.beta", f"must be given, {name} weighs orientation by it"
        )
    return BetaLoss(hyper.beta)


def learned_loss(hyper: LocalizerConfig) -> LearnedWeightLoss:
    """Make the loss with learned weights."""
    return LearnedWeightLoss(hyper.s_position, hyper.s_orientation)
