"""Losses on poses against closed forms."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from baselines.localizers.losses import (
    BetaLoss,
    LearnedWeightLoss,
    PosePrediction,
    position_distance,
    quat_distance,
)


def poses(count: int = 6) -> tuple[Tensor, Tensor]:
    """Positions and unit quaternions."""
    torch.manual_seed(0)
    return torch.randn(count, 3), torch.nn.functional.normalize(torch.randn(count, 4), dim=1)


def test_position_distance_is_euclidean():
    true_m = torch.zeros(2, 3)
    predicted_m = torch.tensor([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0]])
    assert position_distance(predicted_m, true_m).item() == pytest.approx(3.5)


@pytest.mark.parametrize("angle_deg", [0.0, 10.0, 90.0, 180.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_quat_distance_is_the_chord_of_half_the_angle(angle_deg, sign):
    """|p - q| = 2 sin(angle / 4) whatever the sign of the prediction."""
    half = math.radians(angle_deg) / 2
    quat = torch.tensor([[math.cos(half), 0.0, math.sin(half), 0.0]])
    distance = quat_distance(sign * quat, torch.tensor([[1.0, 0.0, 0.0, 0.0]]))
    assert distance.item() == pytest.approx(2 * math.sin(half / 2), abs=1e-6)


@pytest.mark.parametrize("criterion", [BetaLoss(7.0), LearnedWeightLoss(0.3, -2.0)])
def test_opposite_quaternions_cost_the_same(criterion):
    position_m, quat_wxyz = poses()
    prediction = PosePrediction(torch.randn(6, 3), torch.randn(6, 4))
    opposite = PosePrediction(prediction.position_m, -prediction.quat_wxyz)
    loss = criterion(prediction, position_m, quat_wxyz)
    torch.testing.assert_close(criterion(opposite, position_m, quat_wxyz), loss)
    torch.testing.assert_close(criterion(prediction, position_m, -quat_wxyz), loss)


@pytest.mark.parametrize("criterion", [BetaLoss(7.0), LearnedWeightLoss(0.3, -2.0)])
def test_a_perfect_prediction_has_a_finite_gradient(criterion):
    position_m, quat_wxyz = poses()
    guess = PosePrediction(position_m.clone().requires_grad_(), quat_wxyz.clone().requires_grad_())
    criterion(guess, position_m, quat_wxyz).backward()
    assert torch.isfinite(guess.position_m.grad).all()
    assert torch.isfinite(guess.quat_wxyz.grad).all()


def off_by(distance_m: float, angle_rad: float) -> tuple[PosePrediction, Tensor, Tensor]:
    """A prediction off by a distance and an angle, and what would have been right."""
    quat = torch.tensor([[math.cos(angle_rad / 2), math.sin(angle_rad / 2), 0.0, 0.0]])
    prediction = PosePrediction(torch.tensor([[0.0, distance_m, 0.0]]), quat)
    return prediction, torch.zeros(1, 3), torch.tensor([[1.0, 0.0, 0.0, 0.0]])


def test_beta_loss_in_closed_form():
    loss = BetaLoss(10.0)(*off_by(0.7, 1.2))
    assert loss.item() == pytest.approx(0.7 + 10.0 * 2 * math.sin(0.3), rel=1e-5)


def test_learned_loss_in_closed_form():
    loss = LearnedWeightLoss(0.5, -3.0)(*off_by(0.7, 1.2))
    orientation = 2 * math.sin(0.3)
    expected = math.exp(-0.5) * 0.7 + 0.5 + math.exp(3.0) * orientation - 3.0
    assert loss.item() == pytest.approx(expected, rel=1e-5)


def test_learned_weights_settle_at_the_logarithm_of_the_error():
    criterion = LearnedWeightLoss(0.0, -3.0)
    optimizer = torch.optim.Adam(criterion.parameters(), 0.05)
    for _ in range(400):
        optimizer.zero_grad()
        criterion(*off_by(0.7, 1.2)).backward()
        optimizer.step()
    assert criterion.s_position.item() == pytest.approx(math.log(0.7), abs=1e-2)
    assert criterion.s_orientation.item() == pytest.approx(math.log(2 * math.sin(0.3)), abs=1e-2)
