"""``synfeal plan``: what does a run cost?"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from synfeal.cli.options import Command, Options
from synfeal.errors import InputError

if TYPE_CHECKING:
    from synfeal.report.cost.estimate import Machine

OPTIONS: Options = (
    ("--profile", {"default": "mini", "help": "a profile of config/, or its .yaml file (mini)"}),
    (
        "--cores",
        {
            "type": int,
            "nargs": "+",
            "metavar": "N",
            "help": "processor cores, one job each (this machine's); several: a plan for each",
        },
    ),
    (
        "--gpus",
        {
            "type": int,
            "nargs": "+",
            "default": [0],
            "metavar": "N",
            "help": "GPUs, one training run each (0: train on cores); as many as --cores, or one",
        },
    ),
    (
        "--gpu-tflops",
        {"type": float, "default": 10.0, "help": "assumed throughput of a GPU, TFLOP/s (10)"},
    ),
    (
        "--measured",
        {
            "type": Path,
            "nargs": "+",
            "default": [Path("results/published/mini")],
            "metavar": "RESULTS",
            "help": "runs to predict from (results/published/mini)",
        },
    ),
    (
        "--time-steps",
        {"action": "store_true", "help": "time some training steps on this machine: a minute"},
    ),
    ("--csv", {"type": Path, "metavar": "FILE", "help": "write the plan as a table too"}),
    (
        "--compare",
        {
            "type": Path,
            "metavar": "RESULTS",
            "help": "no plan: predict this measured run from the others, and these from it",
        },
    ),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    # Above this module, as in architecture.md.
    from synfeal.report.cost.plan import compare_runs, plan_of, write_check, write_plans
    from synfeal.report.cost.text import comparison_text, plan_text

    machines = _machines(arguments)
    if arguments.compare is None:
        plans = plan_of(arguments.profile, arguments.measured, machines, arguments.time_steps)
        print(plan_text(plans), end="")
        if arguments.csv is not None:
            write_plans(arguments.csv, plans)
    else:
        comparisons = compare_runs(arguments.measured, arguments.compare, arguments.time_steps)
        print(comparison_text(comparisons), end="")
        if arguments.csv is not None:
            write_check(arguments.csv, comparisons)


def _machines(arguments: argparse.Namespace) -> list[Machine]:
    """What to plan for.

    Raises:
        InputError: a number is out of range, or there are more of one kind than of the other.
    """
    from synfeal.report.cost.estimate import Machine

    cores, gpus = arguments.cores or [os.cpu_count() or 1], arguments.gpus
    for flag, values, least in (("--cores", cores, 1), ("--gpus", gpus, 0)):
        if min(values) < least:
            raise InputError(f"{flag}: must be at least {least}, found {min(values)}")
    if not 0 < arguments.gpu_tflops < float("inf"):
        raise InputError(f"--gpu-tflops: must be above 0, found {arguments.gpu_tflops:g}")
    gpus = gpus * len(cores) if len(gpus) == 1 else gpus
    if len(gpus) != len(cores):
        raise InputError(f"--gpus: {len(gpus)} numbers for {len(cores)} of --cores; give as many")
    return [Machine(c, g, arguments.gpu_tflops) for c, g in zip(cores, gpus, strict=True)]


COMMAND = Command(
    "plan",
    "what a run of a profile costs before it is started",
    "Predicts jobs, hours, memory and disk of a run of the workflow before it is started.",
    "synfeal plan --profile paper --cores 16 --gpus 1",
    OPTIONS,
    run,
)
