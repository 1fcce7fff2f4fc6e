"""Images that a GPU learns from in a second, by localizer, size, batch and kind of step.

    python -m benchmarks.gpu --out results/benchmarks/gpu_here.csv

It needs no data and no network: frames are noise, which costs what pictures cost. Cases are
measured in a process of their own. Where one ends it (by an error that leaves a GPU unusable), a
new one goes on with the case after it, and the table says which is missing.

A step is ``captured`` as training takes it on a GPU, or ``plain``. Several processes at a time
show how many runs one card bears.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
import torch
from torch import Tensor
from torch.nn.functional import normalize

from baselines.config.learning import AugmentationConfig, ModelName, NetworkConfig
from baselines.localizers.registry import build_localizer
from baselines.training.data import LabelledFrames, image_statistics
from baselines.training.device import open_device, precision_on
from baselines.training.optimizer import Schedule, optimisation_of
from baselines.training.photometric import PhotometricRandomisation
from baselines.training.rotation import RandomRotation
from baselines.training.step import WARM_UP_STEPS, PlainStep, TrainingStep, training_step
from baselines.training.train import recipe_of
from synfeal.camera.projection import Intrinsics
from synfeal.config.photometric import PhotometricConfig
from synfeal.errors import InputError, exit_status
from synfeal.records.provenance import git_commit
from synfeal.records.tables import write_frame

ROOT = Path(__file__).resolve().parents[1]
TURNS = AugmentationConfig(tilt_deg=8.0, roll_deg=15.0)
# Frames of noise: more than the caches of a card hold, less than a moment takes to draw.
FRAMES = 512
STEPS_PLANNED = 100_000


class Case(NamedTuple):
    """What is measured.

    Attributes:
        localizer: Name of the localizer.
        input_px: Side of the images.
        width: Factor on the channels.
        batch: Images per step.
        step: Kind of step.
        randomised: Images are shown under random light, lens and sensor.
        rotated: Images are turned at random.
        processes: Processes that do the same at the same time.
    """

    localizer: ModelName
    input_px: int = 224
    width: float = 1.0
    batch: int = 45
    step: Literal["plain", "captured"] = "captured"
    randomised: bool = False
    rotated: bool = False
    processes: int = 1


class Rate(NamedTuple):
    """What was measured: of all processes of a case together, and of the slowest one."""

    images_per_s: float
    step_ms: float
    memory_mb: float  # highest of one process, on the GPU


# Those of the paper, then what changes them, in the order in which they matter.
CASES = (
    Case("posenet2"),
    Case("posenet2", batch=256),
    Case("posenet2", step="plain"),
    Case("posenet2", batch=256, step="plain"),
    Case("posenet2", randomised=True),
    Case("posenet2", batch=256, randomised=True),
    Case("posenet2", randomised=True, rotated=True),
    Case("posenet"),
    Case("poselstm"),
    Case("hourglass"),
    Case("posenet2resnet"),
    Case("posenet2", input_px=64, width=0.25, batch=64),
    Case("posenet2", input_px=64, width=0.25, batch=64, randomised=True),
    Case("posenet2", input_px=64, width=0.25, batch=64, step="plain"),
    Case("posenet2", input_px=64, width=0.25, batch=64, processes=4),
    Case("posenet2", processes=2),
    Case("posenet2", processes=4),
)
TOY_CASES = (
    Case("posenet2", input_px=32, width=0.125, batch=4, step="plain"),
    Case("posenet2", input_px=32, width=0.125, batch=4, randomised=True, rotated=True),
    Case("posenet2", input_px=32, width=0.125, batch=4, processes=2),
)


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
        loss = _some_steps(step, chosen)
        done += STEPS_AT_ONCE
    taken_s = time.perf_counter() - began
    held = torch.cuda.max_memory_allocated(device) if device.type == "cuda" else 0
    return Rate(case.batch * done / taken_s, 1e3 * taken_s / done, held / 1e6)


# Between two looks at the clock, for which the device is waited for.
STEPS_AT_ONCE = 10


def _some_steps(step: TrainingStep, chosen: Tensor) -> Tensor:
    for _ in range(STEPS_AT_ONCE):
        loss = step(chosen)
    float(loss)
    return loss


def work(cases: Sequence[Case], device: torch.device, seconds: float) -> None:
    """Measure cases in this process, and print a line of JSON for each."""
    for case in cases:
        print(json.dumps(rate_of(case, device, seconds)._asdict()), flush=True)


def measure(cases: Sequence[Case], device: str, seconds: float) -> Iterator[tuple[Case, Rate]]:
    """Measure cases in processes of their own; yields those that were not lost."""
    alone = [case for case in cases if case.processes == 1]
    while alone:
        with _worker(alone, device, seconds) as process:
            assert process.stdout is not None
            for line in process.stdout:
                yield alone.pop(0), Rate(**json.loads(line))
        if alone:
            lost = alone.pop(0)
            print(f"lost: {lost}; what it said stands above", file=sys.stderr)
    for case in cases:
        if case.processes > 1:
            rates = _together(case, device, seconds)
            if rates:
                total = sum(rate.images_per_s for rate in rates)
                slowest = max(rate.step_ms for rate in rates)
                yield case, Rate(total, slowest, max(rate.memory_mb for rate in rates))


def _together(case: Case, device: str, seconds: float) -> list[Rate]:
    """Measure a case in several processes at a time; none where one of them was lost."""
    # Starting one takes seconds, not always the same: they measure for longer than it differs.
    workers = [_worker([case], device, 3 * seconds) for _ in range(case.processes)]
    said = [worker.communicate()[0].splitlines() for worker in workers]
    if not all(said):
        print(f"lost: {case}; what it said stands above", file=sys.stderr)
        return []
    return [Rate(**json.loads(lines[-1])) for lines in said]


def _worker(cases: Sequence[Case], device: str, seconds: float) -> subprocess.Popen[str]:
    given = json.dumps([case._asdict() for case in cases])
    options = ["--work", given, "--device", device, "--seconds", str(seconds)]
    command = [sys.executable, "-m", "benchmarks.gpu", *options]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)


def driver_version() -> str:
    """Return the version of the GPU's driver as its own tool says it; empty without one."""
    command = ["nvidia-smi", "--query-gpu=driver_version", "--format=csv,noheader"]
    try:
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return ""
    return said.splitlines()[0].strip() if said.strip() else ""


def origin(device: torch.device) -> dict[str, str]:
    """Say what is measured on, and with which code."""
    on_gpu = device.type == "cuda"
    return {
        "card": torch.cuda.get_device_name(device) if on_gpu else "processor",
        "driver": driver_version() if on_gpu else "",
        "torch": str(torch.__version__),
        "commit": git_commit(ROOT),
    }


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=__doc__)
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--seconds", type=float, default=3.0, help="of every case (3)")
    parser.add_argument("--most-seconds", type=float, default=220.0, help="of all cases (220)")
    parser.add_argument("--toy", action="store_true", help="few small cases, to try the command")
    parser.add_argument("--out", type=Path, help="CSV to write")
    parser.add_argument("--work", help=argparse.SUPPRESS)
    return parser


def run(options: argparse.Namespace) -> None:
    """Measure, print, and write the table after every case.

    Raises:
        InputError: Nothing could be measured.
    """
    device = open_device(options.device)
    if options.work:
        work([Case(**case) for case in json.loads(options.work)], device, options.seconds)
        return
    known, rows = origin(device), []
    began = time.monotonic()
    cases = TOY_CASES if options.toy else CASES
    for case, rate in measure(cases, device.type, options.seconds):
        rows.append({**case._asdict(), **rate._asdict(), **known})
        print(f"{rate.images_per_s:9,.0f} images/s  {rate.step_ms:7.2f} ms  {case}", flush=True)
        if options.out:
            write_frame(options.out, pd.DataFrame(rows), "%.5g")
        if time.monotonic() - began > options.most_seconds:
            print(f"stopped after {options.most_seconds:.0f} s", file=sys.stderr)
            break
    if not rows:
        raise InputError("no case could be measured; what went wrong stands above")
    print(", ".join(f"{name} {value}" for name, value in known.items() if value))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
