"""The history of a training run, and what its log says."""

from __future__ import annotations

import logging
import math
import time
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import torch
from torch import Tensor

from baselines.training.selection import HeldOutErrors
from synfeal.frames import write_frame

log = logging.getLogger(__name__)

# Seconds between progress lines, and rows of the history of a training run (evaluations add rows).
LOG_EVERY_S = 5.0
HISTORY_ROWS = 50


class HistoryRow(NamedTuple):
    """Mean loss since the row before, and the errors on held-out frames where they were looked at.

    Held out are validation paths or, with the published protocol, the test set.
    """

    samples_seen: int
    loss: float
    learning_rate: float
    held_out_loss: float | None = None
    held_out_position_m: float | None = None
    held_out_orientation_deg: float | None = None


class Progress:
    """Collects the history and says every few seconds how far the training run is."""

    def __init__(self, steps: int, batch_size: int, device: torch.device) -> None:
        self.rows: list[HistoryRow] = []
        self.done = 0
        self._steps, self._batch_size, self._device = steps, batch_size, device
        self._every = max(1, steps // HISTORY_ROWS)
        self._losses: list[Tensor] = []
        self._done_before = 0
        self._start = self._said = time.monotonic()

    @property
    def diverged(self) -> bool:
        """Whether the loss has stopped being finite."""
        return bool(self.rows) and not math.isfinite(self.rows[-1].loss)

    @property
    def ended(self) -> bool:
        """Whether all steps are done, or further ones are pointless."""
        return self.done == self._steps or self.diverged

    def add(self, loss: Tensor) -> None:
        """Note one step. Losses stay on the device until a row is due: a GPU is not waited for."""
        self._losses.append(loss.detach())
        self.done += 1

    def end_step(self, learning_rate: float, errors: HeldOutErrors | None) -> None:
        """Write a row of the history where one is due, or where there are errors to note."""
        if errors is None and self.done % self._every and self.done != self._steps:
            return
        mean = float(torch.stack(self._losses).mean())
        self._losses.clear()
        row = HistoryRow(self.done * self._batch_size, mean, learning_rate, *(errors or ()))
        self.rows.append(row)
        self._say(row)
        if self.diverged:
            log.warning("the loss is %s after %d steps: training stops", mean, self.done)

    def _say(self, row: HistoryRow) -> None:
        now = time.monotonic()
        if now - self._said < LOG_EVERY_S and self.done != self._steps:
            return
        self._said = now
        steps_per_s = (self.done - self._done_before) / max(now - self._start, 1e-9)
        log.info(
            "%d of %d samples, loss %.4f, learning rate %.1e, %.0f samples/s, %.0f s left",
            row.samples_seen,
            self._steps * self._batch_size,
            row.loss,
            row.learning_rate,
            steps_per_s * self._batch_size,
            (self._steps - self.done) / steps_per_s,
        )

    def state_dict(self) -> dict[str, Any]:
        """The history so far."""
        rows = [tuple(row) for row in self.rows]
        return {"rows": rows, "done": self.done, "losses": list(self._losses)}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on with another history."""
        self.rows = [HistoryRow(*row) for row in state["rows"]]
        self.done = self._done_before = state["done"]
        self._losses = [loss.to(self._device) for loss in state["losses"]]


def write_history(path: Path, rows: list[HistoryRow]) -> None:
    """Write the history as CSV, a column per field; empty: not looked at, or no number."""
    write_frame(path, pd.DataFrame(rows, columns=HistoryRow._fields), float_format=None)
