"""Which frames are shown when, and which paths are held out."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from synfeal.seeds import generator_of


class BatchOrder:
    """Batches of frame indices: one epoch after another, cut without regard to epochs.

    Every batch is full, also when the set is smaller than a batch, so batch statistics stay stable.
    """

    def __init__(self, n_frames: int, batch_size: int, seed: int, shuffled: bool = True) -> None:
        self._n_frames, self._batch_size, self._shuffled = n_frames, batch_size, shuffled
        self._generator = torch.Generator().manual_seed(seed)
        self._pending = torch.empty(0, dtype=torch.long)

    def next_batch(self) -> Tensor:
        """Indices (batch_size,) of the next batch."""
        while len(self._pending) < self._batch_size:
            self._pending = torch.cat([self._pending, self._epoch()])
        batch = self._pending[: self._batch_size]
        self._pending = self._pending[self._batch_size :]
        return batch

    def _epoch(self) -> Tensor:
        if self._shuffled:
            return torch.randperm(self._n_frames, generator=self._generator)
        return torch.arange(self._n_frames)

    def state_dict(self) -> dict[str, Any]:
        """Where the order stands."""
        return {"generator": self._generator.get_state(), "pending": self._pending.clone()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on where another order stood."""
        self._generator.set_state(state["generator"])
        self._pending = state["pending"]


def held_out_paths(path: NDArray[np.int64], share: float, seed: int) -> NDArray[np.bool_]:
    """Which frames (N,) are held out: those of a share of the paths, drawn by seed.

    Whole paths, because neighbouring frames of a path are nearly the same image. At least one path
    where there are two or more and ``share`` is not 0; never all.

    Args:
        path: (N,) index of each frame's straight path.
        share: of the paths, 0 to 1.
        seed: of the draw.
    """
    paths = np.unique(path)
    count = min(max(round(share * len(paths)), 1), len(paths) - 1) if share > 0 else 0
    drawn = generator_of("held-out paths", seed).permutation(paths)[:count]
    return np.isin(path, drawn)
