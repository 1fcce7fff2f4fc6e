"""ResNet-34: He et al., "Deep residual learning for image recognition", CVPR 2016, table 1."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from baselines.localizers.backbones import scaled_channels


class BasicBlock(nn.Module):
    """Two 3x3 convolutions beside a shortcut, which is projected where the shape changes."""

    def __init__(self, n_in: int, n_out: int, stride: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(n_in, n_out, 3, stride, padding=1, bias=False)
        self.bn1 = nn.BatchNorm2d(n_out)
        self.conv2 = nn.Conv2d(n_out, n_out, 3, padding=1, bias=False)
        self.bn2 = nn.BatchNorm2d(n_out)
        self.downsample: nn.Sequential | None = None
        if stride != 1 or n_in != n_out:
            self.downsample = nn.Sequential(
                nn.Conv2d(n_in, n_out, 1, stride, bias=False), nn.BatchNorm2d(n_out)
            )

    def forward(self, maps: Tensor) -> Tensor:
        """Map (B, n_in, H, W) to (B, n_out, ceil(H / stride), ceil(W / stride))."""
        shortcut = maps if self.downsample is None else self.downsample(maps)
        maps = torch.relu_(self.bn1(self.conv1(maps)))
        return torch.relu_(self.bn2(self.conv2(maps)) + shortcut)


class ResNetMaps(NamedTuple):
    """Feature maps of the four stages, with strides 4, 8, 16 and 32."""

    layer1: Tensor
    layer2: Tensor
    layer3: Tensor
    layer4: Tensor


class ResNet34(nn.Module):
    """ResNet-34 without its classifier."""

    def __init__(self, width: float = 1.0) -> None:
        super().__init__()
        one, two, three, four = (scaled_channels(n, width) for n in (64, 128, 256, 512))
        self.conv1 = nn.Conv2d(3, one, 7, 2, padding=3, bias=False)
        self.bn1 = nn.BatchNorm2d(one)
        self.maxpool = nn.MaxPool2d(3, 2, padding=1)
        self.layer1 = _stage(one, one, 3, 1)
        self.layer2 = _stage(one, two, 4, 2)
        self.layer3 = _stage(two, three, 6, 2)
        self.layer4 = _stage(three, four, 3, 2)
        self.n_stages = (one, two, three, four)  # channels
        self.n_out = four  # channels of the last stage
        for module in self.modules():
            if isinstance(module, nn.Conv2d):  # He initialisation, as in the paper
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")

    def forward(self, images: Tensor) -> ResNetMaps:
        """Compute feature maps of normalised images (B, 3, H, W)."""
        # Pooling before the ReLU is the same as after it, and leaves it a quarter of the pixels.
        layer1 = self.layer1(torch.relu_(self.maxpool(self.bn1(self.conv1(images)))))
        layer2 = self.layer2(layer1)
        layer3 = self.layer3(layer2)
        return ResNetMaps(layer1, layer2, layer3, self.layer4(layer3))


def _stage(n_in: int, n_out: int, blocks: int, stride: int) -> nn.Sequential:
    """Build basic blocks of which the first changes the resolution and the channels."""
    first = BasicBlock(n_in, n_out, stride)
    return nn.Sequential(first, *(BasicBlock(n_out, n_out, 1) for _ in range(blocks - 1)))
