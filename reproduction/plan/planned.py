"""The jobs of a dry run as text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from textwrap import fill

WIDTH = 100  # characters of the last lines
UNBROKEN = "\N{NO-BREAK SPACE}"


def planned_text(jobs: Sequence[str]) -> str:
    """List jobs, one to a line, with the number of each stage's below.

    Args:
        jobs: ``stage/name`` of each job, in any order.

    Returns:
        The lines, stage by stage in the order in which stages first appear in ``jobs``.
    """
    counts = Counter(job.partition("/")[0] for job in jobs)
    stages = list(counts)
    listed = sorted(jobs, key=lambda job: (stages.index(job.partition("/")[0]), job))
    # Lines are not broken between a number and its stage.
    total = ", ".join(f"{count}{UNBROKEN}{stage}" for stage, count in counts.items())
    plural = "" if len(jobs) == 1 else "s"
    last = fill(f"{len(jobs)} job{plural}: {total}", WIDTH).replace(UNBROKEN, " ")
    return "\n".join([*listed, "", last]) + "\n"
