"""PoseNet2ResNet: PoseNet2 on ResNet-34, the variant that Synfeal adds to the comparison.

The loss is the one of

@inproceedings{kendall2017geometric,
  title     = {Geometric Loss Functions for Camera Pose Regression with Deep Learning},
  author    = {Kendall, Alex and Cipolla, Roberto},
  booktitle = {IEEE Conference on Computer Vision and Pattern Recognition (CVPR)},
  year      = {2017}
}

Differences: those of ``posenet2``, and the backbone. The Synfeal authors' code has the same layers.
"""

from __future__ import annotations

from torch import Tensor

from baselines.localizers.backbones.resnet import ResNet34
from baselines.localizers.base import Localizer, learned_loss
from baselines.localizers.heads import PooledRegressor
from baselines.localizers.losses import PosePrediction
from synfeal.config.models import LocalizerConfig, NetworkConfig


class PoseNet2ResNet(Localizer):
    """ResNet-34, one regressor, learned weights."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = ResNet34(network.width)
        self.regressor = PooledRegressor(self.backbone.n_out, network.width, hyper.dropout)
        self.criterion = learned_loss(hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """One prediction."""
        return [self.regressor(self.backbone(images).layer4)]
