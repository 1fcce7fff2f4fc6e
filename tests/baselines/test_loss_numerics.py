"""Losses in float32: finite wherever a training run can lead them, and right to the last digits.

The reference is written down anew in double precision, and differentiated by an imaginary step.
"""

from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from baselines.localizers.losses import DISTANCES, BetaLoss, LearnedWeightLoss, PosePrediction

Array = NDArray[Any]
BATCH = 2
# Every loss by a number that says how it weighs: the extremes are those a training run may meet.
LOSSES = {
    BetaLoss: (lambda x: BetaLoss(10.0**x), (-3.0, 5.0)),
    LearnedWeightLoss: (lambda x: LearnedWeightLoss(x, -x / 2), (-20.0, 20.0)),
}
ZERO, ONE = (0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)

all_losses = pytest.mark.parametrize("kind", LOSSES)
all_distances = pytest.mark.parametrize("distance", DISTANCES)


def built(kind, distance, x):
    loss = LOSSES[kind][0](x)
    loss.distance = distance
    return loss


def value_and_slopes(loss, predicted, true):
    """The loss, and its gradients: position (B, 3), quaternion (B, 4), learned weights."""
    leaves = [torch.tensor(np.array(v), dtype=torch.float32).requires_grad_() for v in predicted]
    targets = [torch.tensor(np.array(v), dtype=torch.float32) for v in true]
    value = loss(PosePrediction(*leaves), *targets)
    return value.item(), list(torch.autograd.grad(value, [*leaves, *loss.parameters()]))


def reference(loss, numbers, true):
    """The losses of rows of ``numbers``: positions, quaternions, learned weights side by side."""
    position = numbers[:, : 3 * BATCH].reshape(-1, BATCH, 3)
    quat = numbers[:, 3 * BATCH : 7 * BATCH].reshape(-1, BATCH, 4)
    true_position, true_quat = (np.asarray(values, np.float64) for values in true)
    if loss.distance == "norm":
        near = _length(position - true_position)
        same, opposite = _length(quat - true_quat), _length(quat + true_quat)
        turned = np.where(same.real < opposite.real, same, opposite)
    else:
        near = ((position - true_position) ** 2).mean(axis=2)
        turned = ((quat / _length(quat)[..., None] - true_quat) ** 2).mean(axis=2)
    near, turned = near.mean(axis=1), turned.mean(axis=1)
    if isinstance(loss, BetaLoss):
        return near + loss.beta * turned
    s_position, s_orientation = numbers[:, 7 * BATCH :].T
    return np.exp(-s_position) * near + s_position + np.exp(-s_orientation) * turned + s_orientation


def _length(vectors):
    return np.sqrt((vectors**2).sum(axis=2))


def reference_slopes(loss, numbers, true):
    """Derivatives (N,) by an imaginary step: no difference is taken, so no digit is lost."""
    step = 1e-30
    return reference(loss, numbers + 1j * step * np.eye(len(numbers)), true).imag / step


def float32s(columns, bound):
    return arrays(np.float32, (BATCH, columns), elements=st.floats(-bound, bound, width=32))


def unit(quats):
    lengths = np.linalg.norm(quats.astype(np.float64), axis=1, keepdims=True)
    assume((lengths > 0.1).all())
    return (quats / lengths).astype(np.float32)


@all_losses
@all_distances
@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(0.0, 1.0),
    predicted=st.tuples(float32s(3, 30.0), float32s(4, 2.0)),
    true=st.tuples(float32s(3, 30.0), float32s(4, 1.0)),
)
def test_values_and_slopes_are_those_of_double_precision(kind, distance, x, predicted, true):
    low, high = LOSSES[kind][1]
    loss = built(kind, distance, low + x * (high - low))
    position, quat = predicted
    true = (true[0], unit(true[1]))
    apart = np.linalg.norm(quat - true[1], axis=1) - np.linalg.norm(quat + true[1], axis=1)
    # Where q and -q are as near the norm has an edge; a prediction near 0 has no direction.
    assume((np.abs(apart) > 1e-2).all() and (np.linalg.norm(quat, axis=1) > 1e-2).all())
    assume((np.linalg.norm(position - true[0], axis=1) > 1e-5).all())
    assume((np.linalg.norm(quat - true[1], axis=1) > 1e-5).all())
    assume((np.linalg.norm(quat + true[1], axis=1) > 1e-5).all())
    weights = [parameter.item() for parameter in loss.parameters()]
    numbers = np.array([*position.ravel(), *quat.ravel(), *weights], np.float64)
    value, slopes = value_and_slopes(loss, predicted, true)
    w_position, w_orientation = scales(loss)
    near = max(1.0, float(np.abs(position - true[0]).max())) ** 2
    largest = w_position * near + 10 * w_orientation + sum(map(abs, weights))
    expected_value = reference(loss, numbers[None], true).item()
    assert value == pytest.approx(expected_value, abs=3e-6 * largest, rel=3e-6)
    expected = reference_slopes(loss, numbers, true)
    found = torch.cat([slope.ravel() for slope in slopes]).numpy()
    shortest = min(1.0, float(np.linalg.norm(quat, axis=1).min()))
    parts = ((0, 6, w_position * near), (6, 14, w_orientation / shortest), (14, 16, largest))
    for start, stop, scale in parts:
        np.testing.assert_allclose(
            found[start:stop], expected[start:stop], rtol=3e-6, atol=3e-6 * scale
        )


def scales(loss):
    """By how much the two distances are multiplied."""
    if isinstance(loss, BetaLoss):
        return 1.0, loss.beta
    s_position, s_orientation = (parameter.item() for parameter in loss.parameters())
    return float(np.exp(-s_position)), float(np.exp(-s_orientation))


HARD = {
    "no error": ((1.0, 2.0, 3.0), (0.6, 0.0, 0.8, 0.0)),
    "the antipode": ((1.0, 2.0, 3.0), (-0.6, 0.0, -0.8, 0.0)),
    "a half turn": ((1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8)),
    "quaternion 0": ((1.0, 2.0, 3.0), ZERO),
    "a quaternion of length 1e-30": ((1.0, 2.0, 3.0), (0.0, 1e-30, 0.0, 0.0)),
    "a tiny error": ((1.0, 2.0, 3.0 + 1e-6), (0.6, 1e-20, 0.8, 0.0)),
    "a million metres": ((1e6, -1e6, 1e6), (1e6, 0.0, 0.0, 0.0)),
}


@all_losses
@all_distances
@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("hard", HARD)
def test_nothing_a_network_may_answer_makes_a_loss_infinite(kind, distance, end, hard):
    loss = built(kind, distance, LOSSES[kind][1][end])
    predicted = [[values, values] for values in HARD[hard]]
    true = [[(1.0, 2.0, 3.0)] * 2, [(0.6, 0.0, 0.8, 0.0)] * 2]
    value, slopes = value_and_slopes(loss, predicted, true)
    assert np.isfinite(value)
    assert all(slope.isfinite().all() for slope in slopes)


@all_distances
@pytest.mark.parametrize("start", [-20.0, -3.0, 20.0])
@pytest.mark.parametrize("error_m", [0.0, 1e-3, 1.0, 1e3])
def test_learned_weights_stay_finite_and_go_where_they_should(distance, start, error_m):
    """Steps that Adam takes; the optimum is the logarithm of the distance, and -inf without one."""
    loss = LearnedWeightLoss(start, start)
    loss.distance = distance
    prediction = PosePrediction(torch.tensor([[error_m, 0.0, 0.0]]), torch.tensor([ONE]))
    true = torch.zeros(1, 3), torch.tensor([ONE])
    best = float(torch.log(loss.distances(prediction, *true)[0]))
    optimizer = torch.optim.Adam(loss.parameters(), 0.3)
    for _ in range(60):
        optimizer.zero_grad()
        value = loss(prediction, *true)
        value.backward()
        optimizer.step()
        assert value.isfinite()
    assert all(parameter.isfinite() for parameter in loss.parameters())
    moved = loss.s_position.item() - start
    assert moved * (best - start) > 0


def test_a_zero_error_has_a_zero_slope_of_the_pose():
    """Where a norm has its tip, the slope taken is 0: a pose that is right stays where it is."""
    exact = [[(1.0, 2.0, 3.0)] * 2, [(0.6, 0.0, 0.8, 0.0)] * 2]
    _, (position, quat) = value_and_slopes(BetaLoss(1e5), exact, exact)
    assert not position.any()
    assert not quat.any()
