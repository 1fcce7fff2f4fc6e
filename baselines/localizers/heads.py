"""Regressors that turn feature maps into poses."""

from __future__ import annotations

from contextlib import nullcontext

import torch
from torch import Tensor, nn

from baselines.localizers.backbones.channels import scaled_channels
from baselines.localizers.losses import PosePrediction

# Width of the localisation feature of PoseNet and its successors.
N_FEATURES = 2048


class OutputLayer(nn.Module):
    """What predicts; every layer before it is hidden. Optimisers tell the two apart."""


class PoseRegressor(OutputLayer):
    """Two linear maps from a feature (B, n_in) to position and quaternion."""

    def __init__(self, n_in: int) -> None:
        super().__init__()
        self.position = nn.Linear(n_in, 3)
        self.quat = nn.Linear(n_in, 4)

    def forward(self, features: Tensor) -> PosePrediction:
        """Poses of features (B, n_in), in float32: bfloat16 rounds positions to centimetres."""
        device = features.device.type
        mixed = torch.amp.is_autocast_available(device)  # not on "meta", where shapes are planned
        with torch.autocast(device, enabled=False) if mixed else nullcontext():
            return PosePrediction(self.position(features.float()), self.quat(features.float()))

    @torch.no_grad()
    def set_mean_position(self, position_m: Tensor) -> None:
        """Predict around ``position_m`` (3,) instead of around the origin of the world."""
        self.position.bias.copy_(position_m)


class PooledFeature(nn.Sequential):
    """Global average pooling, a fully connected layer of 2048 units times the width, ReLU."""

    def __init__(self, n_in: int, width: float) -> None:
        self.n_out = scaled_channels(N_FEATURES, width)
        super().__init__(
            nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(n_in, self.n_out), nn.ReLU()
        )


class PooledRegressor(nn.Sequential):
    """PoseNet's regressor: pooled feature, dropout, pose."""

    def __init__(self, n_in: int, width: float, dropout: float) -> None:
        feature = PooledFeature(n_in, width)
        super().__init__(feature, nn.Dropout(dropout), PoseRegressor(feature.n_out))
