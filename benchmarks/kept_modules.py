"""Processor time that jobs spend on imports, with compiled modules kept and without.

Writes ``results/benchmarks/kept_modules.csv``, a row for each kind of job::

    python -m benchmarks.kept_modules --results results/published/mini

Python keeps what it compiled of a module beside it, unless ``PYTHONDONTWRITEBYTECODE`` is set. Then
each process compiles all that it imports. Every import is timed in a process of its own, in turns.
"""

from __future__ import annotations

import argparse
import ast
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from benchmarks.processes import ROOT, seconds_of_process
from reproduction.runs.job_times import read_measured
from synfeal.errors import InputError, exit_status
from synfeal.records.tables import write_frame

SCRIPTS = ROOT / "workflow" / "scripts"
# Script of the jobs that a run has many of, by stage.
SCRIPT_OF = {
    "train": "run_train",
    "render_packed": "run_render_packed",
    "rgbd": "run_rgbd",
    "sfm": "run_sfm",
    "rgbd-toro": "run_posegraph",
    "rgbd-g2o": "run_posegraph",
    "labels": "run_erroneous_labels",
    "image_references": "run_references",
}


def imports_of(script: Path) -> str:
    """Return the import statements of a script, wherever they stand, as a program."""
    nodes = ast.walk(ast.parse(script.read_text(encoding="utf-8")))
    found = [ast.unparse(n) for n in nodes if isinstance(n, (ast.Import, ast.ImportFrom))]
    return "\n".join(found)


def import_s(program: str, rounds: int) -> tuple[float, float]:
    """Return the median processor seconds of a program with kept modules, and without.

    Args:
        program: Import statements.
        rounds: How often each is timed, after a first time that fills the store.
    """
    with TemporaryDirectory() as folder:
        kept, empty = (Path(folder) / name for name in ("kept", "empty"))
        setting = {
            "kept": ["-X", f"pycache_prefix={kept}"],
            "anew": ["-B", "-X", f"pycache_prefix={empty}"],
        }
        commands = {
            name: [sys.executable, *options, "-c", program] for name, options in setting.items()
        }
        seconds_of_process(commands["kept"])
        taken = [
            [seconds_of_process(command).cpu for command in commands.values()]
            for _ in range(rounds)
        ]
    with_kept, anew = np.median(taken, axis=0)
    return float(with_kept), float(anew)


def starts(jobs: pd.DataFrame, rounds: int) -> pd.DataFrame:
    """Tabulate what the imports of the jobs of a run take, by stage.

    Args:
        jobs: Jobs of a run, with ``stage`` and ``cpu_s``.
        rounds: How often each import is timed.

    Raises:
        InputError: the run has no job of the stages in ``SCRIPT_OF``.
    """
    rows = []
    for stage, script in SCRIPT_OF.items():
        of_stage = jobs[jobs["stage"] == stage]
        if of_stage.empty:
            continue
        kept, anew = import_s(imports_of(SCRIPTS / f"{script}.py"), rounds)
        rows.append(
            {
                "stage": stage,
                "jobs": len(of_stage),
                "run_cpu_s": of_stage["cpu_s"].sum(),
                "kept_cpu_s": kept,
                "anew_cpu_s": anew,
                "saved_cpu_s": len(of_stage) * (anew - kept),
            }
        )
    if not rows:
        raise InputError("the run has no job of " + ", ".join(SCRIPT_OF))
    return pd.DataFrame(rows)


def run(options: argparse.Namespace) -> None:
    """Write the table, and print it."""
    # Else nothing would be kept in either case.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    table = starts(read_measured(options.results), options.rounds)
    print(table.to_string(index=False))
    print(f"saved in all: {table['saved_cpu_s'].sum():.0f} s")
    write_frame(options.out, table, "%.4g")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.kept_modules")
    parser.add_argument("--results", type=Path, default=Path("results/published/mini"))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/kept_modules.csv"))
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
