"""The plan of a profile, from its files to the text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from synfeal.config import Config
from synfeal.report.cost.compare import Comparisons, compare_cost
from synfeal.report.cost.dry_run import planned_jobs
from synfeal.report.cost.estimate import Machine, by_table, job_costs, share_of, stage_costs
from synfeal.report.cost.jobs import jobs_of
from synfeal.report.cost.laws import fit_laws
from synfeal.report.cost.plan import Plan
from synfeal.report.cost.profiles import profile_path, read_profile, read_run, read_runs
from synfeal.report.cost.text import comparison_table, plan_lines

if TYPE_CHECKING:
    from synfeal.report.cost.steps import StepRates


def plan_of(
    profile_name: str,
    measured: Sequence[Path],
    machines: Sequence[Machine],
    time_steps: bool = False,
) -> list[Plan]:
    """What a run of a profile costs on each machine, stage by stage and table by table.

    Args:
        profile_name: a profile of ``config/``, or the path of its file.
        measured: results of runs that the prediction is made from.
        machines: what it is planned for.
        time_steps: time some training steps here, on the GPU if there is one, and use these.

    Raises:
        InputError: a profile or a run cannot be read.
    """
    profile = read_profile(profile_name)
    pairs, unknown = read_runs(measured)
    timed = _timed(profile.config) if time_steps else None
    laws = fit_laws(pairs, timed.rates if timed and not timed.on_gpu else None)
    planned = planned_jobs(profile_path(profile_name))
    jobs = jobs_of(profile, planned.keys)
    if len(jobs) < len(planned.keys):  # a rule measures jobs under names that jobs.py cannot read
        raise ValueError(f"no size of {sorted(set(planned.keys) - {job.key for job in jobs})[:3]}")
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
        stages = stage_costs(costs, laws, machine)
        tables = by_table(costs, planned.needed, machine)
        whole = share_of(costs, machine)
        plans.append(Plan(profile.config.profile, machine, stages, tables, whole, origin))
    return plans


def plan_text(plans: Sequence[Plan]) -> str:
    """Plans for a terminal."""
    return "\n".join("\n".join(plan_lines(plan)) + "\n" for plan in plans)


def compare_runs(measured: Sequence[Path], compared: Path, time_steps: bool = False) -> Comparisons:
    """What the measured runs predict for another beside what it took, and the other way round.

    With ``time_steps`` training steps of the run that is predicted are timed here, on a core.

    Raises:
        InputError: a profile or a run cannot be read.
    """
    named, name = ", ".join(map(str, measured)), str(compared)
    pairs, _ = read_runs(measured)
    others, _ = read_run(compared)
    return {
        (named, name): compare_cost(fit_laws(pairs, _rates(compared, time_steps)), others),
        (name, named): compare_cost(fit_laws(others, _rates(measured[0], time_steps)), pairs),
    }


def _rates(run: Path, time_steps: bool) -> tuple[float, float] | None:
    """Of the networks of a measured run, on a core as those of all measured runs were."""
    if not time_steps:
        return None
    config = read_profile(run.resolve().name).config
    training = config.training.model_copy(update={"device": "cpu"})
    return _timed(config.model_copy(update={"training": training})).rates


def _timed(config: Config) -> StepRates:
    from synfeal.report.cost.steps import timed_rates  # torch takes a second to load

    return timed_rates(config)


def comparison_text(comparisons: Comparisons) -> str:
    """Comparisons for a terminal."""
    return "\n".join(
        f"{predicted} predicted from {source}\n\n{comparison_table(rows)}"
        for (source, predicted), rows in comparisons.items()
    )
