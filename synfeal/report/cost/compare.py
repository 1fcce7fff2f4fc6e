"""A prediction beside what was measured, for the jobs of a run that both know."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from synfeal.report.cost.laws import Law, Pairs


class Comparison(NamedTuple):
    """A stage, or all: jobs, processor seconds predicted (low, expected, high) and measured."""

    stage: str
    jobs: int
    low_s: float
    predicted_s: float
    high_s: float
    measured_s: float

    @property
    def factor(self) -> float:
        """Predicted over measured."""
        return self.predicted_s / self.measured_s if self.measured_s else float("nan")


# By the runs that were predicted from and the run that was predicted.
Comparisons = dict[tuple[str, str], list[Comparison]]


def compare_cost(laws: Mapping[str, Law], pairs: Pairs) -> list[Comparison]:
    """Every stage with a law, the costliest first, and the total last."""
    groups: dict[str, Pairs] = {}
    for job, measured in pairs:
        if job.law in laws:
            groups.setdefault(job.stage, []).append((job, measured))
    rows = [_row(stage, group, laws) for stage, group in groups.items()]
    rows.sort(key=lambda row: -row.measured_s)
    sums = [sum(column) for column in zip(*(row[1:] for row in rows), strict=True)] or [0] * 5
    return [*rows, Comparison("total", int(sums[0]), *sums[1:])]


def _row(stage: str, pairs: Pairs, laws: Mapping[str, Law]) -> Comparison:
    seconds = [laws[job.law].seconds(job.size) for job, _ in pairs]
    spreads = [laws[job.law].spread for job, _ in pairs]
    low_s = sum(s * low for s, (low, _) in zip(seconds, spreads, strict=True))
    high_s = sum(s * high for s, (_, high) in zip(seconds, spreads, strict=True))
    measured_s = sum(measured.cpu_s for _, measured in pairs)
    return Comparison(stage, len(pairs), low_s, sum(seconds), high_s, measured_s)
