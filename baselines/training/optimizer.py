"""Optimisers and schedules of learning rates."""

from __future__ import annotations

from typing import Literal, NamedTuple

import torch
from torch import nn
from torch.optim.lr_scheduler import LRScheduler, OneCycleLR, StepLR


class Schedule(NamedTuple):
    """How long and how fast to learn.

    Attributes:
        samples_seen: images shown in all, rounded up to whole batches.
        batch_size: images per step.
        learning_rate: the highest one.
        weight_decay: decoupled with ``one_cycle``, of the loss with ``halving``.
        halve_every: share of the training after which the rate is halved (``halving``).
    """

    samples_seen: int
    batch_size: int
    learning_rate: float
    weight_decay: float
    halve_every: float = 1.0

    @property
    def steps(self) -> int:
        """Batches shown in all."""
        return -(-self.samples_seen // self.batch_size)


def optimizer_of(
    kind: Literal["one_cycle", "halving"], localizer: nn.Module, schedule: Schedule
) -> tuple[torch.optim.Optimizer, LRScheduler]:
    """Optimiser and schedule of a protocol; the schedule steps once per batch."""
    return (_one_cycle if kind == "one_cycle" else _halving)(localizer, schedule)


def _one_cycle(
    localizer: nn.Module, schedule: Schedule
) -> tuple[torch.optim.Optimizer, LRScheduler]:
    """AdamW and one cycle (Smith and Topin, 2019)."""
    groups = _parameter_groups(localizer, schedule.weight_decay)
    # A shorter memory of squared gradients than the default: it must fit into a few hundred steps.
    optimizer = torch.optim.AdamW(groups, betas=(0.9, 0.99), fused=True)
    steps = max(schedule.steps, 2)
    return optimizer, OneCycleLR(
        optimizer, schedule.learning_rate, total_steps=steps, pct_start=0.2
    )


def _halving(localizer: nn.Module, schedule: Schedule) -> tuple[torch.optim.Optimizer, LRScheduler]:
    """Adam, every parameter pulled to 0, and half the rate after equal shares of the training."""
    optimizer = torch.optim.Adam(
        localizer.parameters(),
        schedule.learning_rate,
        weight_decay=schedule.weight_decay,
        fused=True,
    )
    step = max(1, round(schedule.halve_every * schedule.steps))
    return optimizer, StepLR(optimizer, step, gamma=0.5)


def _parameter_groups(localizer: nn.Module, weight_decay: float) -> list[dict[str, object]]:
    """Weights decay; biases, batch normalisation and loss weights do not."""
    parameters = list(localizer.parameters())
    weights = [p for p in parameters if p.ndim > 1]
    others = [p for p in parameters if p.ndim <= 1]
    return [
        {"params": weights, "weight_decay": weight_decay},
        {"params": others, "weight_decay": 0.0},
    ]
