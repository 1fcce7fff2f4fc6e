"""What a run costs: every job's law applied to its size, summed by stage and by table."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from synfeal.report.cost.jobs import TRAINING, UNITS, Job
from synfeal.report.cost.laws import Law

# An assumed throughput may be off by this factor either way.
GPU_FACTOR = 2.0
# Assumed of a GPU: starting the kernels of a layer, forward, backward and in the update of weights.
LAUNCH_S = 1e-4


@dataclass(frozen=True)
class Machine:
    """What a run is planned for.

    Attributes:
        cores: jobs at a time.
        gpus: trainings at a time; 0 trains on the processor.
        gpu_tflops: sustained by a training on a GPU, in 10^12 operations per second: an assumption.
        gpu_rates: seconds of a training on a GPU per layer and step, and per TFLOP, if timed.
    """

    cores: int
    gpus: int
    gpu_tflops: float
    gpu_rates: tuple[float, float] | None = None

    def gpu_s(self, layer_steps: float, tflop: float) -> float:
        """Seconds of a training on a GPU."""
        if self.gpu_rates is not None:
            return self.gpu_rates[0] * layer_steps + self.gpu_rates[1] * tflop
        return max(tflop / self.gpu_tflops, layer_steps * LAUNCH_S)


class Span(NamedTuple):
    """Seconds: low, expected, high."""

    low: float
    mid: float
    high: float

    def plus(self, other: Span) -> Span:
        """Sum, as if both were off the same way."""
        return Span(self.low + other.low, self.mid + other.mid, self.high + other.high)


NOTHING = Span(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class JobCost:
    """One job: processor seconds, GPU seconds, and whether its law was measured at all."""

    job: Job
    cpu_s: Span
    gpu_s: Span
    known: bool


@dataclass(frozen=True)
class StageCost:
    """The jobs of a stage.

    Attributes:
        stage: its name.
        jobs: how many.
        work: sum of their sizes in the main unit, and that unit; empty where all are alike.
        cpu_s: processor time.
        gpu_s: of trainings on a GPU, during which a core is busy too.
        wall_s: from the stage's start to its end on the machine.
        disk_bytes: what it leaves behind.
        peak_mb: of its largest job; None where it was not measured.
        beyond: largest planned job over the largest measured one, in the main unit.
        known: whether it was measured.
    """

    stage: str
    jobs: int
    work: tuple[float, str] | None
    cpu_s: Span
    gpu_s: Span
    wall_s: Span
    disk_bytes: float
    peak_mb: float | None
    beyond: float | None
    known: bool


def job_costs(jobs: Sequence[Job], laws: Mapping[str, Law], machine: Machine) -> list[JobCost]:
    """Every job by itself."""
    return [_job_cost(job, laws.get(job.law), machine) for job in jobs]


def _job_cost(job: Job, law: Law | None, machine: Machine) -> JobCost:
    if law is None:
        return JobCost(job, NOTHING, NOTHING, known=False)
    low, high = law.spread
    if job.law == TRAINING and machine.gpus:
        gpu_s = machine.gpu_s(*job.size)
        gpu = Span(gpu_s / GPU_FACTOR, gpu_s, gpu_s * GPU_FACTOR)
        start = Span(law.fixed_s * low, law.fixed_s, law.fixed_s * high)
        return JobCost(job, start.plus(gpu), gpu, known=True)
    seconds = law.seconds(job.size)
    return JobCost(job, Span(seconds * low, seconds, seconds * high), NOTHING, known=True)


def total(costs: Sequence[JobCost]) -> tuple[Span, Span]:
    """Processor and GPU seconds of several jobs."""
    cpu_s, gpu_s = NOTHING, NOTHING
    for cost in costs:
        cpu_s, gpu_s = cpu_s.plus(cost.cpu_s), gpu_s.plus(cost.gpu_s)
    return cpu_s, gpu_s


def stage_costs(
    costs: Sequence[JobCost], laws: Mapping[str, Law], machine: Machine
) -> list[StageCost]:
    """The same by stage, in the order of the jobs."""
    groups = _by_stage(costs)
    return [_stage_cost(name, group, laws, machine) for name, group in groups.items()]


def _by_stage(costs: Sequence[JobCost]) -> dict[str, list[JobCost]]:
    stages: dict[str, list[JobCost]] = {}
    for cost in costs:
        stages.setdefault(cost.job.stage, []).append(cost)
    return stages


def _stage_cost(
    stage: str, costs: list[JobCost], laws: Mapping[str, Law], machine: Machine
) -> StageCost:
    jobs = [cost.job for cost in costs]
    law, units = laws.get(jobs[0].law), UNITS.get(jobs[0].law)
    sizes = [job.size[-1] for job in jobs if job.size]
    cpu_s, gpu_s = total(costs)
    peak_mb = beyond = None
    if law is not None and law.base_mb is not None:
        peak_mb = law.base_mb + max(job.held_bytes for job in jobs) / 1e6
    if law is not None and law.largest and sizes:
        beyond = max(sizes) / law.largest
    return StageCost(
        stage,
        len(jobs),
        (sum(sizes), units[-1]) if units else None,
        cpu_s,
        gpu_s,
        stage_wall(costs, machine),
        sum(job.disk_bytes for job in jobs),
        peak_mb,
        beyond,
        costs[0].known,
    )


def stage_wall(costs: Sequence[JobCost], machine: Machine) -> Span:
    """From the start of a stage to its end, with all its jobs off the same way."""
    on_gpu = any(cost.gpu_s.mid for cost in costs)
    slots = min(machine.cores, machine.gpus) if on_gpu else machine.cores
    low, mid, high = zip(*(cost.cpu_s for cost in costs), strict=True)
    return Span(wall_seconds(low, slots), wall_seconds(mid, slots), wall_seconds(high, slots))


def run_wall(costs: Sequence[JobCost], machine: Machine) -> Span:
    """The same of several stages, one after the other."""
    wall_s = NOTHING
    for group in _by_stage(costs).values():
        wall_s = wall_s.plus(stage_wall(group, machine))
    return wall_s


def wall_seconds(seconds: Sequence[float], slots: int) -> float:
    """When the last of some jobs ends if the longest waiting one starts on the first free slot."""
    ends = [0.0] * slots
    for job in sorted(seconds, reverse=True):
        heapq.heappushpop(ends, ends[0] + job)
    return max(ends)


@dataclass(frozen=True)
class Share:
    """What some jobs take together: processor and GPU time, and from start to end."""

    jobs: int
    cpu_s: Span
    gpu_s: Span
    wall_s: Span


class TableCost(NamedTuple):
    """Jobs that only one table needs, or several share."""

    name: str
    own: Share
    # The table by itself, with what it shares; None for what is no table.
    alone: Share | None


def share_of(costs: Sequence[JobCost], machine: Machine) -> Share:
    """The sum of some jobs."""
    return Share(len(costs), *total(costs), run_wall(costs, machine))


def by_table(
    costs: Sequence[JobCost],
    needed: Mapping[str, frozenset[tuple[str, str]]],
    machine: Machine,
) -> list[TableCost]:
    """Each table's own jobs, then those that several share, then those that none needs.

    Every job is counted once; ``alone`` says what a table costs if nothing else is made.
    """
    owners = {c.job.key: [t for t, keys in needed.items() if c.job.key in keys] for c in costs}
    rows = []
    for table, keys in needed.items():
        own = share_of([c for c in costs if owners[c.job.key] == [table]], machine)
        alone = share_of([c for c in costs if c.job.key in keys], machine)
        rows.append(TableCost(table, own, alone))
    shared = share_of([c for c in costs if len(owners[c.job.key]) > 1], machine)
    rest = share_of([c for c in costs if not owners[c.job.key]], machine)
    return [
        *rows,
        TableCost("shared by several", shared, None),
        TableCost("report and figures", rest, None),
    ]
