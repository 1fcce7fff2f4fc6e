"""Commands about runs of the workflow: ``synfeal cost``, ``profile``, ``run``, ``compare``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from synfeal.cli import meshes
from synfeal.cli.options import command, given, option
from synfeal.config.collect import CollectConfig, LikeConfig
from synfeal.errors import InputError

SNAKEFILE = Path("Snakefile")
PLUGINS = Path("workflow/plugins")


def _as_cost(typed: Sequence[str]) -> Sequence[str] | None:
    """Recognise ``synfeal plan`` of the version before, which had no argument without a flag."""
    is_cost = typed[:1] == ["plan"] and (len(typed) == 1 or typed[1].split("=")[0] in COST_FLAGS)
    return ["cost", *typed[1:]] if is_cost else None


def _as_profile(typed: Sequence[str]) -> Sequence[str] | None:
    """Recognise ``synfeal collect --print-config`` of the version before."""
    if typed[:1] != ["collect"] or "--print-config" not in typed:
        return None
    return ["profile", *(each for each in typed[1:] if each != "--print-config")]


DEFAULT_PROFILE = "mini"
COST_FLAGS = ("--profile", "--cores", "--measured", "--csv", "--compare")


@command(
    "predict what a run of a profile costs",
    "synfeal cost --profile paper --cores 16",
    option("--profile", "a profile of config/, or its .yaml file (mini)"),
    option(
        "--cores",
        "processor cores, one job each (this machine's); with several numbers, a plan for each",
        type=int,
        nargs="+",
        metavar="N",
    ),
    option(
        "--measured",
        "runs to predict from (results/published/mini and night)",
        type=Path,
        nargs="+",
        metavar="RESULTS",
    ),
    option(
        "--gpu",
        "instead, the hours of training on one GPU, by rates of benchmarks/gpu.py"
        " (results/benchmarks/gpu.csv)",
        type=Path,
        nargs="?",
        const=Path("results/benchmarks/gpu.csv"),
        metavar="RATES",
    ),
    option("--csv", "write the plan as a table too", type=Path, metavar="FILE"),
    option(
        "--compare",
        "instead of a plan, predict this measured run from each of the others, and them from it",
        type=Path,
        metavar="RESULTS",
    ),
    rewriting=_as_cost,
)
def cost(arguments: argparse.Namespace) -> None:
    """Predict jobs, hours, memory and disk of a run of the workflow before it is started."""
    from reproduction.plan.plan import compare_text, plan_text
    from reproduction.runs.published import MEASURED

    profile = arguments.profile or DEFAULT_PROFILE
    if arguments.gpu is not None:
        from reproduction.design.profiles import read_profile
        from reproduction.plan.gpu import gpu_text

        for option_name in ("csv", "compare", "cores", "measured"):
            if getattr(arguments, option_name):
                raise InputError(f"--{option_name}: is of a plan on processors; leave out --gpu")
        print(gpu_text(read_profile(profile), arguments.gpu), end="")
        return
    measured = arguments.measured or MEASURED
    if arguments.compare is not None:
        for option_name in ("profile", "cores"):
            if getattr(arguments, option_name) is not None:
                raise InputError(f"--{option_name}: is of a plan; leave out --compare")
        text = compare_text(measured, arguments.compare, arguments.csv)
    else:
        cores = arguments.cores or [os.cpu_count() or 1]
        if min(cores) < 1:
            raise InputError(f"--cores: must be at least 1, found {min(cores)}")
        text = plan_text(profile, measured, cores, arguments.csv)
    print(text, end="")


@command(
    "print collect's data set as a profile of the workflow",
    "synfeal profile scan.glb --frames 95000 --test-frames 5000 --out mydata",
    *meshes.collect.options,
    was=meshes.collect.was,
    rewriting=_as_profile,
)
def profile(arguments: argparse.Namespace) -> None:
    """Print a configuration from which the workflow makes the data set of the same options.

    It runs on several machines if need be, and trains and compares localizers on the data set.
    """
    from reproduction.config.collected import configuration_text
    from synfeal.collection.settings import collect_config

    config, _ = collect_config(given(arguments, CollectConfig, LikeConfig))
    print(configuration_text(config, arguments.out), end="")


@command(
    "run the workflow with a profile: every table of the paper",
    "synfeal run --profile paper --cores 16 -- runs",
    option(
        "--profile",
        "a profile of config/, or a .yaml file (mini); of several, later ones override earlier"
        " ones",
        nargs="+",
        default=["mini"],
    ),
    option("--cores", "jobs at a time, one core each (this machine's)", type=int, metavar="N"),
    option(
        "snakemake",
        "after --: targets and further options for Snakemake (all)",
        nargs="*",
        metavar="SNAKEMAKE",
    ),
)
def run(arguments: argparse.Namespace) -> None:
    """Run the workflow with a profile of config/ or a configuration of your own.

    It is started in a clone of Synfeal, and shows its progress.
    """
    from reproduction.design.profiles import is_default, profile_path
    from synfeal.config.load import read_yaml

    if not SNAKEFILE.is_file():
        raise InputError(f"{SNAKEFILE}: is not here; start the workflow in a clone of Synfeal")
    cores = os.cpu_count() or 1 if arguments.cores is None else arguments.cores
    if cores < 1:
        raise InputError(f"--cores: must be at least 1, found {cores}")
    paths = [profile_path(name) for name in arguments.profile]
    for path in paths:
        read_yaml(path)  # Snakemake would end in a traceback; what it holds the Snakefile checks
    paths = [path for path in paths if not is_default(path)]
    display = ["--logger", "synfeal", "--quiet", "host"]  # one line that stays
    files = ["--configfile", *map(str, paths)] if paths else []
    command = ["snakemake", *display, *files, "--cores", str(cores), *arguments.snakemake]
    found = (str(PLUGINS.resolve()), os.environ.get("PYTHONPATH"))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, found))}
    os.execve(sys.executable, [sys.executable, "-m", *command], environment)


@command(
    "compare two result trees: did a change matter?",
    "synfeal compare before/mini results/mini --out comparison",
    option("results_a", "results before, e.g. a copy", type=Path, metavar="RESULTS_A"),
    option("results_b", "results after: results/mini", type=Path, metavar="RESULTS_B"),
    option("--out", "directory for compare.csv, compare.md and compare.png", type=Path),
)
def compare(arguments: argparse.Namespace) -> None:
    """Compare two result trees run by run: which errors changed, by how much, with 95 % limits."""
    from reproduction.compare.run import compare as compared

    print(compared(arguments.results_a, arguments.results_b, arguments.out), end="")
    if arguments.out:
        print(f"\n{arguments.out}: compare.md, compare.png and compare.csv")


COMMANDS = (cost, profile, run, compare)
