"""Hourglass-Pose.

@inproceedings{melekhov2017hourglass,
  title     = {Image-based Localization using Hourglass Networks},
  author    = {Melekhov, Iaroslav and Ylioinas, Juha and Kannala, Juho and Rahtu, Esa},
  booktitle = {IEEE International Conference on Computer Vision Workshops (ICCVW)},
  year      = {2017}
}

The paper has two variants: decoder and encoder maps are summed (``skip: sum``, our default) or
concatenated (``skip: concatenation``, as in the Synfeal authors' code). Differences: batch
normalisation after the decoder's convolutions; q and -q count as the same rotation, except with
``protocol: published``. The Synfeal authors' code normalises there too, but after the rectifier,
and once more before the regressors.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.backbones import scaled_channels
from baselines.localizers.backbones.resnet import ResNet34
from baselines.localizers.base import Localizer, PoseRegressor, beta_loss
from baselines.localizers.losses import PosePrediction
from baselines.registry.kinds import LocalizerKind


class UpBlock(nn.Module):
    """Transposed convolution to the shape of an encoder map, which is then added or appended."""

    def __init__(self, n_in: int, n_encoder: int, concatenate: bool) -> None:
        super().__init__()
        self.concatenate = concatenate
        self.up = nn.ConvTranspose2d(n_in, n_encoder, 3, 2, padding=1, bias=False)
        self.bn = nn.BatchNorm2d(n_encoder)
        self.n_out = 2 * n_encoder if concatenate else n_encoder

    def forward(self, maps: Tensor, encoder: Tensor) -> Tensor:
        """Map (B, n_in, h, w) and (B, n_encoder, H, W), h = ceil(H / 2), to (B, n_out, H, W)."""
        upsampled = torch.relu_(self.bn(self.up(maps, output_size=list(encoder.shape[-2:]))))
        return torch.cat([upsampled, encoder], 1) if self.concatenate else upsampled + encoder


@LocalizerKind(
    name="hourglass",
    title="Hourglass",
    rank=3,
    backbone="resnet34",
    halve_every=(50, 500),
    style={"color": "#D55E00", "marker": "^", "linestyle": "-."},
)
class Hourglass(Localizer):
    """ResNet-34 encoder, decoder with skip connections, regressor, fixed weight ``beta``."""

    def __init__(self, network: NetworkConfig, hyper: LocalizerConfig) -> None:
        super().__init__()
        self.backbone = ResNet34(network.width)
        one, two, three, four = self.backbone.n_stages
        concatenate = hyper.skip == "concatenation"
        self.up3 = UpBlock(four, three, concatenate)
        self.up2 = UpBlock(self.up3.n_out, two, concatenate)
        self.up1 = UpBlock(self.up2.n_out, one, concatenate)
        n_maps = scaled_channels(32, network.width)
        n_features = scaled_channels(1024, network.width)
        side = -(-network.input_px // 4)  # layer1 has stride 4, rounded up
        self.regressor = nn.Sequential(
            nn.Conv2d(self.up1.n_out, n_maps, 3, padding=1, bias=False),
            nn.BatchNorm2d(n_maps),
            nn.ReLU(),
            nn.Flatten(),
            nn.Linear(n_maps * side * side, n_features),
            nn.ReLU(),
            nn.Dropout(hyper.dropout),
            PoseRegressor(n_features),
        )
        self.criterion = beta_loss(self.kind.name, hyper)

    def forward(self, images: Tensor) -> list[PosePrediction]:
        """Predict poses of normalised images (B, 3, H, W): one prediction."""
        layer1, layer2, layer3, layer4 = self.backbone(images)
        maps = self.up3(layer4, layer3)
        maps = self.up2(maps, layer2)
        return [self.regressor(self.up1(maps, layer1))]
