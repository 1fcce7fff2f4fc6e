"""PoseNet2: PoseNet with learned weights of position and orientation.

@inproceedings{kendall2017geometric,
  title     = {Geometric Loss Functions for Camera Pose Regression with Deep Learning},
  author    = {Kendall, Alex and Cipolla, Roberto},
  booktitle = {IEEE Conference on Computer Vision and Pattern Recognition (CVPR)},
  year      = {2017}
}

The weights start at ``s_position`` and ``s_orientation``, by default at the paper's 0 and -3.
Differences from the paper: batch normalisation in the backbone; Euclidean norms, where the paper
found L1 norms slightly better; the predicted quaternion is not normalised (``quat_distance`` says
why), and q and -q count as the same rotation, except with ``protocol: published``; no fine-tuning
on reprojection errors, as in Synfeal; PoseNet's two auxiliary regressors, as in the Synfeal
authors' code, which ``auxiliary: false`` leaves out.
"""

from __future__ import annotations

from torch import Tensor

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.auxiliary import AuxiliaryPair, AuxiliaryRegressor
from baselines.localizers.backbones.resnet import ResNet34
from baselines.localizers.backbones.weights import build_inception
from baselines.localizers.base import Localizer, PooledRegressor, learned_loss
from baselines.localizers.losses import PosePrediction
from baselines.registry.kinds import LocalizerKind


@LocalizerKind(
    name="posenet2",
    title="PoseNet2",
    rank=5,
    halve_every=(150, 300),
    style={"color": "#CC79A7", "marker": "v", "linestyle": (0, (5, 1, 1, 1, 1, 1))},
)
class PoseNet2(AuxiliaryPair, Localizer):
    """An Inception network, a regressor at its end, two on the way, learned weights."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = build_inception(network.backbone, network.width)
        self.regressor = PooledRegressor(self.backbone.n_out, network.width, hyper.dropout)
        first, second = self.backbone.n_aux
        self.auxiliary1 = self.auxiliary2 = None
        if hyper.auxiliary:
            self.auxiliary1 = AuxiliaryRegressor(first, network.width, hyper.dropout)
            self.auxiliary2 = AuxiliaryRegressor(second, network.width, hyper.dropout)
        self.criterion = learned_loss(hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses: the main ones, then those of the first and second auxiliary regressor."""
        maps = self.backbone(images)
        return [self.regressor(maps.last), *self.predict_on_the_way(maps)]


@LocalizerKind(
    name="posenet2resnet",
    title="PoseNet2ResNet",
    rank=4,
    backbone="resnet34",
    halve_every=(150, 400),
    style={"color": "#009E73", "marker": "D", "linestyle": ":"},
)
class PoseNet2ResNet(Localizer):
    """The same on ResNet-34, the variant that Synfeal adds to the comparison.

    The Synfeal authors' code has the same layers.
    """

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = ResNet34(network.width)
        self.regressor = PooledRegressor(self.backbone.n_out, network.width, hyper.dropout)
        self.criterion = learned_loss(hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses of normalised images (B, 3, H, W): one prediction."""
        return [self.regressor(self.backbone(images).layer4)]
