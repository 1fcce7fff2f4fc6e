"""Losses on poses: Euclidean norms, combined with a fixed or with learned weights."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn


class PosePrediction(NamedTuple):
    """Predicted poses: positions (B, 3) in metres and quaternions (B, 4), of any length but 0."""

    position_m: Tensor
    quat_wxyz: Tensor


def position_distance(predicted_m: Tensor, true_m: Tensor) -> Tensor:
    """Mean Euclidean distance of positions (B, 3). The gradient at distance 0 is 0, not NaN."""
    distance: Tensor = torch.linalg.vector_norm(predicted_m - true_m, dim=1)
    return distance.mean()


def quat_distance(predicted_wxyz: Tensor, true_wxyz: Tensor) -> Tensor:
    """Mean distance of rotations as unit quaternions, the same for ``q`` and ``-q``.

    ``min(|p - q|, |p + q|)`` with ``p`` the prediction (B, 4) and ``q`` a unit quaternion (B, 4).
    For a unit ``p`` it is ``2 sin(angle / 4)``: near 0 half of the angle, in radians. Like PoseNet
    (section 3.1) it leaves ``p`` as it is: normalised, predictions grow long and stop learning.
    """
    same = torch.linalg.vector_norm(predicted_wxyz - true_wxyz, dim=1)
    opposite = torch.linalg.vector_norm(predicted_wxyz + true_wxyz, dim=1)
    return torch.minimum(same, opposite).mean()


class BetaLoss(nn.Module):
    """``L_position + beta * L_orientation`` (Kendall et al., ICCV 2015, eq. 2)."""

    def __init__(self, beta: float) -> None:
        super().__init__()
        self.beta = beta

    def forward(self, prediction: PosePrediction, position_m: Tensor, quat_wxyz: Tensor) -> Tensor:
        """Scalar loss of predictions against positions (B, 3) and unit quaternions (B, 4)."""
        position = position_distance(prediction.position_m, position_m)
        return position + self.beta * quat_distance(prediction.quat_wxyz, quat_wxyz)


class LearnedWeightLoss(nn.Module):
    """``exp(-s_p) L_position + s_p + exp(-s_o) L_orientation + s_o`` with learned ``s``.

    Homoscedastic uncertainty (Kendall and Cipolla, CVPR 2017, eq. 4). For constant errors the
    optimum is ``s = log(L)``, so each term is weighted by the inverse of its size.
    """

    def __init__(self, s_position: float, s_orientation: float) -> None:
        super().__init__()
        self.s_position = nn.Parameter(torch.tensor(s_position))
        self.s_orientation = nn.Parameter(torch.tensor(s_orientation))

    def forward(self, prediction: PosePrediction, position_m: Tensor, quat_wxyz: Tensor) -> Tensor:
        """Scalar loss of predictions against positions (B, 3) and unit quaternions (B, 4)."""
        position = position_distance(prediction.position_m, position_m)
        orientation = quat_distance(prediction.quat_wxyz, quat_wxyz)
        weighted_position = torch.exp(-self.s_position) * position + self.s_position
        return weighted_position + torch.exp(-self.s_orientation) * orientation + self.s_orientation
