"""The evidence as a page."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from tests.slurm_run.run import Crash
from tests.slurm_run.trees import Hashes, damaged, missing, reason_to_differ

# What the controller writes about a node that is lost and found.
RECOVERY = re.compile(r"requeu|not responding|now responding|returned to service", re.IGNORECASE)

NAMES_ITS_RUN = "summary.txt"  # says in which directory its run's tables lie


@dataclass(frozen=True)
class Comparison:
    """Files of two runs, by their paths below the results.

    Attributes:
        promised: those that have to be the same, byte by byte.
        differing: those of them that are not, or that the run through SLURM lacks or has beyond.
    """

    promised: tuple[str, ...]
    differing: tuple[str, ...]


def job_records(text: str) -> list[dict[str, str]]:
    """What SLURM's ``jobcomp/filetxt`` wrote: one line of ``key=value`` for each end of a job."""
    lines = (line.split() for line in text.splitlines() if line.startswith("JobId="))
    return [dict(part.split("=", 1) for part in line if "=" in part) for line in lines]


def recovery(text: str) -> list[str]:
    """The lines of the controller's log about the lost node and the jobs it held."""
    return [line for line in text.splitlines() if RECOVERY.search(line)]


def compare(local: Path, slurm: Path) -> Comparison:
    """Set the results of both runs side by side, apart from times and what jobs took."""
    expected, found = (Hashes().tree(tree) for tree in (local, slurm))
    promised = tuple(n for n in expected if not reason_to_differ(n) and n != NAMES_ITS_RUN)
    off = {*missing(expected, found), *damaged(expected, found)} - {NAMES_ITS_RUN}
    return Comparison(promised, tuple(sorted(n for n in off if not reason_to_differ(n))))


def page(
    seconds: tuple[float | None, float], crash: Crash, cluster_dir: Path, files: Comparison
) -> str:
    """The evidence as a page: seconds of the local run and of SLURM's, and what became of both."""
    tables = {name for name in files.promised if name.startswith("tables/")}
    off = set(files.differing)
    took = "made before" if seconds[0] is None else f"{seconds[0]:.0f}"
    records = job_records((cluster_dir / "jobs.txt").read_text(encoding="utf-8"))
    ends = Counter(record["JobState"] for record in records)
    log = recovery((cluster_dir / "slurmctld.log").read_text(encoding="utf-8"))
    return "\n".join(
        [
            "# The smoke profile on SLURM",
            "",
            "Written by `make test-slurm` ([docs/clusters.md](../../docs/clusters.md)).",
            "",
            "| | local, two cores | SLURM, one node |",
            "|---|---|---|",
            f"| seconds | {took} | {seconds[1]:.0f} |",
            f"| files that are promised to be the same | {len(files.promised)} | "
            f"{len(set(files.promised) - off)} equal |",
            f"| of these, tables | {len(tables)} | {len(tables - off)} equal |",
            "",
            "Equal is byte by byte, without the columns and rows that say how long something took"
            " and how much memory.",
            "",
            f"Files that differ or lack: {', '.join(files.differing) or 'none'}.",
            "",
            f"SLURM jobs: {len({r['JobId'] for r in records})}; ends of jobs: "
            + ", ".join(f"{count} {state}" for state, count in sorted(ends.items())) + ".",
            *_crash_lines(crash, records),
            *(["", "```", *log, "```"] if log else []),
            "",
        ]
    )  # fmt: skip


def _crash_lines(crash: Crash, records: list[dict[str, str]]) -> list[str]:
    return [
        "",
        f"After {crash.killed_s:.0f} s, with {crash.trained} models trained, the node was killed;"
        f" it was missed after {crash.noticed_s - crash.killed_s:.0f} s and back"
        f" {crash.back_s - crash.noticed_s:.0f} s later. Lost with it:",
        "",
        *(f"- `{job}`: {_states(job.split()[0], records)}" for job in crash.running),
        "",
        "What the controller wrote:",
    ]


def _states(job_id: str, records: list[dict[str, str]]) -> str:
    """How a job ended, each time it did."""
    return ", then ".join(r["JobState"] for r in records if r["JobId"] == job_id)
