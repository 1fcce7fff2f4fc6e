"""Timing of training steps on this machine: a small measured run tells next to nothing.

In ``smoke`` a run is all start: its steps are a fiftieth of it, and what they take is lost in
what a start takes now and then. Some steps of every network tell it in a minute.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import torch
from scipy.optimize import nnls

from baselines.config.learning import LocalizerConfig, ModelName
from baselines.localizers.registry import build_localizer
from baselines.training.data import ImageStatistics, LabelledFrames
from baselines.training.device import open_device, precision_on
from baselines.training.fit import fit
from baselines.training.optimizer import Schedule
from reproduction.config.profile import Config
from reproduction.plan.networks import training_work

STEPS = 4


@dataclass(frozen=True)
class StepRates:
    """Speed of training, by network."""

    rates: tuple[float, float]  # seconds of a training run per layer and step, and per TFLOP
    on_gpu: bool  # seconds from start to end on a GPU, else of processor time


def timed_rates(config: Config) -> StepRates:
    """Time how fast a profile's networks are trained here, on batches of random images."""
    device = open_device(config.training.device)
    batch = config.training.batch_size
    sizes, seconds = [], []
    for name, hyper in config.localizers.items():
        sizes.append(training_work(name, config.network, hyper).size(batch, batch, 0))
        seconds.append(_step_s(name, hyper, config, device))
    relative = np.array(sizes) / np.array(seconds)[:, None]
    (per_layer_s, per_tflop_s), _ = nnls(relative, np.ones(len(sizes)))
    return StepRates((float(per_layer_s), float(per_tflop_s)), device.type == "cuda")


def _step_s(name: ModelName, hyper: LocalizerConfig, config: Config, device: torch.device) -> float:
    """Time a step, seconds; the first one, which sets things up, does not count."""
    torch.manual_seed(0)
    batch, px = config.training.batch_size, config.network.input_px
    localizer = build_localizer(name, config.network, hyper)
    localizer.place_on(device)
    frames = _random_frames(batch, px, device)
    statistics = ImageStatistics(*(torch.full((1, 3, 1, 1), 99.0, device=device) for _ in "ab"))
    precision = precision_on(device, config.training.precision)

    def taken_s(steps: int) -> float:
        begin = _now_s(device)
        schedule = Schedule(steps * batch, batch, 1e-6, 0.0)
        fit(localizer, frames, statistics, schedule, 0, precision=precision)
        return _now_s(device) - begin

    taken_s(1)
    return taken_s(STEPS) / STEPS


def _random_frames(count: int, px: int, device: torch.device) -> LabelledFrames:
    images = torch.randint(256, (count, px, px, 3), dtype=torch.uint8, device=device)
    quat_wxyz = torch.tensor([1.0, 0.0, 0.0, 0.0], device=device).repeat(count, 1)
    return LabelledFrames(
        images.permute(0, 3, 1, 2),
        torch.rand(count, 3, device=device),
        quat_wxyz,
        np.zeros(count, np.int64),
        torch.arange(count, device=device),
    )


def _now_s(device: torch.device) -> float:
    if device.type != "cuda":
        return time.process_time()
    torch.cuda.synchronize(device)
    return time.perf_counter()
