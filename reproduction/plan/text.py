"""The plan as text for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from reproduction.plan.laws import ALONE, LAUNCH_S, OWN, RUN, STAGE
from reproduction.plan.plan import Comparisons, Plan
from reproduction.tables.sheet import text_table

# The largest unit of which there are at least so many.
DURATIONS = ((48 * 3600.0, 86400.0, "d"), (5400.0, 3600.0, "h"), (90.0, 60.0, "min"), (0, 1.0, "s"))
SIZES = ((1e9, 1e9, "GB"), (0, 1e6, "MB"))


def plan_text(plans: Sequence[Plan]) -> str:
    """Format plans: a line that sums each up, stages, tables, and what the numbers rest on."""
    return "\n".join("\n".join(_plan_lines(plan)) + "\n" for plan in plans)


def comparison_text(comparisons: Comparisons) -> str:
    """Format predictions beside measurements."""
    head = ["stage", "jobs", "predicted CPU", "range", "measured CPU", "predicted/measured"]
    parts = []
    for (source, predicted), table in comparisons.items():
        rows = [head]
        for r in table.to_dict("records"):
            span = _span(r["low"], r["mid"], r["high"])
            factor = f"{r['factor']:.2f}"
            rows.append([r["stage"], str(r["jobs"]), *span, duration(r["cpu_s"]), factor])
        parts.append(f"{predicted} predicted from {source}\n\n{text_table(rows)}")
    return "\n".join(parts)


def _plan_lines(plan: Plan) -> Iterator[str]:
    machine, whole = plan.machine, plan.costs[plan.costs["part"] == RUN].iloc[0]
    on = f"{machine.cores} core{'s' * (machine.cores > 1)}"
    on += f" and {machine.gpus} GPU{'s' * (machine.gpus > 1)}" if machine.gpus else ""
    yield f"Profile {plan.profile} on {on}: {_spoken(whole, 'wall')}"
    parts = [f"processor time {_spoken(whole, 'cpu')}"]
    if machine.gpus:
        parts.append(f"GPU time {_spoken(whole, 'gpu')}")
    parts.append(f"disk {scaled(whole['disk_bytes'], SIZES)}")
    parts.append(f"memory of the largest job {_memory(whole['peak_mb'])}")
    yield "; ".join(parts)
    yield ""
    on_gpu = bool(machine.gpus)
    gpu = ["GPU time", "range"] if on_gpu else []
    head = ["stage", "jobs", "work", "CPU time", "range", *gpu, "wall time"]
    shown = plan.costs[plan.costs["part"].isin([STAGE, RUN])].to_dict("records")
    yield text_table([[*head, "disk", "memory", "x measured"], *(_row(r, on_gpu) for r in shown)])
    yield _table_table(plan)
    yield from _notes(plan)


def _row(r: dict[Any, Any], on_gpu: bool) -> list[str]:
    is_stage = r["part"] == STAGE
    work = f"{number(r['work'])} {r['unit']}" if is_stage and r["unit"] else ""
    cpu = ["not measured", ""] if r["measured"] == "no" else _time(r, "cpu")
    gpu = _time(r, "gpu") if r["gpu_mid"] or not is_stage else ["", ""]
    disk = scaled(r["disk_bytes"], SIZES) if r["disk_bytes"] or not is_stage else ""
    peak = "" if pd.isna(r["peak_mb"]) and is_stage else _memory(r["peak_mb"])
    beyond = "" if pd.isna(r["beyond"]) else number(r["beyond"])
    times = [*cpu, *gpu[: 2 * on_gpu], duration(r["wall_mid"])]
    return [r["name"], f"{r['jobs']:,}", work, *times, disk, peak, beyond]


def _table_table(plan: Plan) -> str:
    """Format one line per table of the paper: its own jobs, and all it needs."""
    own, alone = (plan.costs[plan.costs["part"] == part] for part in (OWN, ALONE))
    shares = own.merge(alone, "left", "name", suffixes=("", "_alone"))
    used = ["cpu_mid", "gpu_mid"] if plan.machine.gpus else ["cpu_mid"]
    gpu = ["GPU time"] if plan.machine.gpus else []
    rows = [["needed by", "jobs", "CPU time", *gpu, "alone: CPU time", *gpu, "wall time", "range"]]
    for r in shares.to_dict("records"):
        times = [duration(r[f"{c}{end}"]) for end in ("", "_alone") for c in used]
        rows.append([r["name"], f"{r['jobs']:,}", *times, *_time(r, "wall", "_alone")])
    return text_table(rows)


def _notes(plan: Plan) -> Iterator[str]:
    """List what the numbers rest on."""
    machine = plan.machine
    yield f"measured    {plan.origin}"
    yield (
        "CPU time    of a core like that run's; range: 10 and 90 % of its jobs about the fitted law"
    )
    each = ", one training run for each GPU" if machine.gpus else ""
    yield (
        f"wall time   stage after stage, one job for each core{each}, longest first, no waiting for"
        " disks"
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
    unknown = plan.costs.loc[plan.costs["measured"] == "no", "name"]
    if len(unknown):
        yield f"missing     {', '.join(unknown)}: in no measured run, left out of the sums"


def number(value: float) -> str:
    """Format two or three figures, without an exponent."""
    if value == 0:
        return "0"
    if value < 0.001:
        return "<0.001"
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2g}"


def scaled(value: float, units: Sequence[tuple[float, float, str]]) -> str:
    """Format a value in the unit that suits it."""
    _, unit, name = next(u for u in units if value >= u[0])
    return f"{number(value / unit)} {name}"


def duration(seconds: float) -> str:
    """Format seconds in the unit that suits them; nothing where they are not known."""
    return "" if math.isnan(seconds) else scaled(seconds, DURATIONS)


def _memory(peak_mb: float) -> str:
    return scaled(0.0 if pd.isna(peak_mb) else peak_mb * 1e6, SIZES)


def _spoken(costs: Any, what: str) -> str:
    """Format costs as in ``3.5 h (2 h to 7 h)``."""
    low, mid, high = (duration(costs[f"{what}_{end}"]) for end in ("low", "mid", "high"))
    return mid if low == high else f"{mid} ({low} to {high})"


def _time(costs: Any, what: str, of: str = "") -> list[str]:
    return _span(*(costs[f"{what}_{end}{of}"] for end in ("low", "mid", "high")))


def _span(low: float, mid: float, high: float) -> list[str]:
    """Format the middle, and both ends in the unit of the upper one."""
    if math.isnan(mid):
        return ["", ""]
    _, unit, name = next(u for u in DURATIONS if high >= u[0])
    ends = number(low / unit), number(high / unit)
    return [duration(mid), "" if ends[0] == ends[1] else f"{ends[0]} - {ends[1]} {name}"]
