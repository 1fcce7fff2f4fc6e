"""The optimisation loop shared by all training runs, and its protocols."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import torch

from baselines.localizers.base import Localizer
from baselines.training.averaging import WeightAverage
from baselines.training.data import BatchOrder, ImageStatistics, LabelledFrames
from baselines.training.device import Precision
from baselines.training.optimizer import Optimisation, OptimiserName, Schedule, optimisation_of
from baselines.training.resume import RandomState, Restorable, ResumeFile, stop_signals
from baselines.training.selection import HistoryRow, Selection, SelectionKind, TrainingProgress
from baselines.training.step import (
    Augmentation,
    PlainStep,
    Randomisation,
    TrainingStep,
    training_step,
)


class Protocol(NamedTuple):
    """The parts of a training run that decide what its score means.

    Attributes:
        order: ``shuffled`` draws a new order for every epoch, ``collected`` shows the frames of one
            path after the other, as they were collected.
        selection: Whose errors decide which weights are kept: those on ``validation`` paths held
            out of the training set, those on the ``test`` set. ``last`` keeps the last weights.
            ``averaged`` keeps the mean of those of the last part of the run, and only looks at
            ``validation`` paths.
        distance: ``norm``: Euclidean distances, ``q`` and ``-q`` are one rotation. ``mse``: mean
            squared differences of coordinates, predicted quaternions normalised first.
        optimiser: ``muon`` for kernels and AdamW for the rest, or ``adamw`` for all: the rate
            rises, then falls to nothing. ``halving``: Adam with L2 regularisation of all
            parameters, the rate is halved at regular intervals.
        images: ``rotated``: by ``training.augmentation``; ``plain``: as they were collected.
    """

    order: Literal["shuffled", "collected"]
    selection: SelectionKind
    distance: Literal["norm", "mse"]
    optimiser: OptimiserName
    images: Literal["rotated", "plain"]


# ``published`` is what the paper's authors published as code, in these parts. Their loss on
# the test set is looked at after every epoch or every tenth one, here as often as the validation
# paths; regressors start at the mean training position and incomplete batches are filled in both.
PROTOCOLS: dict[Literal["corrected", "published"], Protocol] = {
    "corrected": Protocol("shuffled", "validation", "norm", "muon", "rotated"),
    "published": Protocol("collected", "test", "mse", "halving", "plain"),
}
# For photographs: ``corrected``, but the weights are averaged. Held-out renderings look like those
# learned from, and do not tell which weights suit photographs.
FOR_PHOTOGRAPHS = PROTOCOLS["corrected"]._replace(selection="averaged")

LAST_WEIGHTS = PROTOCOLS["corrected"]._replace(selection="last")
NOT_KEPT = ResumeFile(None, "")


@dataclass
class Fitting:
    """A training run between two steps: what it is made of, and how a step is taken.

    Attributes:
        localizer: Localizer on the device of the frames.
        frames: Frames to learn from.
        statistics: Statistics of the images.
        optimisation: Optimiser with its schedule.
        order: Order of the frames.
        progress: Losses and history so far.
        selection: Choice of the weights that are kept.
        evaluations: Steps after which these are chosen among.
        precision: Precision of the network; losses and weights are float32.
        randomise: Changes each batch of images before it is normalised.
        augment: Changes each batch of normalised images, and its labels.
        average: Running average of the weights.
    """

    localizer: Localizer
    frames: LabelledFrames
    statistics: ImageStatistics
    optimisation: Optimisation
    order: BatchOrder
    progress: TrainingProgress
    selection: Selection
    evaluations: frozenset[int]
    precision: Precision
    randomise: Randomisation | None
    augment: Augmentation | None
    average: WeightAverage | None

    @property
    def parts(self) -> dict[str, Restorable]:
        """Everything that a later process needs to go on from here."""
        parts: dict[str, Restorable] = {
            "localizer": self.localizer,
            "optimisation": self.optimisation,
            "order": self.order,
            "progress": self.progress,
            "selection": self.selection,
            "random": RandomState(self.frames.images.device),
        }
        further: dict[str, Restorable | None] = {
            "randomise": self.randomise,
            "augment": self.augment,
            "average": self.average,
        }
        return parts | {name: part for name, part in further.items() if part is not None}

    @cached_property
    def take_step(self) -> TrainingStep:
        """Step that learns from one batch, as the device does it best."""
        return training_step(
            PlainStep(
                self.localizer,
                self.frames,
                self.statistics,
                self.optimisation,
                self.precision,
                self.randomise,
                self.augment,
            )
        )

    def step(self) -> None:
        """Learn from the next batch, and look how good the weights are where that is due."""
        rate = self.optimisation.learning_rate
        self.progress.add(self.take_step(self.order.next_batch()))
        if self.average is not None:
            self.average.after(self.progress.done)
        due = self.progress.done in self.evaluations
        self.progress.end_step(rate, self.selection.evaluate() if due else None)


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
    randomise: Randomisation | None = None,
    augment: Augmentation | None = None,
    resume: ResumeFile = NOT_KEPT,
) -> list[HistoryRow]:
    """Train in place and return the history.

    Stops when the loss is no longer finite. Such a run has failed: all its weights become NaN, also
    where weights from before would do, because a good one is not one that was stopped in time.

    Args:
        localizer: Localizer on the device of the frames; it is trained in place.
        frames: Frames to learn from.
        statistics: Statistics of the images.
        schedule: Length and learning rates.
        seed: Seed of the order of the frames; dropout draws from torch's global generator.
        protocol: Order, selection, distance, optimiser and images of the run.
        held_out: Frames that decide which weights are kept; without any it is the last ones.
        patience: Evaluations without a new best after which training stops.
        precision: Precision of the network.
        randomise: Changes how images look, before they are normalised.
        augment: Changes normalised images and the labels with them.
        resume: File of the state; a run that finds its own there goes on with it.
    """
    selection = Selection(protocol.selection, localizer, statistics, held_out, precision)
    run = Fitting(
        localizer,
        frames,
        statistics,
        optimisation_of(protocol.optimiser, localizer, schedule),
        BatchOrder(
            len(frames), schedule.batch_size, seed, protocol.order == "shuffled", frames.rows.device
        ),
        TrainingProgress(schedule.steps, schedule.batch_size, frames.images.device),
        selection,
        selection.due_after(schedule.steps, schedule.samples_seen),
        precision,
        randomise,
        augment,
        WeightAverage(localizer, schedule.steps) if protocol.selection == "averaged" else None,
    )
    localizer.criterion.distance = protocol.distance
    parts = run.parts
    resume.load(parts)
    localizer.train()
    with stop_signals() as stopped:
        while not (stopped() or run.progress.ended or selection.stale(patience)):
            run.step()
            resume.save_if_due(parts, now=stopped())
    if run.progress.diverged:
        for parameter in localizer.parameters():
            parameter.detach().fill_(torch.nan)
    elif run.average is not None:
        run.average.apply()
        run.progress.end(selection.evaluate() if held_out is not None else None)
    else:
        selection.restore()
    return run.progress.rows
