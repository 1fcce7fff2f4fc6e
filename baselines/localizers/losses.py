"""Losses on poses: distances, combined with a fixed or with learned weights."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import torch
from torch import Tensor, nn


class PosePrediction(NamedTuple):
    """Predicted poses: positions (B, 3) in metres and quaternions (B, 4), of any length but 0."""

    position_m: Tensor
    quat_wxyz: Tensor


def position_distance(predicted_m: Tensor, true_m: Tensor) -> Tensor:
    """Compute the mean distance of positions (B, 3); its gradient at distance 0 is 0, not NaN."""
    distance: Tensor = torch.linalg.vector_norm(predicted_m - true_m, dim=1)
    return distance.mean()


def quat_distance(predicted_wxyz: Tensor, true_wxyz: Tensor) -> Tensor:
    """Compute the mean distance of rotations as unit quaternions, the same for ``q`` and ``-q``.

    ``min(|p - q|, |p + q|)`` with ``p`` the prediction (B, 4) and ``q`` a unit quaternion (B, 4).
    For a unit ``p`` it is ``2 sin(angle / 4)``: near 0 half of the angle, in radians. Like PoseNet
    (section 3.1) it leaves ``p`` as it is: normalised, predictions grow long and stop learning.
    """
    return quat_chords(predicted_wxyz, true_wxyz).mean()


def quat_chords(a_wxyz: Tensor, b_wxyz: Tensor) -> Tensor:
    """Compute ``min(|a - b|, |a + b|)`` (B,) of quaternions (B, 4)."""
    same = torch.linalg.vector_norm(a_wxyz - b_wxyz, dim=1)
    opposite = torch.linalg.vector_norm(a_wxyz + b_wxyz, dim=1)
    return torch.minimum(same, opposite)


def position_mean_square(predicted_m: Tensor, true_m: Tensor) -> Tensor:
    """Compute the mean squared difference of the coordinates of positions (B, 3)."""
    return nn.functional.mse_loss(predicted_m, true_m)


def quat_mean_square(predicted_wxyz: Tensor, true_wxyz: Tensor) -> Tensor:
    """Compute the mean squared difference of unit quaternions (B, 4); ``q`` and ``-q`` differ.

    The prediction is brought to unit length first.
    """
    return nn.functional.mse_loss(nn.functional.normalize(predicted_wxyz, dim=1), true_wxyz)


class Distances(NamedTuple):
    """Scalar distances of positions (B, 3) and of quaternions (B, 4), predicted and true."""

    position: Callable[[Tensor, Tensor], Tensor]
    orientation: Callable[[Tensor, Tensor], Tensor]


# Norms are those of the localizers' papers, mean squares those of the Synfeal authors' code.
DISTANCES: dict[Literal["norm", "mse"], Distances] = {
    "norm": Distances(position_distance, quat_distance),
    "mse": Distances(position_mean_square, quat_mean_square),
}


class PoseLoss(nn.Module):
    """A weighted sum of a distance of positions and one of quaternions.

    Attributes:
        distance: Key of ``DISTANCES``.
    """

    distance: Literal["norm", "mse"] = "norm"

    def distances(
        self, prediction: PosePrediction, position_m: Tensor, quat_wxyz: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Compute the distances of predictions from poses, before they are weighted.

        Args:
            prediction: Predicted positions (B, 3), metres, and quaternions (B, 4) of any length.
            position_m: Positions (B, 3), metres.
            quat_wxyz: Unit quaternions (B, 4).

        Returns:
            Scalar distances of positions and of quaternions, in float32, by ``distance``.
        """
        position, orientation = DISTANCES[self.distance]
        return (
            position(prediction.position_m.float(), position_m),
            orientation(prediction.quat_wxyz.float(), quat_wxyz),
        )


class BetaLoss(PoseLoss):
    """``L_position + beta * L_orientation`` (Kendall et al., ICCV 2015, eq. 2)."""

    def __init__(self, beta: float) -> None:
        super().__init__()
        self.beta = beta

    def forward(self, prediction: PosePrediction, position_m: Tensor, quat_wxyz: Tensor) -> Tensor:
        """Compute the scalar loss against positions (B, 3), metres, and unit quaternions (B, 4)."""
        position, orientation = self.distances(prediction, position_m, quat_wxyz)
        return position + self.beta * orientation


class LearnedWeightLoss(PoseLoss):
    """``exp(-s_p) L_position + s_p + exp(-s_o) L_orientation + s_o`` with learned ``s``.

    Homoscedastic uncertainty (Kendall and Cipolla, CVPR 2017, eq. 4). For constant errors the
    optimum is ``s = log(L)``, so each term is weighted by the inverse of its size.
    """

    def __init__(self, s_position: float, s_orientation: float) -> None:
        super().__init__()
        self.s_position = nn.Parameter(torch.tensor(s_position))
        self.s_orientation = nn.Parameter(torch.tensor(s_orientation))

    def forward(self, prediction: PosePrediction, position_m: Tensor, quat_wxyz: Tensor) -> Tensor:
        """Compute the scalar loss against positions (B, 3), metres, and unit quaternions (B, 4)."""
        position, orientation = self.distances(prediction, position_m, quat_wxyz)
        weighted_position = torch.exp(-self.s_position) * position + self.s_position
        return weighted_position + torch.exp(-self.s_orientation) * orientation + self.s_orientation
