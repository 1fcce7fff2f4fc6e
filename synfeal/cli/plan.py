"""``synfeal plan``: what does a run cost?"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from synfeal.cli.options import Command, Options
from synfeal.errors import InputError

OPTIONS: Options = (
    ("--profile", {"default": "mini", "help": "a profile of config/, or its .yaml file (mini)"}),
    ("--cores", {"type": int, "help": "processor cores, one job each (this machine's)"}),
    ("--gpus", {"type": int, "default": 0, "help": "GPUs, one training each (0: train on cores)"}),
    (
        "--gpu-tflops",
        {"type": float, "default": 10.0, "help": "assumed of a training on a GPU, TFLOP/s (10)"},
    ),
    (
        "--measured",
        {
            "type": Path,
            "nargs": "+",
            "default": [Path("results/mini")],
            "metavar": "RESULTS",
            "help": "runs to predict from (results/mini)",
        },
    ),
    (
        "--compare",
        {"type": Path, "metavar": "RESULTS", "help": "show the prediction for this measured run"},
    ),
    ("--csv", {"type": Path, "metavar": "FILE", "help": "write the table of stages too"}),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.report.cost.estimate import Machine  # above this module, as in architecture.md
    from synfeal.report.cost.run import comparison_text, plan_text

    cores = arguments.cores if arguments.cores is not None else os.cpu_count() or 1
    for flag, value, least in (("--cores", cores, 1), ("--gpus", arguments.gpus, 0)):
        if value < least:
            raise InputError(f"{flag}: must be at least {least}, found {value}")
    if not 0 < arguments.gpu_tflops < float("inf"):
        raise InputError(f"--gpu-tflops: must be above 0, found {arguments.gpu_tflops:g}")
    machine = Machine(cores, arguments.gpus, arguments.gpu_tflops)
    print(plan_text(arguments.profile, arguments.measured, machine, arguments.csv), end="")
    if arguments.compare is not None:
        print(f"\n{comparison_text(arguments.measured, arguments.compare)}", end="")


COMMAND = Command("plan", "what a run of a profile costs before it is started", OPTIONS, run)
