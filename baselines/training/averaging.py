"""The mean of the weights over the last part of a training run.

Single weights jump about in the noise of the last batches; their mean lies in the middle of where
they jump, which other images than those of training change less.

@inproceedings{izmailov2018averaging,
  title     = {Averaging Weights Leads to Wider Optima and Better Generalization},
  author    = {Izmailov, Pavel and Podoprikhin, Dmitrii and Garipov, Timur and Vetrov, Dmitry and
               Wilson, Andrew Gordon},
  booktitle = {Conference on Uncertainty in Artificial Intelligence (UAI)},
  year      = {2018}
}

Difference from the paper: the rate falls to 0 as it does without averaging, and the statistics of
batch normalisation are averaged with the weights instead of being gathered again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

# Share of the run whose weights are averaged, and steps between two of them.
LAST_SHARE = 0.3
EVERY = 5


class WeightAverage:
    """Sums the weights of a network after some of the last steps of a run.

    Args:
        network: Network in training, with its buffers.
        steps: Steps of the whole run.
    """

    def __init__(self, network: nn.Module, steps: int) -> None:
        self._network, self._steps = network, steps
        self._sums: dict[str, Tensor] = {}
        self._count = 0

    @torch.no_grad()
    def after(self, done: int) -> None:
        """Take the weights as they are after ``done`` steps, where they are to be counted."""
        if done < (1 - LAST_SHARE) * self._steps or (self._steps - done) % EVERY:
            return
        self._count += 1
        for name, value in self._values().items():
            if name in self._sums:
                self._sums[name] += value
            else:
                self._sums[name] = value.detach().clone()

    @torch.no_grad()
    def apply(self) -> None:
        """Give the network the mean; its last weights stay where none were counted."""
        for name, value in self._values().items():
            if name in self._sums:
                value.copy_(self._sums[name] / self._count)

    def _values(self) -> dict[str, Tensor]:
        """Return parameters and buffers, except counters."""
        state = self._network.state_dict()
        return {name: value for name, value in state.items() if value.is_floating_point()}

    def state_dict(self) -> dict[str, Any]:
        """Return the sums so far."""
        return {"sums": self._sums, "count": self._count}

    def load_state_dict(self, state: Mapping[str, Any], /) -> None:
        """Go on with other sums."""
        device = next(self._network.parameters()).device
        self._sums = {name: value.to(device) for name, value in state["sums"].items()}
        self._count = state["count"]
