"""The plan as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from synfeal.report.cost.compare import Comparison
from synfeal.report.cost.estimate import LAUNCH_S, Span, StageCost, TableCost
from synfeal.report.cost.plan import Plan

# The largest unit of which there are at least so many.
DURATIONS = ((48 * 3600.0, 86400.0, "d"), (5400.0, 3600.0, "h"), (90.0, 60.0, "min"), (0, 1.0, "s"))
SIZES = ((1e9, 1e9, "GB"), (0, 1e6, "MB"))


def plan_lines(plan: Plan) -> Iterator[str]:
    """The whole plan: one line that sums it up, stages, tables, and what the numbers rest on."""
    machine, whole = plan.machine, plan.whole
    on = counted(machine.cores, "core")
    on += f" and {counted(machine.gpus, 'GPU')}" if machine.gpus else ""
    yield f"Profile {plan.profile} on {on}: {spoken(whole.wall_s)}"
    parts = [f"processor time {spoken(whole.cpu_s)}"]
    if machine.gpus:
        parts.append(f"GPU time {spoken(whole.gpu_s)}")
    parts.append(f"disk {scaled(plan.disk_bytes, SIZES)}")
    parts.append(f"memory of the largest job {scaled(plan.peak_mb * 1e6, SIZES)}")
    yield "; ".join(parts)
    yield ""
    yield stage_table(plan)
    yield table_table(plan.tables, bool(machine.gpus))
    yield from notes(plan)


def stage_table(plan: Plan) -> str:
    """One line per stage, and the sum."""
    on_gpu = bool(plan.machine.gpus)
    gpu = ["GPU time", "range"] if on_gpu else []
    head = ["stage", "jobs", "work", "", "CPU time", "range", *gpu, "wall time"]
    rows = [[*head, "disk", "memory", "x measured"]]
    rows += [_stage_row(stage, on_gpu) for stage in plan.stages]
    whole = plan.whole
    spans = [*_span(whole.cpu_s), *(_span(whole.gpu_s) if on_gpu else [])]
    tail = [duration(whole.wall_s.mid), scaled(plan.disk_bytes, SIZES)]
    peak = scaled(plan.peak_mb * 1e6, SIZES)
    rows.append(["total", f"{whole.jobs:,}", "", "", *spans, *tail, peak, ""])
    return aligned(rows, left=(0, 3))


def _stage_row(stage: StageCost, on_gpu: bool) -> list[str]:
    work, unit = stage.work or (0.0, "")
    row = [stage.stage, f"{stage.jobs:,}", number(work) if unit else "", unit]
    disk = scaled(stage.disk_bytes, SIZES) if stage.disk_bytes else ""
    if not stage.known:
        return [*row, "not measured", "", *([""] * 2 * on_gpu), "", disk, "", ""]
    peak = "" if stage.peak_mb is None else scaled(stage.peak_mb * 1e6, SIZES)
    beyond = "" if stage.beyond is None else number(stage.beyond)
    gpu = (_span(stage.gpu_s) if stage.gpu_s.mid else ["", ""]) if on_gpu else []
    return [*row, *_span(stage.cpu_s), *gpu, duration(stage.wall_s.mid), disk, peak, beyond]


def table_table(tables: Sequence[TableCost], on_gpu: bool) -> str:
    """One line per table of the paper: its own jobs, and all it needs."""
    gpu = ["GPU time"] if on_gpu else []
    rows = [["needed by", "jobs", "CPU time", *gpu, "alone: CPU time", *gpu, "wall time", "range"]]
    for table in tables:
        row = [table.name, f"{table.own.jobs:,}"]
        for share in (table.own, table.alone):
            row += [""] * (1 + on_gpu) if share is None else [duration(share.cpu_s.mid)]
            row += [duration(share.gpu_s.mid)] if on_gpu and share is not None else []
        row += ["", ""] if table.alone is None else _span(table.alone.wall_s)
        rows.append(row)
    return aligned(rows)


def comparison_table(rows: Sequence[Comparison]) -> str:
    """Prediction beside measurement."""
    cells = [["stage", "jobs", "predicted CPU", "range", "measured CPU", "predicted/measured"]]
    for r in rows:
        span = _span(Span(r.low_s, r.predicted_s, r.high_s))
        cells.append([r.stage, str(r.jobs), *span, duration(r.measured_s), f"{r.factor:.2f}"])
    return aligned(cells)


def notes(plan: Plan) -> Iterator[str]:
    """What the numbers rest on."""
    machine = plan.machine
    yield f"measured    {plan.origin}"
    yield (
        "CPU time    of a core like that run's; range: 10 and 90 % of its jobs about the fitted law"
    )
    yield (
        "wall time   stage after stage, one job for each core"
        + (", one training for each GPU" if machine.gpus else "")
        + ", longest first, no waiting for disks"
    )
    yield "memory      of one job; several run at a time"
    yield "x measured  largest planned job over largest measured one; far above 1 is extrapolated"
    if machine.gpus and machine.gpu_rates is not None:
        yield "GPU time    from steps timed on this machine's GPU; range half to double"
    elif machine.gpus:
        yield (
            f"GPU time    assumed, not measured: {machine.gpu_tflops:g} TFLOP/s sustained, at least"
            f" {LAUNCH_S * 1e3:g} ms for each layer and step; range half to double;"
            " a core is busy too"
        )
    unknown = [stage.stage for stage in plan.stages if not stage.known]
    if unknown:
        yield f"missing     {', '.join(unknown)}: in no measured run, left out of the sums"


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


def scaled(value: float, units: Sequence[tuple[float, float, str]]) -> str:
    """A value in the unit that suits it."""
    _, unit, name = next(u for u in units if value >= u[0])
    return f"{number(value / unit)} {name}"


def duration(seconds: float) -> str:
    """Seconds in the unit that suits them."""
    return scaled(seconds, DURATIONS)


def spoken(span: Span) -> str:
    """As in ``3.5 h (2 h to 7 h)``."""
    low, mid, high = map(duration, span)
    return mid if low == high else f"{mid} ({low} to {high})"


def counted(n: int, what: str) -> str:
    """As in ``1 core``, ``16 cores``."""
    return f"{n} {what}" + "s" * (n != 1)


def _span(span: Span) -> list[str]:
    """The middle, and both ends in the unit of the upper one."""
    _, unit, name = next(u for u in DURATIONS if span.high >= u[0])
    low, high = number(span.low / unit), number(span.high / unit)
    return [duration(span.mid), "" if low == high else f"{low} - {high} {name}"]
