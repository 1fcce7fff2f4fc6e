r"""Compare the processor time of ``make reproduce``, by part, with that at another commit.

Writes ``results/benchmarks/reproduce_cost.csv``::

    mkdir before
    git show bdfa7c9:results/published/mini/benchmarks.csv > before/benchmarks.csv
    python -m benchmarks.reproduce_cost --before before --before-here sample_before/results/mini

Where the two runs were on different machines, some jobs of the other commit are repeated on the
machine of the run now (``--before-here``), or some of both on a third (``--now-here``), and the
processor seconds of every stage of a run are multiplied by what its repeated jobs took here
relative to there. Repeat jobs with the settings of their run: one of the same name counts as the
same work. ``--kept TABLE`` in place of ``--before`` compares another run now with the columns of
the other commit in an earlier table.
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
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame, write_frame

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
BEFORE = {
    "part": TEXT,
    "version_01_cpu_s": NUMBER,
    "before_jobs": COUNT,
    "before_repeated": COUNT,
    "before_cpu_s": NUMBER,
}


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


def cost_by_part(run: pd.DataFrame) -> pd.DataFrame:
    """Add up jobs and processor seconds of a run by part.

    Args:
        run: Jobs as :func:`as_if_here` returns them.

    Returns:
        A row for each part and one for all, with ``jobs``, ``repeated`` and ``cpu_s``.
    """
    parts = run["stage"].map(part_of)
    rows = []
    for part in (*PARTS, REST, "all"):
        own = run if part == "all" else run[parts == part]
        sums = {"jobs": len(own), "repeated": own["repeated"].sum()}
        rows.append({"part": part, **sums, "cpu_s": own["here_cpu_s"].sum()})
    return pd.DataFrame(rows)


def costs_before(before: pd.DataFrame) -> pd.DataFrame:
    """Add up the other commit's run by part, and put the seconds of version 0.1 beside it.

    Args:
        before: Jobs as :func:`as_if_here` returns them.
    """
    here = cost_by_part(before).set_index("part")
    factor = before["here_cpu_s"].sum() / before["cpu_s"].sum()
    first = pd.Series(VERSION_01_S).reindex(here.index, fill_value=0.0) * factor
    first["all"] = first.sum()
    return here.add_prefix("before_").assign(version_01_cpu_s=first).reset_index()[[*BEFORE]]


def compared(before: pd.DataFrame, now: pd.DataFrame) -> pd.DataFrame:
    """Put the costs of two runs side by side.

    Args:
        before: Columns ``BEFORE`` of every part.
        now: Costs by part.
    """
    table = before.merge(now, on="part", validate="one_to_one")
    return table.assign(ratio=table["cpu_s"] / table["before_cpu_s"])


def text_of(table: pd.DataFrame) -> str:
    """Return the table in Markdown."""
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


def _read_as_if_here(run: Path, repeated: Path | None) -> pd.DataFrame:
    """Read a run, and scale it by its repeated jobs unless it was made here."""
    return as_if_here(read_measured(run), read_measured(repeated or run))


def run(options: argparse.Namespace) -> None:
    """Write the table, and print it in Markdown."""
    if options.kept:
        before = read_frame(options.kept, BEFORE, "give a table of this command")
    else:
        before = costs_before(_read_as_if_here(options.before, options.before_here))
    now = _read_as_if_here(options.now, options.now_here)
    table = compared(before, cost_by_part(now))
    seconds = [name for name in table if "cpu_s" in str(name)]
    whole = ["before_jobs", "before_repeated", "jobs", "repeated", *seconds]
    table = table.round(dict.fromkeys(seconds, 0) | {"ratio": 3}).astype(dict.fromkeys(whole, int))
    write_frame(options.out, table, float_format=None)
    print(text_of(table))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reproduce_cost")
    other = parser.add_mutually_exclusive_group(required=True)
    other.add_argument("--before", type=Path, help="results of the other commit")
    other.add_argument("--kept", type=Path, help="earlier table with its columns")
    parser.add_argument("--now", type=Path, default=Path("results/published/mini"))
    for name, whose in (("before", "the other commit's"), ("now", "this commit's")):
        parser.add_argument(
            f"--{name}-here", type=Path, help=f"{whose} jobs repeated here; none: the run was here"
        )
    out = Path("results/benchmarks/reproduce_cost.csv")
    parser.add_argument("--out", type=Path, default=out)
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
