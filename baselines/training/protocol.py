"""How localizers are trained: two protocols, made of parts that can be exchanged one by one."""

from __future__ import annotations

from typing import Literal, NamedTuple

from baselines.training.optimizer import OptimiserName
from synfeal.config.models import ModelName


class Protocol(NamedTuple):
    """The parts of a training run that decide what its score means."""

    # ``shuffled`` draws a new order for every epoch, ``collected`` shows the frames of one path
    # after the other, as they were collected
    order: Literal["shuffled", "collected"]
    # whose errors decide which weights are kept: those on ``validation`` paths held out of the
    # training set, those on the ``test`` set; ``last`` keeps the last weights
    selection: Literal["validation", "test", "last"]
    # ``norm``: Euclidean distances, ``q`` and ``-q`` are one rotation. ``mse``: mean squared
    # differences of coordinates, predicted quaternions normalised first.
    distance: Literal["norm", "mse"]
    # ``muon`` for kernels and AdamW for the rest, or ``adamw`` for all: the rate rises, then falls
    # to nothing. ``halving``: Adam with L2 regularisation of all parameters, the rate is halved at
    # regular intervals.
    optimiser: OptimiserName
    # ``rotated``: by ``training.augmentation``; ``plain``: as they were collected
    images: Literal["rotated", "plain"]


# ``published`` is what the paper's authors published as code, in these parts. Their loss on
# the test set is looked at after every epoch or every tenth one, here as often as the validation
# paths; regressors start at the mean training position and incomplete batches are filled in both.
PROTOCOLS: dict[Literal["corrected", "published"], Protocol] = {
    "corrected": Protocol("shuffled", "validation", "norm", "muon", "rotated"),
    "published": Protocol("collected", "test", "mse", "halving", "plain"),
}

# After which share of a training run the rate is halved: step over epochs in the authors' read-me.
HALVE_EVERY: dict[ModelName, float] = {
    "posenet": 60 / 300,
    "poselstm": 150 / 500,
    "hourglass": 50 / 500,
    "posenet2resnet": 150 / 400,
    "posenet2": 150 / 300,
}
