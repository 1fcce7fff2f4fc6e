"""Optimisers, Muon among them, and schedules of learning rates."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, NamedTuple

import torch
from torch import Tensor, nn
from torch.optim.lr_scheduler import LambdaLR, LRScheduler, StepLR

from baselines.localizers.base import OutputLayer

# Coefficients of the quintic iteration, chosen by its authors to lift small singular values fast;
# it takes them to between 0.7 and 1.2 rather than to 1.
QUINTIC = (3.4445, -4.7750, 2.0315)
ITERATIONS = 5


def orthogonalised(matrices: Tensor, iterations: int = ITERATIONS) -> Tensor:
    """Roughly ``U V^T`` of each matrix ``U S V^T`` (K, M, N): a Newton-Schulz iteration."""
    a, b, c = QUINTIC
    upright = matrices.shape[1] > matrices.shape[2]
    x = matrices.mT if upright else matrices
    x = x / (x.norm(dim=(1, 2), keepdim=True) + 1e-7)  # no singular value above 1
    for _ in range(iterations):
        gram = x @ x.mT
        x = torch.baddbmm(x, torch.baddbmm(gram, gram, gram, beta=b, alpha=c), x, beta=a)
    return x.mT if upright else x


class Muon(torch.optim.Optimizer):
    """Nesterov momentum, orthogonalised, so that all directions of a kernel learn alike.

    @misc{jordan2024muon,
      title  = {Muon: An optimizer for hidden layers in neural networks},
      author = {Jordan, Keller and Jin, Yuchen and Boza, Vlado and You, Jiacheng and
                Cesista, Franz and Newhouse, Laker and Bernstein, Jeremy},
      year   = {2024},
      url    = {https://kellerjordan.github.io/posts/muon/}
    }

    ``torch.optim.Muon`` takes matrices alone and one at a time. Here convolutions are matrices
    (out, in * kh * kw), and kernels of one shape go through the iteration together: a narrow
    network has many small ones. A step has the size ``lr * sqrt(max(1, out / in))``, whatever the
    gradient's; weight decay is decoupled.
    """

    def __init__(
        self,
        params: Iterable[Tensor] | Iterable[dict[str, Any]],  # of two dimensions or more
        lr: float = 1e-2,
        momentum: float = 0.95,
        weight_decay: float = 0.0,
    ) -> None:
        super().__init__(params, {"lr": lr, "momentum": momentum, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> None:  # type: ignore[override]
        """One step for every parameter that has a gradient."""
        for group in self.param_groups:
            by_shape: dict[tuple[int, int], list[Tensor]] = {}
            for p in group["params"]:
                if p.grad is not None:
                    by_shape.setdefault((p.shape[0], p[0].numel()), []).append(p)
            for shape, parameters in by_shape.items():
                self._step_alike(parameters, shape, group)

    def _step_alike(
        self, parameters: list[Tensor], shape: tuple[int, int], group: dict[str, Any]
    ) -> None:
        """One step for parameters that are matrices of one shape."""
        momentum = group["momentum"]
        gradients = [p.grad for p in parameters if p.grad is not None]
        buffers = [self._buffer(p) for p in parameters]
        torch._foreach_lerp_(buffers, gradients, 1 - momentum)
        ahead = torch._foreach_lerp(gradients, buffers, momentum)
        steps = orthogonalised(torch.stack([step.reshape(shape) for step in ahead]))
        scale = max(1.0, shape[0] / shape[1]) ** 0.5
        torch._foreach_mul_(parameters, 1 - group["lr"] * group["weight_decay"])
        for p, step in zip(parameters, steps, strict=True):
            p.add_(step.view(p.shape), alpha=-group["lr"] * scale)

    def _buffer(self, parameter: Tensor) -> Tensor:
        state = self.state[parameter]
        if "momentum" not in state:
            state["momentum"] = torch.zeros_like(parameter)
        buffer: Tensor = state["momentum"]
        return buffer


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


def _halving(network: nn.Module, schedule: Schedule) -> Optimisation:
    """Adam, every parameter pulled to 0, and half the rate after equal shares of the run."""
    optimizer = torch.optim.Adam(
        network.parameters(), schedule.learning_rate, weight_decay=schedule.weight_decay, fused=True
    )
    step = max(1, round(schedule.halve_every * schedule.steps))
    return Optimisation((optimizer, StepLR(optimizer, step, gamma=0.5)))


OPTIMISERS: dict[OptimiserName, Callable[[nn.Module, Schedule], Optimisation]] = {
    "muon": _muon,
    # AdamW (Loshchilov and Hutter, ICLR 2019) for all, its rate rises and falls.
    "adamw": lambda network, schedule: Optimisation(_adamw_pair([*network.parameters()], schedule)),
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
