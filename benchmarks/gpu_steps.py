"""Training steps that :mod:`benchmarks.gpu` measures, in the processes that take them."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import normalize

from baselines.config.learning import AugmentationConfig, NetworkConfig
from baselines.localizers.registry import build_localizer
from baselines.training.data import LabelledFrames, image_statistics
from baselines.training.device import precision_on
from baselines.training.optimizer import Schedule, optimisation_of
from baselines.training.photometric import PhotometricRandomisation
from baselines.training.rotation import RandomRotation
from baselines.training.step import WARM_UP_STEPS, PlainStep, TrainingStep, training_step
from baselines.training.train import recipe_of
from benchmarks.gpu_cases import Case, Machine, Rate
from synfeal.camera.projection import Intrinsics
from synfeal.config.photometric import PhotometricConfig
from synfeal.records.provenance import git_commit

ROOT = Path(__file__).resolve().parents[1]
TURNS = AugmentationConfig(tilt_deg=8.0, roll_deg=15.0)
# Frames of noise: more than the caches of a card hold, less than a moment takes to draw.
FRAMES = 512
STEPS_PLANNED = 100_000


def step_of(case: Case, device: torch.device) -> TrainingStep:
    """Set up a training run on frames of noise with random poses, and return its step."""
    torch.manual_seed(0)
    side = case.input_px
    images = torch.randint(0, 256, (FRAMES, side, side, 3), dtype=torch.uint8, device=device)
    frames = LabelledFrames(
        images=images.permute(0, 3, 1, 2),
        position_m=torch.randn(FRAMES, 3, device=device),
        quat_wxyz=normalize(torch.randn(FRAMES, 4, device=device), dim=1),
        path=np.arange(FRAMES, dtype=np.int64),
        rows=torch.arange(FRAMES, device=device),
    )
    hyper = recipe_of(case.localizer)
    network = NetworkConfig(input_px=side, width=case.width, view="whole")
    localizer = build_localizer(case.localizer, network, hyper)
    localizer.place_on(device)
    localizer.train()
    schedule = Schedule(
        samples_seen=STEPS_PLANNED * case.batch,
        batch_size=case.batch,
        learning_rate=hyper.learning_rate,
        weight_decay=hyper.weight_decay,
    )
    camera = Intrinsics(fx=float(side), fy=float(side), cx=side / 2, cy=side / 2)
    light = PhotometricRandomisation(PhotometricConfig(), 0, device) if case.randomised else None
    plain = PlainStep(
        localizer=localizer,
        frames=frames,
        statistics=image_statistics(frames.images),
        optimisation=optimisation_of("muon", localizer, schedule),
        precision=precision_on(device, "auto"),
        randomise=light,
        augment=RandomRotation(camera, side, TURNS, 0, device) if case.rotated else None,
    )
    captured = training_step(plain)  # chooses the convolutions of plain steps, too
    return captured if case.step == "captured" else plain


def rate_of(case: Case, device: torch.device, seconds: float) -> Rate:
    """Take steps for so many seconds, after those that set up what later ones keep."""
    if device.type == "cuda":
        torch.cuda.empty_cache()
        torch.cuda.reset_peak_memory_stats(device)
    step = step_of(case, device)
    chosen = torch.arange(case.batch, device=device) % FRAMES
    for _ in range(WARM_UP_STEPS + 2):
        loss = step(chosen)
    float(loss)  # waits for the device
    began, done = time.perf_counter(), 0
    while done == 0 or time.perf_counter() - began < seconds:
        _take_steps(step, chosen)
        done += STEPS_AT_ONCE
    taken_s = time.perf_counter() - began
    held = torch.cuda.max_memory_allocated(device) if device.type == "cuda" else 0
    return Rate(case.batch * done / taken_s, 1e3 * taken_s / done, held / 1e6)


# Between two looks at the clock, for which the device is waited for.
STEPS_AT_ONCE = 10


def _take_steps(step: TrainingStep, chosen: Tensor) -> None:
    for _ in range(STEPS_AT_ONCE):
        loss = step(chosen)
    float(loss)  # waits for the device


def machine_of(device: torch.device) -> Machine:
    """Return the machine that is measured."""
    on_gpu = device.type == "cuda"
    return Machine(
        card=torch.cuda.get_device_name(device) if on_gpu else "processor",
        driver=_driver_version() if on_gpu else "",
        torch=str(torch.__version__),
        commit=git_commit(ROOT),
    )


def _driver_version() -> str:
    """Ask the driver's own tool for its version; empty where that does not answer."""
    command = ["nvidia-smi", "--query-gpu=driver_version", "--format=csv,noheader"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""
    return said.partition("\n")[0].strip()
