"""What all localizers have in common."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from baselines.localizers.heads import PoseRegressor
from baselines.localizers.losses import BetaLoss, LearnedWeightLoss, PoseLoss, PosePrediction
from synfeal.config.models import LocalizerConfig
from synfeal.errors import InputError

# Weight of each auxiliary prediction in the loss (Szegedy et al., CVPR 2015, section 5).
AUXILIARY_WEIGHT = 0.3


class Localizer(nn.Module):
    """A network from images to poses with its own loss."""

    backbone: nn.Module  # the part that may start from pretrained weights
    # loss of one prediction; its parameters, if any, are trained with the network
    criterion: PoseLoss

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predictions for normalised images (B, 3, H, W): the main one, then auxiliary ones."""
        raise NotImplementedError

    def loss(
        self, predictions: list[PosePrediction], position_m: Tensor, quat_wxyz: Tensor
    ) -> Tensor:
        """Loss of the main prediction plus 0.3 times that of each auxiliary one."""
        main, *auxiliary = (self.criterion(p, position_m, quat_wxyz) for p in predictions)
        return torch.as_tensor(main + AUXILIARY_WEIGHT * sum(auxiliary))

    def place_on(self, device: torch.device) -> None:
        """Move to a device, channels last in memory as the frames are."""
        self.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]

    def set_pose_prior(self, mean_position_m: Tensor) -> None:
        """Let every regressor start at the mean training position (3,).

        Otherwise part of a short training is spent on finding the room.
        """
        for module in self.modules():
            if isinstance(module, PoseRegressor):
                module.set_mean_position(mean_position_m)


def beta_loss(name: str, hyper: LocalizerConfig) -> BetaLoss:
    """The loss with a fixed weight.

    Raises:
        InputError: the configuration gives no ``beta``.
    """
    if hyper.beta is None:
        raise InputError(f"localizers.{name}.beta: must be given, {name} weighs orientation by it")
    return BetaLoss(hyper.beta)


def learned_loss(hyper: LocalizerConfig) -> LearnedWeightLoss:
    """The loss with learned weights."""
    return LearnedWeightLoss(hyper.s_position, hyper.s_orientation)
