"""Compare the processor time of ``make reproduce``, by part, with that at another commit.

Writes ``results/benchmarks/reproduce_cost.csv``::

    mkdir before
    git show bdfa7c9:results/published/mini/benchmarks.csv > before/benchmarks.csv
    python -m benchmarks.reproduce_cost --before before --now results/mini

The two runs were on different machines, and neither had its machine to itself. Jobs of stages
whose work has not changed in between tell by how much the one was slower than the other, and all
processor seconds of the earlier run are multiplied by that.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from baselines.labels.methods import frame_methods, graph_methods
from reproduction.runs.job_times import read_measured
from synfeal.errors import InputError, exit_status
from synfeal.records.tables import write_frame

REST = "scenes, plans, evidence"
PARTS = {
    "frames": ["detail", "render", "render_packed", "pack"],
    "labels": ["labels", "sfm", "rgbd", *frame_methods(), *graph_methods(), "chain"],
    "references": [
        "cell_depth",
        "descriptors",
        "features",
        "correspondences",
        "tracks",
        "views",
        "image_references",
        "structure_references",
        "adjusted_references",
        "coordinate_references",
        "external_reference",
    ],
    "robustness": [
        "light_shares",
        "render_varied",
        "pack_varied",
        "train_varied",
        "varied_descriptors",
        "varied_structure",
        "effects_speed",
    ],
    "training": ["pretrain", "train", "score"],
}
PART_OF = {stage: part for part, stages in PARTS.items() for stage in stages}
# Processor seconds of version 0.1 on the machine of the other commit's run.
VERSION_01_S = {"frames": 261.0, "labels": 247.0, "training": 3269.0, REST: 284.0}
# What these compute, and of how many frames, is the same at both commits.
UNCHANGED = ["rgbd", "rgbd-toro", "rgbd-g2o"]


def part_of(stage: str) -> str:
    """Return the part of the run that a stage belongs to."""
    return PART_OF.get(stage, REST)


def slower_here(before: pd.DataFrame, now: pd.DataFrame) -> float:
    """Return how many times the processor seconds unchanged work took in the run now.

    Args:
        before: Jobs of the other commit's run, with ``stage``, ``job`` and ``cpu_s``.
        now: Jobs of the run now.

    Raises:
        InputError: no job of unchanged work is in both.
    """
    both = before.merge(now, on=["stage", "job"], suffixes=("_before", "_now"))
    same = both[both["stage"].isin(UNCHANGED)]
    if same.empty:
        raise InputError(f"the runs have no jobs of {', '.join(UNCHANGED)} in common")
    return float(same["cpu_s_now"].sum() / same["cpu_s_before"].sum())


def cost_by_part(before: pd.DataFrame, now: pd.DataFrame) -> pd.DataFrame:
    """Add up jobs and processor seconds of two runs by part; of ``before`` also as if it ran here.

    Args:
        before: Jobs of the other commit's run, with ``stage``, ``job`` and ``cpu_s``.
        now: Jobs of the run now.
    """
    factor = slower_here(before, now)
    rows = []
    for part in (*PARTS, REST):
        there = before.loc[before["stage"].map(part_of) == part, "cpu_s"]
        here = now.loc[now["stage"].map(part_of) == part, "cpu_s"]
        rows.append(
            {
                "part": part,
                "version_01_cpu_s": VERSION_01_S.get(part, 0.0) * factor,
                "before_jobs": len(there),
                "before_cpu_s_there": there.sum(),
                "before_cpu_s": there.sum() * factor,
                "jobs": len(here),
                "cpu_s": here.sum(),
            }
        )
    table = pd.DataFrame(rows)
    total = table.drop(columns="part").sum()
    table = pd.concat([table, pd.DataFrame([{"part": "all", **total}])], ignore_index=True)
    return table.assign(ratio=table["cpu_s"] / table["before_cpu_s"])


def text_of(table: pd.DataFrame) -> str:
    """Return the table in Markdown, as docs/cost.md has it."""
    shown = pd.DataFrame(
        {
            "part": table["part"],
            "jobs": table["jobs"].map("{:.0f}".format),
            "processor seconds": table["cpu_s"].map("{:,.0f}".format),
            "at `bdfa7c9`: jobs": table["before_jobs"].map("{:.0f}".format),
            "seconds": table["before_cpu_s"].map("{:,.0f}".format),
            "ratio": table["ratio"].map("{:.2f}".format),
        }
    )
    return str(shown.to_markdown(index=False, disable_numparse=True))


def run(options: argparse.Namespace) -> None:
    """Write the table, and print it in Markdown."""
    before, now = read_measured(options.before), read_measured(options.now)
    table = cost_by_part(before, now)
    seconds = [name for name in table if "cpu_s" in str(name)]
    whole = ["before_jobs", "jobs", *seconds]
    table = table.round(dict.fromkeys(seconds, 0) | {"ratio": 3}).astype(dict.fromkeys(whole, int))
    write_frame(options.out, table, float_format=None)
    print(f"slower here: {slower_here(before, now):.3f} times", text_of(table), sep="\n\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reproduce_cost")
    parser.add_argument("--before", type=Path, required=True, help="results of the other commit")
    parser.add_argument("--now", type=Path, default=Path("results/published/mini"))
    out = Path("results/benchmarks/reproduce_cost.csv")
    parser.add_argument("--out", type=Path, default=out)
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
