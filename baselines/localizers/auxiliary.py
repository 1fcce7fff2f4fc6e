"""Auxiliary regressors: poses predicted on the way through an Inception network.

GoogLeNet has two classifiers on the way (Szegedy et al., CVPR 2015, section 5), whose gradients
reach its early layers. PoseNet makes regressors of them. The Synfeal authors' code has them in
PoseLSTM and PoseNet2, too; the papers of these two do not mention them.
"""

from __future__ import annotations

from torch import Tensor, nn

from baselines.localizers.backbones import scaled_channels
from baselines.localizers.backbones.googlenet import InceptionMaps
from baselines.localizers.base import PoseRegressor
from baselines.localizers.losses import PosePrediction

N_AUXILIARY_FEATURES = 1024


def auxiliary_layers(n_in: int, n_features: int, width: float) -> list[nn.Module]:
    """Make the layers of GoogLeNet's auxiliary head that precede its last one.

    Args:
        n_in: Channels of the maps (B, n_in, H, W) they are given.
        n_features: Size of the feature (B, n_features) they return.
        width: Factor on the 128 channels between.
    """
    n_conv = scaled_channels(128, width)
    return [
        nn.AdaptiveAvgPool2d(4),
        nn.Conv2d(n_in, n_conv, 1),
        nn.ReLU(),
        nn.Flatten(),
        nn.Linear(16 * n_conv, n_features),
        nn.ReLU(),
    ]


class AuxiliaryRegressor(nn.Sequential):
    """GoogLeNet's auxiliary head with a pose instead of classes: maps of 4 x 4, 1024 units."""

    def __init__(self, n_in: int, width: float, dropout: float) -> None:
        n_features = scaled_channels(N_AUXILIARY_FEATURES, width)
        super().__init__(
            *auxiliary_layers(n_in, n_features, width),
            nn.Dropout(dropout),
            PoseRegressor(n_features),
        )


class AuxiliaryPair(nn.Module):
    """Add two auxiliary regressors to a localizer; a mixin, before ``Localizer`` in its bases.

    Attributes:
        auxiliary1: Regressor on the first of the maps that branch off; None without ``auxiliary``.
        auxiliary2: Regressor on the second; None without.
    """

    auxiliary1: nn.Module | None
    auxiliary2: nn.Module | None

    def predict_on_the_way(self, maps: InceptionMaps) -> list[PosePrediction]:
        """Predict poses from the maps that branch off: two predictions, or none."""
        pairs: list[tuple[nn.Module | None, Tensor]] = [
            (self.auxiliary1, maps.auxiliary1),
            (self.auxiliary2, maps.auxiliary2),
        ]
        return [head(branch) for head, branch in pairs if head is not None]
