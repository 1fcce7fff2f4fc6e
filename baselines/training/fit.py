"""The one optimisation that every training goes through."""

from __future__ import annotations

import csv
import logging
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.optim.lr_scheduler import OneCycleLR

from baselines.localizers.base import Localizer
from baselines.training.data import ImageStatistics, LabelledFrames
from synfeal.files import atomic_path

log = logging.getLogger(__name__)

# Seconds between progress lines, and rows of the history of a training.
LOG_EVERY_S = 5.0
HISTORY_ROWS = 50


class Schedule(NamedTuple):
    """How long and how fast to learn."""

    samples_seen: int
    batch_size: int
    learning_rate: float
    weight_decay: float


class HistoryRow(NamedTuple):
    """Mean loss since the row before."""

    samples_seen: int
    loss: float
    learning_rate: float


def fit(
    localizer: Localizer,
    frames: LabelledFrames,
    statistics: ImageStatistics,
    schedule: Schedule,
    seed: int,
) -> list[HistoryRow]:
    """Train in place with AdamW and a one-cycle schedule (Smith and Topin, 2019).

    Stops early when the loss is no longer finite: the run then scores as failed.
    """
    steps = -(-schedule.samples_seen // schedule.batch_size)
    # A shorter memory of squared gradients than the default: it must fit into a few hundred steps.
    optimizer = torch.optim.AdamW(
        _parameter_groups(localizer, schedule.weight_decay), betas=(0.9, 0.99), fused=True
    )
    scheduler = OneCycleLR(
        optimizer, schedule.learning_rate, total_steps=max(steps, 2), pct_start=0.2
    )
    progress = Progress(steps, schedule.batch_size)
    localizer.train()
    for indices in shuffled_batches(len(frames), schedule.batch_size, steps, seed):
        indices = indices.to(frames.images.device)
        predictions = localizer(statistics.normalise(frames.images[indices]))
        loss = localizer.loss(predictions, frames.position_m[indices], frames.quat_wxyz[indices])
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        rate = float(scheduler.get_last_lr()[0])
        scheduler.step()
        if not progress.record(loss, rate):
            break
    return progress.rows


def shuffled_batches(n_frames: int, batch_size: int, steps: int, seed: int) -> Iterator[Tensor]:
    """``steps`` batches of indices: one shuffled epoch after another, cut without regard to epochs.

    Every batch is full, also when the set is smaller than a batch, so batch statistics stay stable.
    """
    generator = torch.Generator().manual_seed(seed)
    pending = torch.empty(0, dtype=torch.long)
    for _ in range(steps):
        while len(pending) < batch_size:
            pending = torch.cat([pending, torch.randperm(n_frames, generator=generator)])
        yield pending[:batch_size]
        pending = pending[batch_size:]


class Progress:
    """Collects the history and says every few seconds how far the training is."""

    def __init__(self, steps: int, batch_size: int) -> None:
        self.rows: list[HistoryRow] = []
        self._steps, self._batch_size = steps, batch_size
        self._every = max(1, steps // HISTORY_ROWS)
        self._losses: list[Tensor] = []
        self._done = 0
        self._start = self._said = time.monotonic()

    def record(self, loss: Tensor, learning_rate: float) -> bool:
        """Note one step; False when the loss has stopped being finite.

        Losses are fetched from the device once per row, so that a GPU is not waited for.
        """
        self._losses.append(loss.detach())
        self._done += 1
        if self._done % self._every and self._done != self._steps:
            return True
        mean = float(torch.stack(self._losses).mean())
        self._losses.clear()
        self.rows.append(HistoryRow(self._done * self._batch_size, mean, learning_rate))
        self._say(mean, learning_rate)
        if mean != mean or abs(mean) == float("inf"):
            log.warning("the loss is %s after %d steps: training stops", mean, self._done)
            return False
        return True

    def _say(self, loss: float, learning_rate: float) -> None:
        now = time.monotonic()
        if now - self._said < LOG_EVERY_S and self._done != self._steps:
            return
        self._said = now
        left_s = (now - self._start) / self._done * (self._steps - self._done)
        samples = self._done * self._batch_size
        message = "%d of %d samples, loss %.4f, learning rate %.1e, %.0f s left"
        log.info(message, samples, self._steps * self._batch_size, loss, learning_rate, left_s)


def write_history(path: Path, rows: list[HistoryRow]) -> None:
    """Write the history as CSV, one column per field of a row."""
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HistoryRow._fields)
        writer.writerows(rows)


def _parameter_groups(localizer: nn.Module, weight_decay: float) -> list[dict[str, object]]:
    """Weights decay; biases, batch normalisation and loss weights do not."""
    parameters = list(localizer.parameters())
    weights = [p for p in parameters if p.ndim > 1]
    others = [p for p in parameters if p.ndim <= 1]
    return [
        {"params": weights, "weight_decay": weight_decay},
        {"params": others, "weight_decay": 0.0},
    ]
