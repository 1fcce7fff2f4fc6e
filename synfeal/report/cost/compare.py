"""A prediction beside what was measured, for the jobs of a run that both know."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from synfeal.report.cost.laws import Law, Pairs


class Comparison(NamedTuple):
    """A stage, or all: jobs, processor seconds predicted and measured."""

    stage: str
    jobs: int
    predicted_s: float
    measured_s: float

    @property
    def factor(self) -> float:
        """Predicted over measured."""
        return self.predicted_s / self.measured_s if self.measured_s else float("nan")


def compare_cost(laws: Mapping[str, Law], pairs: Pairs) -> list[Comparison]:
    """Every stage with a law, the costliest first, and the total last."""
    groups: dict[str, Pairs] = {}
    for job, measured in pairs:
        if job.law in laws:
            groups.setdefault(job.stage, []).append((job, measured))
    rows = [_row(stage, group, laws) for stage, group in groups.items()]
    rows.sort(key=lambda row: -row.measured_s)
    jobs = sum(row.jobs for row in rows)
    predicted_s, measured_s = sum(r.predicted_s for r in rows), sum(r.measured_s for r in rows)
    return [*rows, Comparison("total", jobs, predicted_s, measured_s)]


def _row(stage: str, pairs: Pairs, laws: Mapping[str, Law]) -> Comparison:
    predicted_s = sum(laws[job.law].seconds(job.size) for job, _ in pairs)
    return Comparison(stage, len(pairs), predicted_s, sum(m.cpu_s for _, m in pairs))
