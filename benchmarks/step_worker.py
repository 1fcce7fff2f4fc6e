"""Training steps of one localizer, on demand: each line read is a number of steps to take.

Each line written is the processor time in seconds that they took. Run by
:mod:`benchmarks.step_time`, once for each tree that is compared; imports are those of that tree.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import torch
from torch.nn.functional import normalize

from baselines.config.learning import ModelName
from baselines.localizers.registry import build_localizer
from baselines.training.data import BatchOrder, LabelledFrames, image_statistics
from baselines.training.device import open_device, precision_on
from baselines.training.fit import PROTOCOLS, Fitting
from baselines.training.optimizer import Schedule, optimisation_of
from baselines.training.rotation import RandomRotation
from baselines.training.selection import Selection, TrainingProgress
from reproduction.config.load import load_config
from synfeal.camera.projection import Intrinsics

FRAMES = 512
STEPS_PLANNED = 10_000


def fitting_of(model: ModelName, profile: Path) -> Fitting:
    """Set up a training run as a profile trains, on frames of noise with random poses."""
    config = load_config(profile)
    device = open_device(config.training.device)
    torch.manual_seed(0)
    side, hyper = config.network.input_px, config.localizers[model]
    images = torch.randint(0, 256, (FRAMES, side, side, 3), dtype=torch.uint8).permute(0, 3, 1, 2)
    frames = LabelledFrames(
        images=images.to(device),
        position_m=torch.randn(FRAMES, 3, device=device),
        quat_wxyz=normalize(torch.randn(FRAMES, 4, device=device), dim=1),
        path=np.arange(FRAMES, dtype=np.int64),
        rows=torch.arange(FRAMES, device=device),
    )
    localizer = build_localizer(model, config.network, hyper)
    localizer.place_on(device)
    localizer.train()
    batch_size = config.training.batch_size
    schedule = Schedule(
        samples_seen=STEPS_PLANNED * batch_size,
        batch_size=batch_size,
        learning_rate=hyper.learning_rate,
        weight_decay=hyper.weight_decay,
    )
    statistics = image_statistics(frames.images)
    precision = precision_on(device, config.training.precision)
    camera = Intrinsics(fx=float(side), fy=float(side), cx=side / 2, cy=side / 2)
    return Fitting(
        localizer=localizer,
        frames=frames,
        statistics=statistics,
        optimisation=optimisation_of(
            PROTOCOLS[config.training.protocol].optimiser, localizer, schedule
        ),
        order=BatchOrder(FRAMES, batch_size, seed=0),
        progress=TrainingProgress(schedule.steps, batch_size, device),
        selection=Selection("last", localizer, statistics, None, precision),
        evaluations=frozenset(),
        precision=precision,
        augment=RandomRotation(camera, side, config.training.augmentation, 0),
        randomise=None,
        average=None,
    )


def main(model: str, profile: str) -> None:
    """Take as many steps as each line of standard input says, until it ends."""
    run = fitting_of(model, Path(profile))
    for line in sys.stdin:
        began = time.process_time()
        for _ in range(int(line)):
            run.step()
        print(time.process_time() - began, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
