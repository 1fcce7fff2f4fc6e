"""Torch's optimisers without its compiler, which is slow to import and unused here.

Methods of ``torch.optim.Optimizer`` are wrapped so that ``torch.compile`` leaves them alone. The
first call of any of them imports the compiler, with SymPy and a thousand modules more, which takes
about as much processor time as importing torch itself. Here the same methods are called without
their wrappers.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import unwrap
from typing import Any

import torch
from torch.optim import Optimizer


class Untraced(Optimizer):
    """An optimiser that does not import torch's compiler."""

    def add_param_group(self, param_group: dict[str, Any]) -> None:
        """See ``torch.optim.Optimizer.add_param_group``."""
        unwrap(Optimizer.add_param_group)(self, param_group)

    def zero_grad(self, set_to_none: bool = True) -> None:
        """See ``torch.optim.Optimizer.zero_grad``."""
        unwrap(Optimizer.zero_grad)(self, set_to_none)

    def state_dict(self) -> dict[str, Any]:
        """See ``torch.optim.Optimizer.state_dict``."""
        state: dict[str, Any] = unwrap(Optimizer.state_dict)(self)
        return state

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """See ``torch.optim.Optimizer.load_state_dict``."""
        unwrap(Optimizer.load_state_dict)(self, state_dict)


class Adam(Untraced, torch.optim.Adam):
    """Adam (Kingma and Ba, ICLR 2015)."""

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> None:  # type: ignore[override]
        """Take one step for every parameter that has a gradient."""
        unwrap(torch.optim.Adam.step)(self, closure)


class AdamW(Untraced, torch.optim.AdamW):
    """AdamW (Loshchilov and Hutter, ICLR 2019)."""

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> None:  # type: ignore[override]
        """Take one step for every parameter that has a gradient."""
        unwrap(torch.optim.AdamW.step)(self, closure)
