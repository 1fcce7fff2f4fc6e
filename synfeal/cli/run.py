"""``synfeal run``: the workflow with a profile."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from synfeal.cli.options import Command, Options
from synfeal.errors import InputError

SNAKEFILE = Path("Snakefile")
PLUGINS = Path("workflow/plugins")

OPTIONS: Options = (
    (
        "--profile",
        {
            "nargs": "+",
            "default": ["mini"],
            "help": "a profile of config/, or its .yaml file (mini); of several, later ones go over"
            " earlier ones",
        },
    ),
    (
        "--cores",
        {"type": int, "metavar": "N", "help": "jobs at a time, one core each (this machine's)"},
    ),
    (
        "snakemake",
        {
            "nargs": "*",
            "metavar": "SNAKEMAKE",
            "help": "after --: targets and further options of Snakemake (all)",
        },
    ),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command: from here on the process is Snakemake's."""
    # Above this module, as in architecture.md.
    from synfeal.config.load import read_yaml
    from synfeal.report.cost.profiles import is_default, profile_path

    if not SNAKEFILE.is_file():
        raise InputError(f"{SNAKEFILE}: is not here; start the workflow in a clone of Synfeal")
    cores = os.cpu_count() or 1 if arguments.cores is None else arguments.cores
    if cores < 1:
        raise InputError(f"--cores: must be at least 1, found {cores}")
    paths = [profile_path(name) for name in arguments.profile]
    for path in paths:
        read_yaml(path)  # Snakemake would end in a traceback; what it holds the Snakefile checks
    paths = [path for path in paths if not is_default(path)]
    command = snakemake_command(paths, cores, arguments.snakemake)
    os.execve(sys.executable, [sys.executable, "-m", *command], _with_plugins(os.environ))


def snakemake_command(profiles: list[Path], cores: int, further: list[str]) -> list[str]:
    """What is started: one line that stays and a table of scores, all else in Snakemake's log."""
    display = ["--logger", "synfeal", "--quiet", "host"]
    files = ["--configfile", *map(str, profiles)] if profiles else []
    return ["snakemake", *display, *files, "--cores", str(cores), *further]


def _with_plugins(environment: Mapping[str, str]) -> dict[str, str]:
    before = environment.get("PYTHONPATH")
    paths = [str(PLUGINS.resolve()), *([before] if before else [])]
    return {**environment, "PYTHONPATH": os.pathsep.join(paths)}


COMMAND = Command(
    "run",
    "the workflow with a profile: every table of the paper",
    "Runs the workflow with a profile of config/ or a configuration of your own, in a clone of"
    " Synfeal, and shows where it is.",
    "synfeal run --profile paper --cores 16 -- runs",
    OPTIONS,
    run,
)
