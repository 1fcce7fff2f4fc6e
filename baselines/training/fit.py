"""The one optimisation that every training goes through."""

from __future__ import annotations

from typing import Protocol as Interface

import torch
from torch import Tensor

from baselines.localizers.base import Localizer
from baselines.training.data import ImageStatistics, LabelledFrames
from baselines.training.device import Precision, autocast
from baselines.training.optimizer import Schedule, optimisation_of
from baselines.training.order import BatchOrder
from baselines.training.progress import HistoryRow, Progress
from baselines.training.protocol import PROTOCOLS, Protocol
from baselines.training.resume import RandomState, Restorable, ResumeFile, stop_signals
from baselines.training.selection import Selection

LAST_WEIGHTS = PROTOCOLS["corrected"]._replace(selection="last")
NOT_KEPT = ResumeFile(None, "")


class Augmentation(Restorable, Interface):
    """Changes training images and the labels with them; its state is where its generator stands."""

    def __call__(self, images: Tensor, quat_wxyz: Tensor) -> tuple[Tensor, Tensor]:
        """Other images (B, 3, H, W), normalised, and their unit quaternions (B, 4)."""


def fit(
    localizer: Localizer,
    frames: LabelledFrames,
    statistics: ImageStatistics,
    schedule: Schedule,
    seed: int,
    *,
    protocol: Protocol = LAST_WEIGHTS,
    held_out: LabelledFrames | None = None,
    patience: int | None = None,
    precision: Precision = "float32",
    augment: Augmentation | None = None,
    resume: ResumeFile = NOT_KEPT,
) -> list[HistoryRow]:
    """Train in place and return the history.

    Stops when the loss is no longer finite. Such a training has failed: all its weights become NaN,
    also where weights from before would do, because a good one is not one that was stopped in time.

    Args:
        localizer: on the device of the frames.
        frames: to learn from.
        statistics: of the images.
        schedule: how long and how fast.
        seed: of the order of the frames; dropout draws from torch's global generator.
        protocol: how.
        held_out: frames that decide which weights are kept; without any it is the last ones.
        patience: evaluations without a new best after which training stops.
        precision: of the network; losses and weights are float32.
        augment: applied to each batch of normalised images.
        resume: where the state is kept; a training that finds its own there goes on with it.
    """
    device, steps = frames.images.device, schedule.steps
    optimisation = optimisation_of(protocol.optimiser, localizer, schedule)
    order = BatchOrder(len(frames), schedule.batch_size, seed, protocol.order == "shuffled")
    progress = Progress(steps, schedule.batch_size, device)
    selection = Selection(protocol.selection, localizer, statistics, held_out, precision)
    evaluations = selection.due_after(steps, schedule.samples_seen)
    localizer.criterion.distance = protocol.distance
    parts: dict[str, Restorable] = {
        "localizer": localizer,
        "optimisation": optimisation,
        "order": order,
        "progress": progress,
        "selection": selection,
        "random": RandomState(device),
    }
    if augment is not None:
        parts["augment"] = augment
    resume.load(parts)
    localizer.train()
    with stop_signals() as stopped:
        while not (stopped() or progress.ended or selection.stale(patience)):
            images, position_m, quat_wxyz = frames.batch(order.next_batch().to(device))
            normalised = statistics.normalise(images)
            if augment is not None:
                normalised, quat_wxyz = augment(normalised, quat_wxyz)
            with autocast(device, precision):
                predictions = localizer(normalised)
            loss = localizer.loss(predictions, position_m, quat_wxyz)
            rate = optimisation.learning_rate
            optimisation.step(loss)
            progress.add(loss)
            errors = selection.evaluate() if progress.done in evaluations else None
            progress.end_step(rate, errors)
            resume.save_if_due(parts, now=stopped())
    if progress.diverged:
        _spoil(localizer)
    else:
        selection.restore()
    return progress.rows


@torch.no_grad()
def _spoil(localizer: Localizer) -> None:
    """Leave nothing that could be taken for a result."""
    for parameter in localizer.parameters():
        parameter.fill_(torch.nan)
