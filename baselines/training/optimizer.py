"""Optimisers and schedules of learning rates."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple

import torch
from torch import Tensor, nn
from torch.optim.lr_scheduler import LambdaLR, LRScheduler, StepLR

from baselines.localizers.heads import OutputLayer
from baselines.training.muon import Muon

OptimiserName = Literal["muon", "adamw", "halving"]
# Muon's rate over that of the rest: a step of it is as long as the rate says, whatever the gradient
MUON_RATE = 20.0
WARM_UP = 0.05


class Schedule(NamedTuple):
    """How long and how fast to learn."""

    samples_seen: int  # images shown in all, rounded up to whole batches
    batch_size: int  # images per step
    learning_rate: float  # the highest one; Muon's is ``MUON_RATE`` times it
    weight_decay: float  # decoupled, but with ``halving`` of the loss
    # share of the training run after which the rate is halved (``halving``)
    halve_every: float = 1.0

    @property
    def steps(self) -> int:
        """Batches shown in all."""
        return -(-self.samples_seen // self.batch_size)


class Optimisation:
    """Optimisers with the schedules of their rates, which step together once per batch."""

    def __init__(self, *pairs: tuple[torch.optim.Optimizer, LRScheduler]) -> None:
        self._optimizers = [optimizer for optimizer, _ in pairs]
        self._schedulers = [scheduler for _, scheduler in pairs]

    @property
    def learning_rate(self) -> float:
        """Rate of the next step, that of biases where there are several."""
        return float(self._schedulers[-1].get_last_lr()[-1])

    def step(self, loss: Tensor) -> None:
        """One step down the gradient of ``loss``."""
        for optimizer in self._optimizers:
            optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        for optimizer in self._optimizers:
            optimizer.step()
        for scheduler in self._schedulers:
            scheduler.step()

    def state_dict(self) -> dict[str, Any]:
        """The state of every part."""
        return {
            "optimizers": [optimizer.state_dict() for optimizer in self._optimizers],
            "schedulers": [scheduler.state_dict() for scheduler in self._schedulers],
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on where another optimisation stood."""
        for optimizer, before in zip(self._optimizers, state["optimizers"], strict=True):
            optimizer.load_state_dict(before)
        for scheduler, before in zip(self._schedulers, state["schedulers"], strict=True):
            scheduler.load_state_dict(before)


def optimisation_of(kind: OptimiserName, network: nn.Module, schedule: Schedule) -> Optimisation:
    """What a protocol trains ``network`` with."""
    return OPTIMISERS[kind](network, schedule)


def _muon(network: nn.Module, schedule: Schedule) -> Optimisation:
    """Muon for kernels and hidden matrices, AdamW for the rest; both rates rise and fall.

    Regressors are the network's output, which Muon's authors leave to AdamW, as they do biases.
    """
    outputs = {
        id(p)
        for module in network.modules()
        if isinstance(module, OutputLayer)
        for p in module.parameters()
    }
    hidden = [p for p in network.parameters() if p.ndim > 1 and id(p) not in outputs]
    taken = {id(p) for p in hidden}
    rest = [p for p in network.parameters() if id(p) not in taken]
    rate = schedule.learning_rate
    muon = Muon(hidden, MUON_RATE * rate, weight_decay=schedule.weight_decay)
    return Optimisation((muon, _rise_and_fall(muon, schedule)), _adamw_pair(rest, schedule))


def _adamw(network: nn.Module, schedule: Schedule) -> Optimisation:
    """AdamW (Loshchilov and Hutter, ICLR 2019) for all, its rate rises and falls."""
    return Optimisation(_adamw_pair(list(network.parameters()), schedule))


def _halving(network: nn.Module, schedule: Schedule) -> Optimisation:
    """Adam, every parameter pulled to 0, and half the rate after equal shares of the run."""
    optimizer = torch.optim.Adam(
        network.parameters(),
        schedule.learning_rate,
        weight_decay=schedule.weight_decay,
        fused=True,
    )
    step = max(1, round(schedule.halve_every * schedule.steps))
    return Optimisation((optimizer, StepLR(optimizer, step, gamma=0.5)))


OPTIMISERS: dict[OptimiserName, Callable[[nn.Module, Schedule], Optimisation]] = {
    "muon": _muon,
    "adamw": _adamw,
    "halving": _halving,
}


def _adamw_pair(
    parameters: list[nn.Parameter], schedule: Schedule
) -> tuple[torch.optim.Optimizer, LRScheduler]:
    """Weights decay; biases, batch normalisation and loss weights do not."""
    groups = [
        {"params": [p for p in parameters if p.ndim > 1], "weight_decay": schedule.weight_decay},
        {"params": [p for p in parameters if p.ndim <= 1], "weight_decay": 0.0},
    ]
    # A shorter memory of squared gradients than the default: it must fit into a few hundred steps.
    optimizer = torch.optim.AdamW(groups, schedule.learning_rate, betas=(0.9, 0.99), fused=True)
    return optimizer, _rise_and_fall(optimizer, schedule)


def _rise_and_fall(optimizer: torch.optim.Optimizer, schedule: Schedule) -> LRScheduler:
    """Straight up to the highest rate within ``WARM_UP`` of the run, then straight down to 0."""
    steps = schedule.steps
    rise = max(1.0, WARM_UP * steps)
    return LambdaLR(
        optimizer, lambda done: min((done + 1) / rise, (steps - done) / max(steps - rise, 1.0), 1.0)
    )
