"""What a plan is made of, and the files that keep plans and checks of plans."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from synfeal.files import atomic_path
from synfeal.report.cost.compare import Comparisons
from synfeal.report.cost.estimate import Machine, Share, Span, StageCost, TableCost

PLAN_COLUMNS = (
    *("profile", "cores", "gpus", "gpu_tflops", "part", "name", "jobs", "work", "unit"),
    *("cpu_h", "cpu_h_low", "cpu_h_high", "gpu_h", "gpu_h_low", "gpu_h_high"),
    *("wall_h", "wall_h_low", "wall_h_high", "disk_gb", "peak_memory_gb", "times_measured_size"),
    "measured",
)
CHECK_COLUMNS = (
    *("predicted_from", "predicted", "stage", "jobs"),
    *("predicted_cpu_s", "predicted_low_cpu_s", "predicted_high_cpu_s", "measured_cpu_s", "factor"),
)


@dataclass(frozen=True)
class Plan:
    """What a run of a profile costs on a machine.

    Attributes:
        profile: its name.
        machine: what it is planned for.
        stages: in their order.
        tables: what each table of the paper needs.
        whole: all jobs.
        origin: what the laws were fitted to.
    """

    profile: str
    machine: Machine
    stages: list[StageCost]
    tables: list[TableCost]
    whole: Share
    origin: str

    @property
    def disk_bytes(self) -> float:
        """What the run leaves behind."""
        return sum(stage.disk_bytes for stage in self.stages)

    @property
    def peak_mb(self) -> float:
        """Memory of the largest job."""
        return max((stage.peak_mb or 0.0 for stage in self.stages), default=0.0)


def write_plans(path: Path, plans: Sequence[Plan]) -> None:
    """Plans as one table: hours, 10^9 bytes; a row per stage, per table alone, and for all."""
    _write(path, PLAN_COLUMNS, (row for plan in plans for row in _plan_rows(plan)))


def write_check(path: Path, comparisons: Comparisons) -> None:
    """Predictions beside measurements, processor seconds."""
    _write(
        path,
        CHECK_COLUMNS,
        (
            [*names, r.stage, str(r.jobs)]
            + [f"{s:.4g}" for s in (r.predicted_s, r.low_s, r.high_s, r.measured_s)]
            + [f"{r.factor:.3g}"]
            for names, rows in comparisons.items()
            for r in rows
        ),
    )


def _write(path: Path, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def _plan_rows(plan: Plan) -> Iterator[list[str]]:
    machine = plan.machine
    tflops = f"{machine.gpu_tflops:g}" if machine.gpus else ""
    start = [plan.profile, str(machine.cores), str(machine.gpus), tflops]
    for stage in plan.stages:
        yield [*start, "stage", stage.stage, *_stage_cells(stage)]
    for table in plan.tables:
        if table.alone is not None:
            yield [*start, "table alone", table.name, *_share_cells(table.alone), "", "", "", ""]
    disk_gb, peak_gb = f"{plan.disk_bytes / 1e9:.4g}", f"{plan.peak_mb / 1e3:.4g}"
    yield [*start, "run", "total", *_share_cells(plan.whole), disk_gb, peak_gb, "", ""]


def _stage_cells(stage: StageCost) -> list[str]:
    work = [f"{stage.work[0]:.6g}", stage.work[1]] if stage.work else ["", ""]
    times = [h for span in (stage.cpu_s, stage.gpu_s, stage.wall_s) for h in _hours(span)]
    return [
        str(stage.jobs),
        *work,
        *(times if stage.known else [""] * len(times)),
        f"{stage.disk_bytes / 1e9:.4g}",
        "" if stage.peak_mb is None else f"{stage.peak_mb / 1e3:.4g}",
        "" if stage.beyond is None else f"{stage.beyond:.4g}",
        "yes" if stage.known else "no",
    ]


def _share_cells(share: Share) -> list[str]:
    times = [h for span in (share.cpu_s, share.gpu_s, share.wall_s) for h in _hours(span)]
    return [str(share.jobs), "", "", *times]


def _hours(span: Span) -> list[str]:
    return [f"{seconds / 3600:.4g}" for seconds in (span.mid, span.low, span.high)]
