"""Inception v3, on which the Synfeal authors' code builds what its papers build on GoogLeNet.

Szegedy et al., "Rethinking the Inception architecture for computer vision", CVPR 2016, table 1 and
figures 5, 6, 7 and 10. Where torchvision departs from the paper (a 5x5 kernel in one branch of the
35-pixel blocks) we follow it, because its official weights only fit that network. Three layers of
the stem and all reductions are not padded: an image needs 75 pixels a side for the last map to
have one.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from baselines.localizers.backbones import scaled_channels
from baselines.localizers.backbones.googlenet import ConvBn, InceptionBackbone, InceptionMaps


class Conv(NamedTuple):
    """A convolution of a block; one of stride 2 is not padded."""

    name: str
    n_out: int
    kernel: tuple[int, int]
    stride: int


class Branch(NamedTuple):
    """Steps one after the other; the convolutions of one step stand side by side.

    Attributes:
        pool: ``average``, ``maximum`` or none.
    """

    pool: str
    steps: list[list[Conv]]


# A line is a branch; commas separate its steps. A convolution is its name, channels, rows x columns
# of its kernel, and /2 where it halves the resolution; those joined by & read the same maps.
# Figure 5: 5x5 beside two 3x3.
BLOCK_35 = """
    branch1x1 64 1x1
    branch5x5_1 48 1x1, branch5x5_2 64 5x5
    branch3x3dbl_1 64 1x1, branch3x3dbl_2 96 3x3, branch3x3dbl_3 96 3x3
    average, branch_pool {n} 1x1"""
# Figure 6: 7x7 as 1x7 and 7x1.
BLOCK_17 = """
    branch1x1 192 1x1
    branch7x7_1 {n} 1x1, branch7x7_2 {n} 1x7, branch7x7_3 192 7x1
    branch7x7dbl_1 {n} 1x1, branch7x7dbl_2 {n} 7x1, branch7x7dbl_3 {n} 1x7, \
        branch7x7dbl_4 {n} 7x1, branch7x7dbl_5 192 1x7
    average, branch_pool 192 1x1"""
# Figure 7: 3x3 as 1x3 beside 3x1.
BLOCK_8 = """
    branch1x1 320 1x1
    branch3x3_1 384 1x1, branch3x3_2a 384 1x3 & branch3x3_2b 384 3x1
    branch3x3dbl_1 448 1x1, branch3x3dbl_2 384 3x3, \
        branch3x3dbl_3a 384 1x3 & branch3x3dbl_3b 384 3x1
    average, branch_pool 192 1x1"""
# Figure 10: half the resolution, by convolutions and by pooling.
REDUCTION_17 = """
    branch3x3 384 3x3/2
    branch3x3dbl_1 64 1x1, branch3x3dbl_2 96 3x3, branch3x3dbl_3 96 3x3/2
    maximum"""
REDUCTION_8 = """
    branch3x3_1 192 1x1, branch3x3_2 320 3x3/2
    branch7x7x3_1 192 1x1, branch7x7x3_2 192 1x7, branch7x7x3_3 192 7x1, branch7x7x3_4 192 3x3/2
    maximum"""

BLOCKS = {
    "Mixed_5b": BLOCK_35.format(n=32),
    "Mixed_5c": BLOCK_35.format(n=64),
    "Mixed_5d": BLOCK_35.format(n=64),
    "Mixed_6a": REDUCTION_17,
    "Mixed_6b": BLOCK_17.format(n=128),
    "Mixed_6c": BLOCK_17.format(n=160),
    "Mixed_6d": BLOCK_17.format(n=160),
    "Mixed_6e": BLOCK_17.format(n=192),
    "Mixed_7a": REDUCTION_8,
    "Mixed_7b": BLOCK_8,
    "Mixed_7c": BLOCK_8,
}


def branches_of(block: str) -> list[Branch]:
    """Build the branches of a block that is written as above."""
    branches = []
    for line in block.strip().splitlines():
        steps = [[step.split() for step in part.split("&")] for part in line.split(",")]
        pool = steps.pop(0)[0][0] if len(steps[0][0]) == 1 else ""
        branches.append(Branch(pool, [[_conv(*cells) for cells in step] for step in steps]))
    return branches


def _conv(name: str, n_out: str, kernel: str) -> Conv:
    size, _, stride = kernel.partition("/")
    rows, columns = map(int, size.split("x"))
    return Conv(name, int(n_out), (rows, columns), int(stride or 1))


class Mixed(nn.Module):
    """Parallel branches, concatenated along the channels."""

    def __init__(self, n_in: int, block: str, width: float) -> None:
        super().__init__()
        self.branches = branches_of(block)
        self.n_out = sum(self._add(branch, n_in, width) for branch in self.branches)

    def _add(self, branch: Branch, n: int, width: float) -> int:
        """Add the convolutions of a branch, and return the number of channels it puts out."""
        for step in branch.steps:
            n_out = [scaled_channels(conv.n_out, width) for conv in step]
            for conv, channels in zip(step, n_out, strict=True):
                layer = ConvBn(n, channels, conv.kernel, conv.stride, padded=conv.stride == 1)
                self.add_module(conv.name, layer)
            n = sum(n_out)
        return n

    def forward(self, maps: Tensor) -> Tensor:
        """Map (B, n_in, H, W) to (B, n_out, H, W); reductions halve H - 1 and W - 1."""
        return torch.cat([self._branch(branch, maps) for branch in self.branches], dim=1)

    def _branch(self, branch: Branch, maps: Tensor) -> Tensor:
        if branch.pool == "average":
            maps = functional.avg_pool2d(maps, 3, 1, 1)
        elif branch.pool == "maximum":
            maps = functional.max_pool2d(maps, 3, 2)
        for step in branch.steps:
            maps = torch.cat([self.get_submodule(conv.name)(maps) for conv in step], dim=1)
        return maps


class InceptionV3(InceptionBackbone):
    """Inception v3 without its classifiers.

    Auxiliary heads branch off after ``Mixed_5d``, the last block of the 35-pixel maps (288 channels
    at width 1, stride 8), and ``Mixed_6e``, the last of the 17-pixel maps (768 channels, stride
    16). At the second of these Inception v3 has its only auxiliary classifier; the first is where
    the Synfeal authors' PoseNet puts the other head. The last map is that of ``Mixed_7c`` (2048
    channels, stride 32).
    """

    def __init__(self, width: float = 1.0) -> None:
        super().__init__()
        one, two, three, n = (scaled_channels(n, width) for n in (32, 64, 80, 192))
        self.Conv2d_1a_3x3 = ConvBn(3, one, 3, 2, padded=False)
        self.Conv2d_2a_3x3 = ConvBn(one, one, 3, padded=False)
        self.Conv2d_2b_3x3 = ConvBn(one, two, 3)
        self.Conv2d_3b_1x1 = ConvBn(two, three, 1)
        self.Conv2d_4a_3x3 = ConvBn(three, n, 3, padded=False)
        self.pool = nn.MaxPool2d(3, 2)
        n_out: dict[str, int] = {}
        for name, written in BLOCKS.items():
            block = Mixed(n, written, width)
            self.add_module(name, block)
            n = n_out[name] = block.n_out
        self.n_aux = (n_out["Mixed_5d"], n_out["Mixed_6e"])
        self.n_out = n

    def maps_of(self, images: Tensor) -> InceptionMaps:
        """Compute feature maps of images (B, 3, H, W) in [-1, 1]; H and W at least 75."""
        maps = self.Conv2d_2b_3x3(self.Conv2d_2a_3x3(self.Conv2d_1a_3x3(images)))
        maps = self.Conv2d_4a_3x3(self.Conv2d_3b_1x1(self.pool(maps)))
        maps = self.pool(maps)
        points: dict[str, Tensor] = {}
        for name in BLOCKS:
            maps = points[name] = self.get_submodule(name)(maps)
        return InceptionMaps(points["Mixed_5d"], points["Mixed_6e"], points["Mixed_7c"])
