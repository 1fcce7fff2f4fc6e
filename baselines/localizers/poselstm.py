r"""PoseLSTM.

@inproceedings{walch2017poselstm,
  title     = {Image-based Localization using {LSTMs} for Structured Feature Correlation},
  author    = {Walch, Florian and Hazirbas, Caner and Leal-Taix{\'e}, Laura and Sattler, Torsten
               and Hilsenbeck, Sebastian and Cremers, Daniel},
  booktitle = {IEEE International Conference on Computer Vision (ICCV)},
  year      = {2017}
}

Differences from the paper: batch normalisation in the backbone; hidden states of 128 units per
direction, as in the Synfeal authors' code, where PoseLSTM's own code has 256; q and -q count as the
same rotation, except with ``protocol: published``; two auxiliary regressors with LSTMs of their
own, as in the Synfeal authors' code, which ``auxiliary: false`` leaves out. That code reads the
pooled maps of Inception v3 without the paper's layer before.
At a width below 1 the feature's two sides and the hidden states shrink with its square root.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.auxiliary import AuxiliaryPair, auxiliary_layers
from baselines.localizers.backbones import scaled_channels
from baselines.localizers.backbones.weights import build_inception
from baselines.localizers.base import Localizer, PoseRegressor, beta_loss
from baselines.localizers.losses import PosePrediction
from baselines.registry.kinds import LocalizerKind

ROWS, COLUMNS, HIDDEN = 32, 64, 128


class FourDirectionLstm(nn.Module):
    """Reads a feature, laid out as a matrix, in four directions; joins the four last states."""

    def __init__(self, rows: int, columns: int, hidden: int) -> None:
        super().__init__()
        self.shape = (rows, columns)
        self.vertical = nn.LSTM(columns, hidden, bidirectional=True)
        self.horizontal = nn.LSTM(rows, hidden, bidirectional=True)
        self.n_out = 4 * hidden

    def forward(self, features: Tensor) -> Tensor:
        """Map (B, rows * columns) to (B, 4 * hidden)."""
        matrix = features.view(-1, *self.shape)
        _, (vertical, _) = self.vertical(matrix.transpose(0, 1))  # steps: rows
        _, (horizontal, _) = self.horizontal(matrix.permute(2, 0, 1))  # steps: columns
        return torch.cat([*vertical, *horizontal], dim=1)


@LocalizerKind(
    name="poselstm",
    title="PoseLSTM",
    rank=2,
    halve_every=(150, 500),
    style={"color": "#0072B2", "marker": "s", "linestyle": "--"},
)
class PoseLstm(AuxiliaryPair, Localizer):
    """An Inception network, its features reduced by LSTMs in four directions, weight ``beta``."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        side = math.sqrt(network.width)
        rows, columns = scaled_channels(ROWS, side), scaled_channels(COLUMNS, side)
        self.backbone = build_inception(network.backbone, network.width)
        self.feature = nn.Sequential(
            nn.AdaptiveAvgPool2d(1),
            nn.Flatten(),
            nn.Linear(self.backbone.n_out, rows * columns),
            nn.ReLU(),
        )
        hidden = scaled_channels(HIDDEN, side)
        self.lstm = FourDirectionLstm(rows, columns, hidden)
        self.regressor = nn.Sequential(nn.Dropout(hyper.dropout), PoseRegressor(self.lstm.n_out))
        self.auxiliary1 = self.auxiliary2 = None
        if hyper.auxiliary:
            self.auxiliary1, self.auxiliary2 = (
                nn.Sequential(
                    *auxiliary_layers(n_in, rows * columns, network.width),
                    FourDirectionLstm(rows, columns, hidden),
                    nn.Dropout(hyper.dropout),
                    PoseRegressor(4 * hidden),
                )
                for n_in in self.backbone.n_aux
            )
        self.criterion = beta_loss(self.kind.name, hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses: the main ones, then those of the first and second auxiliary regressor."""
        maps = self.backbone(images)
        main = self.regressor(self.lstm(self.feature(maps.last)))
        return [main, *self.predict_on_the_way(maps)]
