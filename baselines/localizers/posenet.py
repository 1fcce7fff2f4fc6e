"""PoseNet.

@inproceedings{kendall2015posenet,
  title     = {{PoseNet}: A Convolutional Network for Real-Time 6-{DOF} Camera Relocalization},
  author    = {Kendall, Alex and Grimes, Matthew and Cipolla, Roberto},
  booktitle = {IEEE International Conference on Computer Vision (ICCV)},
  year      = {2015}
}

Differences from the paper: batch normalisation in the backbone; one rate of dropout for all three
regressors; q and -q count as the same rotation, except with ``protocol: published``. On Inception
v3 the auxiliary regressors keep the size they have on GoogLeNet; the Synfeal authors' code makes
them larger (maps of 5 x 5, 2048 units) and predicts the main pose from the pooled maps, without the
paper's layer of 2048 units between.
"""

from __future__ import annotations

from torch import Tensor, nn

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.backbones import scaled_channels
from baselines.localizers.backbones.weights import build_inception
from baselines.localizers.base import Localizer, PooledRegressor, PoseRegressor, beta_loss
from baselines.localizers.losses import PosePrediction
from baselines.registry.kinds import LocalizerKind


class AuxiliaryRegressor(nn.Sequential):
    """GoogLeNet's auxiliary head with a pose instead of classes: maps of 4 x 4, 1024 units."""

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


@LocalizerKind(
    name="posenet",
    title="PoseNet",
    rank=1,
    halve_every=(60, 300),
    style={"color": "#000000", "marker": "o", "linestyle": "-"},
)
class PoseNet(Localizer):
    """An Inception network, a regressor at its end, two on the way, fixed weight ``beta``."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = build_inception(network.backbone, network.width)
        first, second = self.backbone.n_aux
        self.regressor = PooledRegressor(self.backbone.n_out, network.width, hyper.dropout)
        self.auxiliary1 = AuxiliaryRegressor(first, network.width, hyper.dropout)
        self.auxiliary2 = AuxiliaryRegressor(second, network.width, hyper.dropout)
        self.criterion = beta_loss(self.kind.name, hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses: the main ones, then those of the first and second auxiliary regressor."""
        maps = self.backbone(images)
        return [
            self.regressor(maps.last),
            self.auxiliary1(maps.auxiliary1),
            self.auxiliary2(maps.auxiliary2),
        ]
