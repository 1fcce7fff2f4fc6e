"""The plan of a profile, from its files to the text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from synfeal.report.cost.compare import compare_cost
from synfeal.report.cost.estimate import Machine, by_table, job_costs, stage_costs
from synfeal.report.cost.jobs import run_jobs, table_keys
from synfeal.report.cost.laws import fit_laws
from synfeal.report.cost.profiles import read_profile, read_run, read_runs
from synfeal.report.cost.text import (
    comparison_table,
    notes,
    stage_table,
    table_table,
    write_csv,
)


def plan_text(
    profile_name: str, measured: Sequence[Path], machine: Machine, out_csv: Path | None
) -> str:
    """What a run of a profile costs, stage by stage and table by table.

    Args:
        profile_name: a profile of ``config/``, or the path of its file.
        measured: results of runs that the prediction is made from.
        machine: what it is planned for.
        out_csv: where the table of stages is written too, if anywhere.

    Raises:
        InputError: a profile or a run cannot be read.
    """
    profile = read_profile(profile_name)
    pairs, unknown = read_runs(measured)
    laws = fit_laws(pairs)
    if profile.config.training.device == "cpu":
        machine = Machine(machine.cores, 0, machine.gpu_tflops)
    costs = job_costs(run_jobs(profile.config, profile.experiments), laws, machine)
    stages = stage_costs(costs, laws, machine)
    tables = by_table(costs, table_keys(profile.config, profile.experiments))
    if out_csv is not None:
        write_csv(out_csv, stages)
    origin = f"{len(pairs)} jobs of {', '.join(map(str, measured))}"
    if unknown:
        origin += f" ({unknown} more are of another design or an older workflow)"
    title = f"Profile {profile.config.profile}"
    remarks = notes(machine, stages, origin)
    return f"{title}\n\n{stage_table(stages)}\n{table_table(tables)}\n{remarks}\n"


def comparison_text(measured: Sequence[Path], compared: Path) -> str:
    """What the measured runs predict for the jobs of another, beside what these took.

    Raises:
        InputError: a profile or a run cannot be read.
    """
    pairs, _ = read_runs(measured)
    others, unknown = read_run(compared)
    rows = compare_cost(fit_laws(pairs), others)
    left = f"; {unknown} jobs are of another design or an older workflow" if unknown else ""
    title = f"{compared} predicted from {', '.join(map(str, measured))}{left}"
    return f"{title}\n\n{comparison_table(rows)}"
