"""A small scene-coordinate network: for every fourth pixel of an image, the point in the world.

The architecture is that of DSAC* in its small form (Brachmann and Rother, PAMI 2021: 4 MB of
weights), in colour, with one stride less, since images here have 66 rows and not 480: half an image
is what one cell sees in both.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from baselines.localizers.heads import OutputLayer

CHANNELS = 128


class _Convolution(nn.Sequential):
    """A convolution that keeps the size or halves it, and ReLU."""

    def __init__(self, n_in: int, n_out: int, kernel: int, stride: int = 1) -> None:
        super().__init__(nn.Conv2d(n_in, n_out, kernel, stride, kernel // 2), nn.ReLU(inplace=True))


class _Residual(nn.Module):
    """Three convolutions of these kernels, added to what they are given."""

    def __init__(self, *kernels: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(*(_Convolution(CHANNELS, CHANNELS, k) for k in kernels))

    def forward(self, x: Tensor) -> Tensor:
        """Maps (B, 128, R, C)."""
        out: Tensor = x + self.layers(x)
        return out


class _Coordinates(OutputLayer):
    """The last linear map, in float32: bfloat16 rounds coordinates to centimetres."""

    def __init__(self) -> None:
        super().__init__()
        self.linear = nn.Conv2d(CHANNELS, 3, 1)

    def forward(self, x: Tensor) -> Tensor:
        with torch.autocast(x.device.type, enabled=False):
            out: Tensor = self.linear(x.float())
        return out


class CoordinateNetwork(nn.Module):
    """Points (B, 3, R, C) in metres, around a mean, of images (B, 3, h, w) at rest."""

    mean_m: Tensor

    def __init__(self, mean_m: Tensor) -> None:
        super().__init__()
        out = _Coordinates()
        self.layers = nn.Sequential(
            _Convolution(3, 32, 3),
            _Convolution(32, 64, 3, 2),
            _Convolution(64, CHANNELS, 3, 2),
            _Convolution(CHANNELS, CHANNELS, 3),
            _Residual(3, 1, 3),
            _Residual(3, 1, 3),
            _Residual(1, 1, 1),
            _Convolution(CHANNELS, CHANNELS, 1),
            _Convolution(CHANNELS, CHANNELS, 1),
            out,
        )
        self.register_buffer("mean_m", mean_m.view(1, 3, 1, 1))
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, nonlinearity="relu")
                nn.init.zeros_(module.bias)  # type: ignore[arg-type]
        nn.init.zeros_(out.linear.weight)  # the mean at first, not points outside the room

    def forward(self, images: Tensor) -> Tensor:
        """Of normalised images."""
        out: Tensor = self.layers(images) + self.mean_m
        return out


def distance_m(found: Tensor, wanted: Tensor) -> Tensor:
    """Mean distance between points (B, 3, R, C), where the wanted one is known."""
    known = wanted.isfinite().all(dim=1)
    off = torch.where(known[:, None], found - wanted, 0.0)
    mean: Tensor = torch.linalg.vector_norm(off, dim=1)[known].mean()
    return mean
