r"""Compare the processor time of ``make reproduce``, by part, with that at another commit.

Writes ``results/benchmarks/reproduce_cost.csv``::

    mkdir before
    git show bdfa7c9:results/published/mini/benchmarks.csv > before/benchmarks.csv
    python -m benchmarks.reproduce_cost --before before --before-here sample_before/results/mini \
      --now results/mini --now-here sample_now/results/mini

The two runs were on different machines, and neither had its machine to itself. So some jobs of both
commits are repeated side by side on one machine (``--before-here``, ``--now-here``), and the
processor seconds of every stage of a run are multiplied by what its repeated jobs took here
relative to there. Repeat jobs with the settings of their run: one of the same name counts as the
same work. Leave out of ``now`` what the present commit no longer runs; the published table is of
``results/published/mini`` without the 41 jobs that have KinectFusion in stage or name.
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


def part_of(stage: str) -> str:
    """Return the part of the run that a stage belongs to."""
    return PART_OF.get(stage, REST)


def as_if_here(run: pd.DataFrame, repeated: pd.DataFrame) -> pd.DataFrame:
    """Scale the processor seconds of a run to those on the machine where some jobs were repeated.

    Args:
        run: Jobs of the run, with ``stage``, ``job`` and ``cpu_s``.
        repeated: The same of the repeated jobs. A stage that has none of them is scaled as all
            repeated jobs together.

    Returns:
        The jobs of the run, with ``here_cpu_s`` and ``repeated``, whether the job was repeated.

    Raises:
        InputError: no repeated job is one of the run's.
    """
    both = run.merge(repeated, on=["stage", "job"], suffixes=("", "_here"))
    if both.empty:
        raise InputError("none of the repeated jobs is one of the run's; repeat jobs of that run")
    seconds = both.groupby("stage")[["cpu_s", "cpu_s_here"]].sum()
    usual = seconds["cpu_s_here"].sum() / seconds["cpu_s"].sum()
    slower = run["stage"].map(seconds["cpu_s_here"] / seconds["cpu_s"]).fillna(usual)
    keys = ["stage", "job"]
    again = pd.MultiIndex.from_frame(run[keys]).isin(pd.MultiIndex.from_frame(both[keys]))
    return run.assign(here_cpu_s=run["cpu_s"] * slower, repeated=again)


def cost_by_part(before: pd.DataFrame, now: pd.DataFrame) -> pd.DataFrame:
    """Add up jobs and processor seconds of two runs by part.

    Args:
        before: Jobs of the other commit's run, as :func:`as_if_here` returns them.
        now: Jobs of the run now, likewise.
    """
    factor = before["here_cpu_s"].sum() / before["cpu_s"].sum()
    rows = []
    for part in (*PARTS, REST):
        there = before[before["stage"].map(part_of) == part]
        here = now[now["stage"].map(part_of) == part]
        rows.append(
            {
                "part": part,
                "version_01_cpu_s": VERSION_01_S.get(part, 0.0) * factor,
                "before_jobs": len(there),
                "before_repeated": there["repeated"].sum(),
                "before_cpu_s": there["here_cpu_s"].sum(),
                "jobs": len(here),
                "repeated": here["repeated"].sum(),
                "cpu_s": here["here_cpu_s"].sum(),
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
            "jobs (repeated)": _counted(table["jobs"], table["repeated"]),
            "processor seconds": table["cpu_s"].map("{:,.0f}".format),
            "at `bdfa7c9`: jobs (repeated)": _counted(
                table["before_jobs"], table["before_repeated"]
            ),
            "seconds": table["before_cpu_s"].map("{:,.0f}".format),
            "ratio": table["ratio"].map("{:.2f}".format),
        }
    )
    return str(shown.to_markdown(index=False, disable_numparse=True))


def _counted(jobs: pd.Series, repeated: pd.Series) -> list[str]:
    return [f"{total:.0f} ({some:.0f})" for total, some in zip(jobs, repeated, strict=True)]


def run(options: argparse.Namespace) -> None:
    """Write the table, and print it in Markdown."""
    before = as_if_here(read_measured(options.before), read_measured(options.before_here))
    now = as_if_here(read_measured(options.now), read_measured(options.now_here))
    table = cost_by_part(before, now)
    seconds = [name for name in table if "cpu_s" in str(name)]
    whole = ["before_jobs", "before_repeated", "jobs", "repeated", *seconds]
    table = table.round(dict.fromkeys(seconds, 0) | {"ratio": 3}).astype(dict.fromkeys(whole, int))
    write_frame(options.out, table, float_format=None)
    print(text_of(table))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reproduce_cost")
    parser.add_argument("--before", type=Path, required=True, help="results of the other commit")
    parser.add_argument("--now", type=Path, default=Path("results/published/mini"))
    for name, whose in (("before", "the other commit's"), ("now", "this commit's")):
        parser.add_argument(
            f"--{name}-here", type=Path, required=True, help=f"{whose} jobs repeated on one machine"
        )
    out = Path("results/benchmarks/reproduce_cost.csv")
    parser.add_argument("--out", type=Path, default=out)
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
