"""The evidence as a page."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.slurm_run.trees import Hashes, damaged, missing, reason_to_differ

# What the controller writes about a node that is lost and found.
RECOVERY = re.compile(r"requeu|not responding|now responding|returned to service", re.IGNORECASE)
NAMES_ITS_RUN = "summary.txt"  # says in which directory its run's tables lie


def differing_files(local: Path, slurm: Path) -> tuple[list[str], list[str]]:
    """Files promised to be the same, apart from times, and those that are not or lack."""
    expected, found = (Hashes().tree(tree) for tree in (local, slurm))
    off = {*missing(expected, found), *damaged(expected, found)}
    return tuple(
        sorted(n for n in names if not reason_to_differ(n) and n != NAMES_ITS_RUN)
        for names in (expected, off)
    )


def page(
    trees: tuple[Path, Path],
    seconds: tuple[float | None, float],
    crash: Sequence[str],
    cluster_dir: Path,
) -> tuple[str, list[str]]:
    """The evidence as a page, and the files that differ.

    Args:
        trees: results of the local run and of SLURM's.
        seconds: of either.
        crash: what happened to the node, then the jobs that were lost.
        cluster_dir: with the logs of the controller; of its ``jobcomp/filetxt``, one line of
            ``key=value`` for each end of a job.
    """
    promised, differing = differing_files(*trees)
    tables = {name for name in promised if name.startswith("tables/")}
    took = "made before" if seconds[0] is None else f"{seconds[0]:.0f}"
    text = (cluster_dir / "jobs.txt").read_text(encoding="utf-8")
    ends = re.findall(r"^JobId=(\S+) .*JobState=(\S+)", text, re.MULTILINE)
    states = Counter(state for _, state in ends)
    story, *lost = crash
    log = (cluster_dir / "slurmctld.log").read_text(encoding="utf-8").splitlines()
    lines = [
        "# The smoke profile on SLURM",
        "Written by `make test-slurm` ([docs/clusters.md](../../docs/clusters.md)).",
        "| | local, two cores | SLURM, one node |\n|---|---|---|\n"
        f"| seconds | {took} | {seconds[1]:.0f} |\n"
        f"| files that are promised to be the same | {len(promised)} | "
        f"{len({*promised} - {*differing})} equal |\n"
        f"| of these, tables | {len(tables)} | {len(tables - {*differing})} equal |",
        "Equal is byte by byte, without the columns and rows that say how long something took and"
        " how much memory.",
        f"Files that differ or lack: {', '.join(differing) or 'none'}.",
        f"SLURM jobs: {len({job for job, _ in ends})}; ends of jobs: "
        + ", ".join(f"{count} {state}" for state, count in sorted(states.items()))
        + ".",
        f"{story} Lost with it:",
        "\n".join(
            f"- `{job}`: {', then '.join(s for end, s in ends if end == job.split()[0])}"
            for job in lost
        ),
        "What the controller wrote:",
        "\n".join(["```", *filter(RECOVERY.search, log), "```"]),
    ]
    return "\n\n".join(lines) + "\n", differing
