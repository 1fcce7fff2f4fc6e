"""Losses and gradients at extreme weights, without an error, and at quaternions 0 and -q."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from baselines.localizers import losses
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import MP, MPMATH, max_relative, mpf

Array = NDArray[np.float64]
Numbers = Sequence[float]
POSITION = (0.25, -1.5, 2.0)
QUAT = (0.5, -0.5, 0.5, 0.5)  # a unit quaternion without rounding
NEAR_QUAT = (0.75, -0.25, 0.5, 0.125)
NEAR_POSITION = (0.5, -1.25, 2.125)


def learned(s: float, position: Numbers = NEAR_POSITION, quat: Numbers = NEAR_QUAT) -> Trial:
    """``exp(-s) L + s`` for both terms with the same ``s``: value, gradients of pose and both s."""
    weight = MP.exp(-mpf(s))
    lengths, slopes = _exact_terms(position, quat)
    return Trial(
        naive=lambda: _value_and_slopes(_TextbookLearned(s), position, quat),
        ours=lambda: _value_and_slopes(losses.LearnedWeightLoss(s, s), position, quat),
        truth=[
            weight * sum(lengths) + 2 * mpf(s),
            *(weight * slope for slope in slopes),
            *(1 - weight * length for length in lengths),
        ],
        error=max_relative,
    )


def fixed(beta: float, position: Numbers = NEAR_POSITION, quat: Numbers = NEAR_QUAT) -> Trial:
    """``L_position + beta L_orientation``: value and gradients of the pose."""
    lengths, slopes = _exact_terms(position, quat)
    return Trial(
        naive=lambda: _value_and_slopes(partial(_textbook_beta, beta), position, quat),
        ours=lambda: _value_and_slopes(losses.BetaLoss(beta), position, quat),
        truth=[
            lengths[0] + mpf(beta) * lengths[1],
            *slopes[:3],
            *(mpf(beta) * v for v in slopes[3:]),
        ],
        error=max_relative,
    )


def normalised(quat: Numbers) -> Trial:
    """As :func:`fixed` with weight 1; the naive formula brings the prediction to unit length."""
    ours = fixed(1.0, quat=quat)

    def naive(prediction: losses.PosePrediction, position_m: Tensor, quat_wxyz: Tensor) -> Tensor:
        length = torch.sqrt((prediction.quat_wxyz**2).sum(dim=1, keepdim=True))
        unit = losses.PosePrediction(prediction.position_m, prediction.quat_wxyz / length)
        return _textbook_beta(1.0, unit, position_m, quat_wxyz)

    return replace(ours, naive=lambda: _value_and_slopes(naive, NEAR_POSITION, quat))


class _TextbookLearned(torch.nn.Module):
    def __init__(self, s: float) -> None:
        super().__init__()
        self.s = torch.nn.Parameter(torch.tensor([s, s]))

    def forward(self, prediction: losses.PosePrediction, *truth: Tensor) -> Tensor:
        terms = zip(self.s, prediction, truth, strict=True)
        return torch.stack([torch.exp(-s) * _distance(p, t) + s for s, p, t in terms]).sum()


def _textbook_beta(beta: float, prediction: losses.PosePrediction, *truth: Tensor) -> Tensor:
    position, orientation = (_distance(p, t) for p, t in zip(prediction, truth, strict=True))
    return position + beta * orientation


def _distance(predicted: Tensor, true: Tensor) -> Tensor:
    """The norm as it is written down, whatever the sign of a quaternion."""
    return torch.sqrt(((predicted - true) ** 2).sum(dim=1)).mean()


def _value_and_slopes(loss: Callable[..., Tensor], position: Numbers, quat: Numbers) -> Array:
    """Loss and gradients of position (3,), quaternion (4,) and learned weights, float32."""
    leaves = [torch.tensor([values], requires_grad=True) for values in (position, quat)]
    weights = list(loss.parameters()) if isinstance(loss, torch.nn.Module) else []
    value = loss(losses.PosePrediction(*leaves), torch.tensor([POSITION]), torch.tensor([QUAT]))
    slopes = torch.autograd.grad(value, [*leaves, *weights])
    parts = [value.detach().reshape(1), *(slope.reshape(-1) for slope in slopes)]
    return np.asarray(torch.cat(parts).double().numpy())


def _exact_terms(position: Numbers, quat: Numbers) -> tuple[list[Any], list[Any]]:
    """Both distances, and their gradients (7,): 0 where a distance is 0 or p is 0."""
    shift = [mpf(p) - mpf(t) for p, t in zip(position, POSITION, strict=True)]
    both = [[mpf(p) + sign * mpf(t) for p, t in zip(quat, QUAT, strict=True)] for sign in (-1, 1)]
    length = _length(shift)
    same, opposite = map(_length, both)
    turn, turned = (both[0], same) if same < opposite else (both[1], opposite)
    slopes = [x / length if length else mpf(0.0) for x in shift]
    slopes += [x / turned if turned and same != opposite else mpf(0.0) for x in turn]
    return [length, turned], slopes


def _length(vector: Sequence[Any]) -> Any:
    return MP.sqrt(sum(x * x for x in vector))


_ANY = partial(
    Case,
    "losses",
    quantity="value, gradients",
    unit="relative",
    naive="√Σ(p − q)²",
    reference=MPMATH,
    bound=2e-6,  # float32
)
_BETA, _LEARNED = partial(_ANY, ours="BetaLoss"), partial(_ANY, ours="LearnedWeightLoss")
MINUS_QUAT = tuple(-value for value in QUAT)

CASES = (
    _LEARNED("learned weights, s = −20", trial=partial(learned, -20.0)),
    _LEARNED("learned weights, s = 20", trial=partial(learned, 20.0)),
    _LEARNED("learned weights, no error", trial=partial(learned, -3.0, POSITION, QUAT)),
    _BETA("β = 1e-3", trial=partial(fixed, 1e-3)),
    _BETA("β = 1e5", trial=partial(fixed, 1e5)),
    _BETA("β = 500, no error", trial=partial(fixed, 500.0, POSITION, QUAT)),
    _BETA("predicted −q", trial=partial(fixed, 1.0, NEAR_POSITION, MINUS_QUAT)),
    _BETA(
        "predicted quaternion 0", naive="p / |p|", trial=lambda: normalised((0.0, 0.0, 0.0, 0.0))
    ),
)
