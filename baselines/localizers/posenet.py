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
paper's layer of 2048 units between. ``auxiliary: false`` leaves the auxiliary regressors out.
"""

from __future__ import annotations

from torch import Tensor

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.auxiliary import AuxiliaryPair, AuxiliaryRegressor
from baselines.localizers.backbones.weights import build_inception
from baselines.localizers.base import Localizer, PooledRegressor, beta_loss
from baselines.localizers.losses import PosePrediction
from baselines.registry.kinds import LocalizerKind


@LocalizerKind(
    name="posenet",
    title="PoseNet",
    rank=1,
    halve_every=(60, 300),
    style={"color": "#000000", "marker": "o", "linestyle": "-"},
)
class PoseNet(AuxiliaryPair, Localizer):
    """An Inception network, a regressor at its end, two on the way, fixed weight ``beta``."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = build_inception(network.backbone, network.width)
        self.regressor = PooledRegressor(self.backbone.n_out, network.width, hyper.dropout)
        first, second = self.backbone.n_aux
        self.auxiliary1 = self.auxiliary2 = None
        if hyper.auxiliary:
            self.auxiliary1 = AuxiliaryRegressor(first, network.width, hyper.dropout)
            self.auxiliary2 = AuxiliaryRegressor(second, network.width, hyper.dropout)
        self.criterion = beta_loss(self.kind.name, hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses: the main ones, then those of the first and second auxiliary regressor."""
        maps = self.backbone(images)
        return [self.regressor(maps.last), *self.predict_on_the_way(maps)]
