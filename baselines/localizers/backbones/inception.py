"""What GoogLeNet and Inception v3 have in common, and what localizers use of either."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

# The official weights of both were trained on images scaled to [-1, 1]. This turns images
# normalised with ImageNet's mean (0.485, 0.456, 0.406) and deviation (0.229, 0.224, 0.225) into
# those.
INPUT_SCALE = (0.458, 0.448, 0.450)
INPUT_SHIFT = (-0.030, -0.088, -0.188)


class ConvBn(nn.Module):
    """Convolution without bias, batch normalisation, ReLU."""

    def __init__(
        self,
        n_in: int,
        n_out: int,
        kernel: int | tuple[int, int],
        stride: int = 1,
        padded: bool = True,
    ) -> None:
        super().__init__()
        rows, columns = (kernel, kernel) if isinstance(kernel, int) else kernel
        padding = (rows // 2, columns // 2) if padded else (0, 0)
        self.conv = nn.Conv2d(n_in, n_out, (rows, columns), stride, padding, bias=False)
        self.bn = nn.BatchNorm2d(n_out, eps=0.001)

    def forward(self, maps: Tensor) -> Tensor:
        """(B, n_in, H, W) to (B, n_out, ceil(H / stride), ceil(W / stride)); less if unpadded."""
        return torch.relu_(self.bn(self.conv(maps)))


class InceptionMaps(NamedTuple):
    """Feature maps: the two points where auxiliary heads branch off, and the last one."""

    auxiliary1: Tensor
    auxiliary2: Tensor
    last: Tensor


class InceptionBackbone(nn.Module):
    """GoogLeNet or Inception v3 without its classifiers."""

    n_aux: tuple[int, int]  # channels of the maps ``auxiliary1`` and ``auxiliary2``
    n_out: int  # channels of the last map
    input_scale: Tensor
    input_shift: Tensor

    def __init__(self) -> None:
        super().__init__()
        scale, shift = torch.tensor([INPUT_SCALE, INPUT_SHIFT]).view(2, 3, 1, 1)
        self.register_buffer("input_scale", scale, persistent=False)
        self.register_buffer("input_shift", shift, persistent=False)

    def forward(self, images: Tensor) -> InceptionMaps:
        """Feature maps of images (B, 3, H, W) of zero mean and unit deviation per channel."""
        return self.maps_of(images * self.input_scale + self.input_shift)

    def maps_of(self, images: Tensor) -> InceptionMaps:
        """Feature maps of images (B, 3, H, W) scaled as the official weights expect them."""
        raise NotImplementedError
