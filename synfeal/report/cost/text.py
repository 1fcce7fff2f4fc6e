"""The plan as text for a terminal and as CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from synfeal.files import atomic_path
from synfeal.report.cost.compare import Comparison
from synfeal.report.cost.estimate import NOTHING, Machine, Span, StageCost, TableCost

CSV_COLUMNS = [
    "stage",
    "jobs",
    "work",
    "unit",
    "cpu_h",
    "cpu_h_low",
    "cpu_h_high",
    "gpu_h",
    "gpu_h_low",
    "gpu_h_high",
    "wall_h",
    "disk_gb",
    "peak_memory_gb",
    "times_measured_size",
    "measured",
]


def stage_table(stages: Sequence[StageCost]) -> str:
    """One line per stage, and the sum."""
    head = ["stage", "jobs", "work", "", "CPU h", "range", "GPU h", "range", "wall h"]
    rows = [[*head, "disk GB", "peak GB", "size"]]
    rows += [_stage_row(stage) for stage in stages]
    cpu_s, gpu_s = NOTHING, NOTHING
    for stage in stages:
        cpu_s, gpu_s = cpu_s.plus(stage.cpu_s), gpu_s.plus(stage.gpu_s)
    peak = max((stage.peak_mb or 0 for stage in stages), default=0)
    wall_s = sum(stage.wall_s for stage in stages)
    disk = sum(stage.disk_bytes for stage in stages)
    jobs = sum(stage.jobs for stage in stages)
    tail = [number(wall_s / 3600), number(disk / 1e9), number(peak / 1e3), ""]
    rows.append(["total", f"{jobs:,}", "", "", *_span(cpu_s), *_span(gpu_s), *tail])
    return aligned(rows, left=(0, 3))


def _stage_row(stage: StageCost) -> list[str]:
    work, unit = stage.work or (0.0, "")
    row = [stage.stage, f"{stage.jobs:,}", number(work) if unit else "", unit]
    disk = number(stage.disk_bytes / 1e9)
    if not stage.known:
        return [*row, "not measured", "", "", "", "", disk, "", ""]
    peak = "" if stage.peak_mb is None else number(stage.peak_mb / 1e3)
    beyond = "" if stage.beyond is None else f"x{number(stage.beyond)}"
    wall = number(stage.wall_s / 3600)
    return [*row, *_span(stage.cpu_s), *_span(stage.gpu_s), wall, disk, peak, beyond]


def table_table(tables: Sequence[TableCost]) -> str:
    """One line per table of the paper: its own jobs, and all it needs."""
    rows = [["needed by", "jobs", "CPU h", "range", "GPU h", "alone: CPU h", "GPU h"]]
    for table in tables:
        alone = ["", ""]
        if table.alone is not None:
            alone = [number(span.mid / 3600) for span in table.alone]
        gpu = number(table.gpu_s.mid / 3600)
        rows.append([table.name, f"{table.jobs:,}", *_span(table.cpu_s), gpu, *alone])
    return aligned(rows)


def comparison_table(rows: Sequence[Comparison]) -> str:
    """Prediction beside measurement."""
    cells = [["stage", "jobs", "predicted CPU s", "measured CPU s", "factor"]]
    cells += [
        [r.stage, str(r.jobs), number(r.predicted_s), number(r.measured_s), f"{r.factor:.2f}"]
        for r in rows
    ]
    return aligned(cells)


def notes(machine: Machine, stages: Sequence[StageCost], measured: str) -> str:
    """What the numbers rest on."""
    lines = [
        f"measured  {measured}",
        "CPU h     processor time of a core like that run's; range: 10 and 90 % of its jobs about"
        " the fitted law",
        f"wall h    {machine.cores} cores, {machine.gpus} GPUs; stage after stage, longest jobs"
        " first, no waiting for disk",
        "size      largest planned job over largest measured one; far above 1 is extrapolated",
    ]
    if machine.gpus:
        lines.append(
            f"GPU h     assumed, not measured: {machine.gpu_tflops:g} TFLOP/s sustained, range half"
            " to double; a core is busy too"
        )
    unknown = [stage.stage for stage in stages if not stage.known]
    if unknown:
        lines.append(f"missing   {', '.join(unknown)}: in no measured run, left out of the sums")
    return "\n".join(lines)


def write_csv(path: Path, stages: Sequence[StageCost]) -> None:
    """The table of stages, in hours and 10^9 bytes."""
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_COLUMNS)
        writer.writerows(_csv_row(stage) for stage in stages)


def _csv_row(stage: StageCost) -> list[str]:
    work, unit = stage.work or (0.0, "")
    hours = [stage.cpu_s.mid, stage.cpu_s.low, stage.cpu_s.high]
    hours += [stage.gpu_s.mid, stage.gpu_s.low, stage.gpu_s.high, stage.wall_s]
    cells = [f"{s / 3600:.6g}" if stage.known else "" for s in hours]
    peak = "" if stage.peak_mb is None else f"{stage.peak_mb / 1e3:.4g}"
    beyond = "" if stage.beyond is None else f"{stage.beyond:.4g}"
    measured = "yes" if stage.known else "no"
    disk = f"{stage.disk_bytes / 1e9:.6g}"
    return [stage.stage, str(stage.jobs), f"{work:.6g}", unit, *cells, disk, peak, beyond, measured]


def aligned(rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Columns two spaces apart; those in ``left`` start at their left edge, others end right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "".join(
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        + "\n"
        for row in rows
    )


def number(value: float) -> str:
    """Two or three figures, without an exponent."""
    if value == 0:
        return "0"
    if value < 0.001:
        return "<0.001"
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2g}"


def _span(span: Span) -> list[str]:
    low, mid, high = (number(seconds / 3600) for seconds in span)
    return [mid, "" if low == high else f"{low} - {high}"]
