"""The plan of a profile, from its files to a table of costs; and a check of such predictions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from reproduction.plan.dry_run import planned_jobs
from reproduction.plan.jobs import jobs_of
from reproduction.plan.laws import (
    ALONE,
    OWN,
    RUN,
    Machine,
    compare_cost,
    fit_laws,
    job_costs,
    stage_costs,
    summed,
    table_costs,
)
from reproduction.plan.runs import profile_path, read_profile, read_runs
from reproduction.plan.steps import timed_rates
from synfeal.records.tables import write_frame

# By the runs that were predicted from and the run that was predicted.
Comparisons = dict[tuple[str, str], pd.DataFrame]


@dataclass(frozen=True)
class Plan:
    """Cost of a run of a profile on a machine."""

    profile: str  # its name
    machine: Machine  # what it is planned for
    # A row for each stage, for each table, and last for the run; see ``laws.py``.
    costs: pd.DataFrame
    origin: str  # what the laws were fitted to


def plan_of(
    profile_name: str,
    measured: Sequence[Path],
    machines: Sequence[Machine],
    time_steps: bool = False,
) -> list[Plan]:
    """Plan a run of a profile on each machine, stage by stage and table by table.

    It is predicted from the results of ``measured`` runs, and with ``time_steps`` from some
    training steps that are timed here, on the GPU if there is one.
    """
    profile = read_profile(profile_name)
    pairs, unknown = read_runs(*measured)
    timed = timed_rates(profile.config) if time_steps else None
    laws = fit_laws(pairs, timed.rates if timed and not timed.on_gpu else None)
    planned = planned_jobs(profile_path(profile_name))
    jobs = jobs_of(profile, planned.keys)
    if len(jobs) < len(planned.keys):  # a rule measures jobs under names that jobs.py cannot read
        known = set(zip(jobs["stage"], jobs["job"], strict=True))
        raise ValueError(f"no size of {sorted(set(planned.keys) - known)[:3]}")
    origin = f"{len(pairs)} jobs of {', '.join(map(str, measured))}"
    if unknown:
        origin += f" ({unknown} more are of another design or an older workflow)"
    if timed:
        origin += f"; training steps timed here, on a {'GPU' if timed.on_gpu else 'core'}"
    plans = []
    for machine in machines:
        if timed and timed.on_gpu:
            machine = replace(machine, gpu_rates=timed.rates)
        if profile.config.training.device == "cpu":
            machine = Machine(machine.cores, 0, machine.gpu_tflops)
        costs = job_costs(jobs, laws, machine)
        rows = [*stage_costs(costs, machine), *table_costs(costs, planned.needed, machine)]
        rows.append({"part": RUN, "name": "total", **summed(costs, machine)})
        plans.append(Plan(profile.config.profile, machine, pd.DataFrame(rows), origin))
    return plans


def compare_runs(measured: Sequence[Path], compared: Path, time_steps: bool = False) -> Comparisons:
    """Compare predictions from measured runs with the cost of another, and the other way round.

    With ``time_steps`` training steps of the run that is predicted are timed here, on a core.
    """
    named, name = ", ".join(map(str, measured)), str(compared)
    (pairs, _), (others, _) = read_runs(*measured), read_runs(compared)
    return {
        (named, name): compare_cost(fit_laws(pairs, _rates(compared, time_steps)), others),
        (name, named): compare_cost(fit_laws(others, _rates(measured[0], time_steps)), pairs),
    }


def _rates(run: Path, time_steps: bool) -> tuple[float, float] | None:
    """Return rates of a measured run's networks, on a core as those of all measured runs were."""
    if not time_steps:
        return None
    config = read_profile(run.resolve().name).config
    training = config.training.model_copy(update={"device": "cpu"})
    return timed_rates(config.model_copy(update={"training": training})).rates


def write_plans(path: Path, plans: Sequence[Plan]) -> None:
    """Write plans as a table: hours, 10^9 bytes; a row per stage, per table alone, and for all."""
    write_frame(path, pd.concat(map(_rows, plans)), "%.4g")


def _rows(plan: Plan) -> pd.DataFrame:
    machine, costs = plan.machine, plan.costs[plan.costs["part"] != OWN]
    is_whole = costs["part"] != ALONE  # what a table leaves behind others share
    ends = {"": "mid", "_low": "low", "_high": "high"}
    columns = {
        **{"profile": plan.profile, "cores": machine.cores, "gpus": machine.gpus},
        "gpu_tflops": f"{machine.gpu_tflops:g}" if machine.gpus else "",
        **{name: costs[name] for name in ("part", "name", "jobs")},
        "work": costs["work"].map("{:.6g}".format, na_action="ignore"),
        "unit": costs["unit"],
        **{
            f"{what}_h{end}": costs[f"{what}_{column}"] / 3600
            for what in ("cpu", "gpu", "wall")
            for end, column in ends.items()
        },
        "disk_gb": (costs["disk_bytes"] / 1e9).where(is_whole),
        "peak_memory_gb": (costs["peak_mb"] / 1e3).where(is_whole),
        **{"times_measured_size": costs["beyond"], "measured": costs["measured"]},
    }
    return pd.DataFrame(columns)


def write_check(path: Path, comparisons: Comparisons) -> None:
    """Write predictions beside measurements, processor seconds."""
    tables = [
        pd.DataFrame(
            {
                **{"predicted_from": source, "predicted": predicted},
                **{name: rows[name] for name in ("stage", "jobs")},
                "predicted_cpu_s": rows["mid"],
                **{f"predicted_{end}_cpu_s": rows[end] for end in ("low", "high")},
                "measured_cpu_s": rows["cpu_s"],
                "factor": rows["factor"].map("{:.3g}".format),
            }
        )
        for (source, predicted), rows in comparisons.items()
    ]
    write_frame(path, pd.concat(tables), "%.4g")
