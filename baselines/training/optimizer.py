"""Optimisers, Muon among them, and schedules of learning rates."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import torch
from torch import Tensor, nn

from baselines.localizers.base import OutputLayer
from baselines.training.device import tensor_float32
from baselines.training.polar import inverse_square_root, quintics_for
from baselines.training.untraced import Adam, AdamW, Untraced

# Singular values above this share of the largest come near 1,
# smaller ones are lifted in proportion.
# With three quintics and 0.01 PoseNet2 trains in 4 % less time and ends 5 % further off in position
# (6,000 images, four seeds).
LOWEST = 0.005
ITERATIONS = 4
# Gram matrices are filled up with zeros to the next multiple of this side, of half and of a quarter
# of it where they are smaller, so that few stacks hold them all.
SIDE = 32


class Muon(Untraced):
    """Nesterov momentum, orthogonalised, so that all directions of a kernel learn alike.

    @misc{jordan2024muon,
      title  = {Muon: An optimizer for hidden layers in neural networks},
      author = {Jordan, Keller and Jin, Yuchen and Boza, Vlado and You, Jiacheng and
                Cesista, Franz and Newhouse, Laker and Bernstein, Jeremy},
      year   = {2024},
      url    = {https://kellerjordan.github.io/posts/muon/}
    }

    ``torch.optim.Muon`` takes matrices alone and one at a time. Here convolutions are matrices
    (out, in * kh * kw), and of all matrices whose shorter sides are about equal the Gram matrices
    are iterated upon together (:mod:`baselines.training.polar`): a narrow network has many small
    kernels. A step has the size ``lr * sqrt(max(1, out / in))``, whatever the gradient's; weight
    decay is decoupled.

    A rate that is a tensor is read on its device, so that a step can be captured in a CUDA graph.
    """

    def __init__(
        self,
        params: Iterable[Tensor] | Iterable[dict[str, Any]],  # each has two dimensions or more
        lr: float = 1e-2,
        momentum: float = 0.95,
        weight_decay: float = 0.0,
    ) -> None:
        super().__init__(params, {"lr": lr, "momentum": momentum, "weight_decay": weight_decay})

        self._stacks: dict[int, tuple[Any, list[_Stack]]] = {}

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> None:  # type: ignore[override]
        """Take one step for every parameter that has a gradient."""
        for index, group in enumerate(self.param_groups):
            parameters = [p for p in group["params"] if p.grad is not None]
            if not parameters:
                continue
            ahead = self._ahead(parameters, group["momentum"])
            for stack in self._stacks_of(index, parameters):
                stack.step(ahead, group["lr"], group["weight_decay"])

    def _ahead(self, parameters: list[Tensor], momentum: float) -> Sequence[Tensor]:
        """Update the momenta, and return Nesterov's step of each parameter."""
        gradients = [p.grad for p in parameters if p.grad is not None]
        buffers = [self._buffer(p) for p in parameters]
        torch._foreach_lerp_(buffers, gradients, 1 - momentum)
        return torch._foreach_lerp(gradients, buffers, momentum)

    def _buffer(self, parameter: Tensor) -> Tensor:
        state = self.state[parameter]
        if "momentum" not in state:
            state["momentum"] = torch.zeros_like(parameter)
        buffer: Tensor = state["momentum"]
        return buffer

    def _stacks_of(self, index: int, parameters: list[Tensor]) -> list[_Stack]:
        """Stack a group's parameters; anew if others have gradients, or they moved."""
        places = [p.data_ptr() for p in parameters]
        if index not in self._stacks or self._stacks[index][0] != places:
            by_side: dict[int, list[int]] = {}
            for position, p in enumerate(parameters):
                by_side.setdefault(_side(min(len(p), p[0].numel())), []).append(position)
            stacks = [_Stack(side, parameters, which) for side, which in by_side.items()]
            self._stacks[index] = places, stacks
        return self._stacks[index][1]


class _Member(NamedTuple):
    """A parameter of a stack.

    Attributes:
        position: Among the parameters with gradients.
        matrix: View of the parameter (out, in * kh * kw).
        permuted: The columns stand in the order of channels-last memory.
        upright: There are more rows than columns.
        gram: View of its Gram matrix, of the shorter side.
        longer: Factor by which steps are longer than the rate.
    """

    position: int
    matrix: Tensor
    permuted: bool
    upright: bool
    gram: Tensor
    longer: float


class _Stack:
    """Parameters whose Gram matrices have one side, once they are filled up with zeros."""

    def __init__(self, side: int, parameters: list[Tensor], positions: list[int]) -> None:
        self._grams = parameters[positions[0]].new_zeros(len(positions), side, side)
        self._members = [
            _member(position, parameters[position], gram)
            for position, gram in zip(positions, self._grams, strict=True)
        ]
        longer = self._grams.new_tensor([member.longer for member in self._members])
        self._longer = longer[:, None, None]

    def step(self, ahead: Sequence[Tensor], rate: float | Tensor, weight_decay: float) -> None:
        """Move every parameter of the stack along the orthogonal factor of its step.

        Args:
            ahead: Nesterov's step of every parameter with a gradient, whichever stack it is in.
            rate: Learning rate.
            weight_decay: Share of a weight that decays per unit of ``rate``.
        """
        steps = [self._as_matrix(ahead[member.position], member) for member in self._members]
        # Rounded to ten bits, the factors of these products change a step by 0.04 % (1.2 % where
        # the gradient's singular values span four decades). The iterations between would lose the
        # small singular values (results/benchmarks/muon_precision.csv).
        with tensor_float32(self._grams.device):
            for member, step in zip(self._members, steps, strict=True):
                left, right = (step.mT, step) if member.upright else (step, step.mT)
                torch.mm(left, right, out=member.gram)
        roots = inverse_square_root(self._grams, quintics_for(LOWEST, ITERATIONS))
        with tensor_float32(self._grams.device):
            if isinstance(rate, Tensor):
                self._move_by(steps, roots, rate, weight_decay)
            else:
                self._move(steps, roots, rate, weight_decay)

    def _move(self, steps: list[Tensor], roots: Tensor, rate: float, weight_decay: float) -> None:
        """Let every parameter decay, and take ``rate`` times its orthogonal step off it."""
        kept = 1 - rate * weight_decay
        for member, left, right in self._factors(steps, roots):
            member.matrix.addmm_(left, right, beta=kept, alpha=-rate * member.longer)

    def _move_by(
        self, steps: list[Tensor], roots: Tensor, rate: Tensor, weight_decay: float
    ) -> None:
        """Do the same by a rate on the device, which BLAS does not take as a factor."""
        torch._foreach_mul_([m.matrix for m in self._members], 1 - rate * weight_decay)
        for member, left, right in self._factors(steps, roots * (rate * self._longer)):
            member.matrix.addmm_(left, right, alpha=-1)

    def _factors(
        self, steps: list[Tensor], roots: Tensor
    ) -> Iterator[tuple[_Member, Tensor, Tensor]]:
        """Yield each member with the two factors of its orthogonal step."""
        for member, step, root in zip(self._members, steps, roots, strict=True):
            shorter = len(member.gram)
            inner = root[:shorter, :shorter]
            left, right = (step, inner) if member.upright else (inner, step)
            yield member, left, right

    @staticmethod
    def _as_matrix(step: Tensor, member: _Member) -> Tensor:
        """Lay out the step of a parameter as the member's matrix is."""
        if member.permuted:
            step = step.permute(0, 2, 3, 1)
        return step.reshape(member.matrix.shape)


def _member(position: int, parameter: Tensor, gram: Tensor) -> _Member:
    """View a parameter as a matrix with columns in the order of memory, so that it is not copied.

    Orthogonalisation does not mind: to exchange columns before it or after it is the same.
    """
    kernel = parameter.detach()
    permuted = kernel.ndim == 4 and kernel.is_contiguous(memory_format=torch.channels_last)
    if permuted:
        kernel = kernel.permute(0, 2, 3, 1)
    matrix = kernel.view(len(kernel), -1)
    rows, columns = matrix.shape
    shorter = min(rows, columns)
    inner = gram[:shorter, :shorter]
    longer = max(1.0, rows / columns) ** 0.5
    return _Member(position, matrix, permuted, rows > columns, inner, longer)


def _side(shorter: int) -> int:
    """Return the side to which a Gram matrix is filled up."""
    for side in (SIDE // 4, SIDE // 2):
        if shorter <= side:
            return side
    return -(-shorter // SIDE) * SIDE


OptimiserName = Literal["muon", "adamw", "halving"]
# Muon's rate over that of the rest: a step of it is as long as the rate says, whatever the gradient
MUON_RATE = 20.0
WARM_UP = 0.05
# Factor on an optimiser's rates after so many steps of a run.
RateFactor = Callable[[int], float]


class Schedule(NamedTuple):
    """Length and learning rates of a training run.

    Attributes:
        samples_seen: Images shown in all, rounded up to whole batches.
        batch_size: Images per step.
        learning_rate: The highest one; Muon's is ``MUON_RATE`` times it.
        weight_decay: Decoupled, but with ``halving`` of the loss.
        halve_every: Share of the training run after which the rate is halved (``halving``).
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


class Optimisation:
    """Optimisers that step together once per batch, by rates that follow the steps taken.

    Rates of parameters on a GPU are tensors there: a captured step reads them anew every time.

    Args:
        parts: Optimisers, each with its factor on the rates that it was made with.
    """

    def __init__(self, *parts: tuple[torch.optim.Optimizer, RateFactor]) -> None:
        self._parts = parts
        self._done = 0
        for optimizer, _ in parts:
            for group in optimizer.param_groups:
                group["initial_lr"] = group["lr"]
        self._place_rates()

    @property
    def learning_rate(self) -> float:
        """Rate of the next step, that of biases where there are several."""
        optimizer, factor = self._parts[-1]
        return float(optimizer.param_groups[-1]["initial_lr"] * factor(self._done))

    def step(self, loss: Tensor) -> None:
        """Take one step down the gradient of ``loss``, and set the rates of the next one."""
        self.descend(loss)
        self.advance()

    def descend(self, loss: Tensor) -> None:
        """Take one step down the gradient of ``loss``; what it needs is on its device."""
        for optimizer, _ in self._parts:
            optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        for optimizer, _ in self._parts:
            optimizer.step()

    def advance(self) -> None:
        """Count a step, and set the rates of the next one."""
        self._done += 1
        for group, rate in self._rates():
            if isinstance(group["lr"], Tensor):
                group["lr"].fill_(rate)
            else:
                group["lr"] = rate

    def _rates(self) -> Iterator[tuple[dict[str, Any], float]]:
        """Yield each group of parameters with the rate of the next step."""
        for optimizer, factor in self._parts:
            for group in optimizer.param_groups:
                yield group, group["initial_lr"] * factor(self._done)

    def _place_rates(self) -> None:
        """Put the rates where the parameters are."""
        for group, rate in self._rates():
            device = next((p.device for p in group["params"]), torch.device("cpu"))
            on_processor = device.type == "cpu"
            group["lr"] = rate if on_processor else torch.tensor(rate, device=device)

    def state_dict(self) -> dict[str, Any]:
        """Return the state of every part."""
        return {
            "optimizers": [optimizer.state_dict() for optimizer, _ in self._parts],
            "done": self._done,
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Go on where another optimisation stood."""
        for (optimizer, _), before in zip(self._parts, state["optimizers"], strict=True):
            optimizer.load_state_dict(before)
        self._done = state["done"]
        self._place_rates()


def optimisation_of(kind: OptimiserName, network: nn.Module, schedule: Schedule) -> Optimisation:
    """Make the optimiser of a protocol for a network.

    Args:
        kind: Key of ``OPTIMISERS``.
        network: Network whose parameters are optimised.
        schedule: Length of the run and its learning rates.
    """
    return OPTIMISERS[kind](network, schedule)


def _muon(network: nn.Module, schedule: Schedule) -> Optimisation:
    """Set up Muon for kernels and hidden matrices, AdamW for the rest; both rates rise and fall.

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
    return Optimisation((muon, _rise_and_fall(schedule)), _adamw_pair(rest, schedule))


def _halving(network: nn.Module, schedule: Schedule) -> Optimisation:
    """Set up Adam with weight decay on all parameters and a rate that halves at equal intervals."""
    parameters = [*network.parameters()]
    optimizer = Adam(
        parameters,
        schedule.learning_rate,
        weight_decay=schedule.weight_decay,
        fused=True,
        capturable=parameters[0].is_cuda,
    )
    interval = max(1, round(schedule.halve_every * schedule.steps))
    return Optimisation((optimizer, lambda done: 0.5 ** (done // interval)))


OPTIMISERS: dict[OptimiserName, Callable[[nn.Module, Schedule], Optimisation]] = {
    "muon": _muon,
    # AdamW (Loshchilov and Hutter, ICLR 2019) for all, its rate rises and falls.
    "adamw": lambda network, schedule: Optimisation(_adamw_pair([*network.parameters()], schedule)),
    "halving": _halving,
}


def _adamw_pair(
    parameters: list[nn.Parameter], schedule: Schedule
) -> tuple[torch.optim.Optimizer, RateFactor]:
    """Set up AdamW that decays weights, but not biases, batch normalisation and loss weights."""
    groups = [
        {"params": [p for p in parameters if p.ndim > 1], "weight_decay": schedule.weight_decay},
        {"params": [p for p in parameters if p.ndim <= 1], "weight_decay": 0.0},
    ]
    optimizer = AdamW(
        groups,
        schedule.learning_rate,
        # A shorter memory of squared gradients than the default: it must fit into a few hundred
        # steps.
        betas=(0.9, 0.99),
        fused=True,
        capturable=parameters[0].is_cuda,
    )
    return optimizer, _rise_and_fall(schedule)


def _rise_and_fall(schedule: Schedule) -> RateFactor:
    """Raise the rate linearly within ``WARM_UP`` of the run, then lower it linearly to 0."""
    steps = schedule.steps
    rise = max(1.0, WARM_UP * steps)
    return lambda done: min((done + 1) / rise, (steps - done) / max(steps - rise, 1.0), 1.0)
