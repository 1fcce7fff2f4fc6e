"""PoseNet.

@inproceedings{kendall2015posenet,
  title     = {{PoseNet}: A Convolutional Network for Real-Time 6-{DOF} Camera Relocalization},
  author    = {Kendall, Alex and Grimes, Matthew and Cipolla, Roberto},
  booktitle = {IEEE International Conference on Computer Vision (ICCV)},
  year      = {2015}
}

Differences from the paper: batch normalisation in the backbone; q and -q count as the same
rotation.
"""

from __future__ import annotations

from torch import Tensor, nn

from baselines.localizers.backbones.channels import scaled_channels
from baselines.localizers.backbones.googlenet import GoogLeNet
from baselines.localizers.base import Localizer, beta_loss
from baselines.localizers.heads import PooledRegressor, PoseRegressor
from baselines.localizers.losses import PosePrediction
from synfeal.config.models import LocalizerConfig, NetworkConfig


class AuxiliaryRegressor(nn.Sequential):
    """GoogLeNet's auxiliary head with a pose instead of classes."""

    def __init__(self, n_in: int, width: float, dropout: float) -> None:
        n_conv, n_features = scaled_channels(128, width), scaled_channels(1024, width)
        super().__init__(
            nn.AdaptiveAvgPool2d(4),
            nn.Conv2d(n_in, n_conv, 1),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(16 * n_conv, n_features),
            nn.ReLU(),
            nn.Dropout(dropout),
            PoseRegressor(n_features),
        )


class PoseNet(Localizer):
    """GoogLeNet, one regressor at its end and two auxiliary ones, fixed weight ``beta``."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = GoogLeNet(network.width)
        first, second = self.backbone.n_aux
        self.regressor = PooledRegressor(self.backbone.n_out, network.width, hyper.dropout)
        self.auxiliary1 = AuxiliaryRegressor(first, network.width, hyper.dropout)
        self.auxiliary2 = AuxiliaryRegressor(second, network.width, hyper.dropout)
        self.criterion = beta_loss("posenet", hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Main prediction, then those of the first and second auxiliary regressor."""
        maps = self.backbone(images)
        return [
            self.regressor(maps.inception5b),
            self.auxiliary1(maps.inception4a),
            self.auxiliary2(maps.inception4d),
        ]
