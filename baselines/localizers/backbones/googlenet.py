"""GoogLeNet with batch normalisation, and layers it shares with Inception v3.

Architecture: Szegedy et al., "Going deeper with convolutions", CVPR 2015, table 1; batch
normalisation after every convolution: Ioffe and Szegedy, ICML 2015. Where torchvision departs from
the papers (3x3 instead of 5x5 kernels in the third branch, 2x2 pooling before inception 5a, pooling
in ceil mode) we follow it, because its official weights only fit that network.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

import torch
from torch import Tensor, nn
from torch.nn import functional

from baselines.localizers.backbones import scaled_channels

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
        """Convolve, normalise and rectify.

        Args:
            maps: Maps (B, n_in, H, W).

        Returns:
            Maps (B, n_out, H', W'). A side S becomes S / stride if padded, rounded up; without, it
            is S - kernel + 1 that is divided.
        """
        return torch.relu_(self.normalised(maps))

    def normalised(self, maps: Tensor) -> Tensor:
        """Do what ``forward`` does, but without the ReLU."""
        normalised: Tensor = self.bn(convolved(self.conv, self.conv.weight, maps))
        return normalised


def convolved(conv: nn.Conv2d, kernels: Tensor, maps: Tensor) -> Tensor:
    """Convolve maps (B, n_in, H, W), channels last in memory, with kernels (n_out, n_in, h, w).

    Kernels of one pixel are one matrix product with all pixels, which takes less time so.

    Args:
        conv: Layer whose stride and padding are used; its own kernels are not.
        kernels: Kernels (n_out, n_in, h, w).
        maps: Maps (B, n_in, H, W), channels last in memory.
    """
    if conv.kernel_size == (1, 1) and conv.stride == (1, 1):
        pixels = functional.linear(maps.permute(0, 2, 3, 1), kernels.flatten(1))
        return pixels.permute(0, 3, 1, 2)
    return functional.conv2d(maps, kernels, None, conv.stride, conv.padding)


def side_by_side(layers: Sequence[ConvBn], maps: Tensor) -> Sequence[Tensor]:
    """Apply layers that read the same maps as one layer.

    That takes less time: layers of few channels are done sooner than they are started.

    Args:
        layers: Layers of one kernel size and stride; each keeps its own parameters and statistics.
        maps: Maps (B, n_in, H, W) that all of them read.

    Returns:
        The maps of each layer (B, n_out, H', W').
    """
    conv, norms = layers[0].conv, [layer.bn for layer in layers]
    joined = convolved(conv, torch.cat([layer.conv.weight for layer in layers]), maps)
    statistics = [running_statistics(norm) for norm in norms]
    mean, variance = (torch.cat(parts) for parts in zip(*statistics, strict=True))
    training = norms[0].training
    joined = functional.batch_norm(
        joined,
        mean,
        variance,
        weight=torch.cat([norm.weight for norm in norms]),
        bias=torch.cat([norm.bias for norm in norms]),
        training=training,
        momentum=norms[0].momentum or 0.0,
        eps=norms[0].eps,
    )
    counts = [layer.conv.out_channels for layer in layers]
    if training:
        updated = zip(torch.split(mean, counts), torch.split(variance, counts), strict=True)
        for norm, old, new in zip(norms, statistics, updated, strict=True):
            old[0].copy_(new[0])
            old[1].copy_(new[1])
            if norm.num_batches_tracked is not None:
                norm.num_batches_tracked.add_(1)
    return torch.split(torch.relu_(joined), counts, dim=1)


def running_statistics(norm: nn.BatchNorm2d) -> tuple[Tensor, Tensor]:
    """Return the mean and variance (n,) that a layer keeps for evaluation."""
    assert norm.running_mean is not None
    assert norm.running_var is not None
    return norm.running_mean, norm.running_var


class InceptionMaps(NamedTuple):
    """Feature maps: the two points where auxiliary heads branch off, and the last one."""

    auxiliary1: Tensor
    auxiliary2: Tensor
    last: Tensor


class InceptionBackbone(nn.Module):
    """GoogLeNet or Inception v3 without its classifiers.

    Attributes:
        n_aux: Channels of the maps ``auxiliary1`` and ``auxiliary2``.
        n_out: Channels of the last map.
    """

    n_aux: tuple[int, int]
    n_out: int
    input_scale: Tensor
    input_shift: Tensor

    def __init__(self) -> None:
        super().__init__()
        scale, shift = torch.tensor([INPUT_SCALE, INPUT_SHIFT]).view(2, 3, 1, 1)
        self.register_buffer("input_scale", scale, persistent=False)
        self.register_buffer("input_shift", shift, persistent=False)

    def forward(self, images: Tensor) -> InceptionMaps:
        """Compute feature maps of images (B, 3, H, W), normalised per channel."""
        return self.maps_of(torch.addcmul(self.input_shift, images, self.input_scale))

    def maps_of(self, images: Tensor) -> InceptionMaps:
        """Compute the maps of images (B, 3, H, W) scaled as the official weights expect them."""
        raise NotImplementedError


# Output channels of each block: 1x1 | 3x3 reduce, 3x3 | "5x5" reduce, "5x5" | pooling projection.
INCEPTIONS: dict[str, tuple[int, int, int, int, int, int]] = {
    "inception3a": (64, 96, 128, 16, 32, 32),
    "inception3b": (128, 128, 192, 32, 96, 64),
    "inception4a": (192, 96, 208, 16, 48, 64),
    "inception4b": (160, 112, 224, 24, 64, 64),
    "inception4c": (128, 128, 256, 24, 64, 64),
    "inception4d": (112, 144, 288, 32, 64, 64),
    "inception4e": (256, 160, 320, 32, 128, 128),
    "inception5a": (256, 160, 320, 32, 128, 128),
    "inception5b": (384, 192, 384, 48, 128, 128),
}


class Inception(nn.Module):
    """Four parallel branches, concatenated along the channels."""

    def __init__(self, n_in: int, spec: tuple[int, ...], width: float) -> None:
        super().__init__()
        one, reduce3, three, reduce5, five, pool = (scaled_channels(n, width) for n in spec)
        self.branch1 = ConvBn(n_in, one, 1)
        self.branch2 = nn.Sequential(ConvBn(n_in, reduce3, 1), ConvBn(reduce3, three, 3))
        self.branch3 = nn.Sequential(ConvBn(n_in, reduce5, 1), ConvBn(reduce5, five, 3))
        self.branch4 = nn.Sequential(nn.MaxPool2d(3, 1, 1), ConvBn(n_in, pool, 1))
        self.n_out = one + three + five + pool

    def forward(self, maps: Tensor) -> Tensor:
        """Map (B, n_in, H, W) to (B, n_out, H, W)."""
        reduce3, conv3 = (cast(ConvBn, layer) for layer in self.branch2)
        reduce5, conv5 = (cast(ConvBn, layer) for layer in self.branch3)
        one, reduced3, reduced5 = side_by_side([self.branch1, reduce3, reduce5], maps)
        branches = [one, conv3(reduced3), conv5(reduced5), self.branch4(maps)]
        return torch.cat(branches, dim=1)


class GoogLeNet(InceptionBackbone):
    """GoogLeNet without its classifiers.

    Auxiliary heads branch off where the paper has them: after ``inception4a`` and ``inception4d``
    (512 and 528 channels at width 1, stride 16). The last map is that of ``inception5b`` (1024
    channels, stride 32).
    """

    def __init__(self, width: float = 1.0) -> None:
        super().__init__()
        stem, n = scaled_channels(64, width), scaled_channels(192, width)
        self.conv1 = ConvBn(3, stem, 7, 2)
        self.conv2 = ConvBn(stem, stem, 1)
        self.conv3 = ConvBn(stem, n, 3)
        n_out: dict[str, int] = {}
        for name, spec in INCEPTIONS.items():
            block = Inception(n, spec, width)
            self.add_module(name, block)
            n = n_out[name] = block.n_out
        self.pool3 = nn.MaxPool2d(3, 2, ceil_mode=True)
        self.pool2 = nn.MaxPool2d(2, 2, ceil_mode=True)
        self.n_aux = (n_out["inception4a"], n_out["inception4d"])
        self.n_out = n

    def maps_of(self, images: Tensor) -> InceptionMaps:
        """Compute feature maps of images (B, 3, H, W) in [-1, 1]."""
        # Pooling before the ReLU is the same as after it, and leaves it a quarter of the pixels.
        maps = torch.relu_(self.pool3(self.conv1.normalised(images)))
        maps = torch.relu_(self.pool3(self.conv3.normalised(self.conv2(maps))))
        points: dict[str, Tensor] = {}
        for name in INCEPTIONS:
            if name == "inception4a":
                maps = self.pool3(maps)
            elif name == "inception5a":
                maps = self.pool2(maps)
            maps = points[name] = self.get_submodule(name)(maps)
        return InceptionMaps(points["inception4a"], points["inception4d"], points["inception5b"])
