"""Plan of a run, and its check against measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from baselines.training.memory import training_mb
from reproduction.design.experiments import read_design
from reproduction.design.files import Files
from reproduction.design.profiles import read_profile
from reproduction.plan.jobs import jobs_of
from reproduction.plan.pace import paces_of, read_run, seconds_of
from reproduction.plan.text import SIZES, duration, number, scaled
from reproduction.tables.sheet import text_table
from synfeal.records.tables import write_frame

TABLE_ALONE = "table alone"
NOTES = """\
measured    {measured}
CPU time    of a core like theirs; the sum is meant to be within a factor of 1.5 (docs/cost.md)
wall time   at least: rule after rule, all work on all cores, or the longest job on one
x measured  largest planned job over largest measured one; far above 1 is extrapolated
training    on these cores; on a GPU: --gpu
"""


def plan_text(
    profile: str, measured: Sequence[Path], cores: Sequence[int], csv: Path | None = None
) -> str:
    """Plan a run of a profile that begins with nothing.

    Args:
        profile: Its name, or its file.
        measured: Results of the runs it is predicted from.
        cores: Jobs at a time; a plan for each number.
        csv: File for the plans as one table.
    """
    files = read_profile(profile)
    paces = paces_of(map(read_run, measured))
    plans = [_costs(files, paces, count) for count in cores]
    if csv is not None:
        write_frame(csv, pd.concat(plans), "%.4g")
    return "\n".join(_text(files, costs, measured) for costs in plans)


def planned_tables(profile: str, measured: Sequence[Path], cores: int) -> pd.DataFrame:
    """Predict what a run costs that makes one of the tables alone, and begins with nothing.

    Args:
        profile: Its profile's name, or its file.
        measured: Results of the runs it is predicted from.
        cores: Jobs at a time.

    Returns:
        Columns ``jobs``, ``cpu_s`` and ``wall_s``, by table.
    """
    costs = _costs(read_profile(profile), paces_of(map(read_run, measured)), cores)
    return costs[costs["part"] == TABLE_ALONE].set_index("name")[["jobs", "cpu_s", "wall_s"]]


def compare_text(measured: Sequence[Path], compared: Path, csv: Path | None = None) -> str:
    """Predict a measured run from each of others, and each of those from it.

    Args:
        measured: Results of the others.
        compared: Results of the run.
        csv: File for predictions and measurements as one table.
    """
    run, comparisons = read_run(compared), {}
    for other in measured:
        jobs = read_run(other)
        comparisons[str(other), str(compared)] = _comparison(paces_of([jobs]), run)
        comparisons[str(compared), str(other)] = _comparison(paces_of([run]), jobs)
    if csv is not None:
        names = ["predicted_from", "predicted"]
        write_frame(csv, pd.concat(comparisons, names=names).reset_index(names), "%.4g")
    return "\n".join(
        f"{predicted} predicted from {source}\n\n{_compared(rows)}"
        for (source, predicted), rows in comparisons.items()
    )


def _costs(files: Files, paces: pd.DataFrame, cores: int) -> pd.DataFrame:
    """Compute the costs of each rule, of the run, and of a run that makes one table alone."""
    rules = _by_rule(files, paces, cores)
    wholes = {("run", "total"): rules}
    for table in files.design.tables:
        config = files.config.model_copy(update={"tables": (table,)})
        alone = Files(config, read_design(config))
        wholes[TABLE_ALONE, table] = _by_rule(alone, paces, cores)
    sums = [
        {"part": part, "name": name, **rows[["jobs", "cpu_s", "wall_s"]].sum()}
        for (part, name), rows in wholes.items()
    ]
    costs = pd.concat([rules, pd.DataFrame(sums)], ignore_index=True).astype({"jobs": int})
    costs.insert(0, "profile", files.config.profile)
    costs.insert(1, "cores", cores)
    return costs


def _by_rule(files: Files, paces: pd.DataFrame, cores: int) -> pd.DataFrame:
    """Sum the costs of jobs by rule; ``wall_s`` is the least that it can take on the cores."""
    jobs = jobs_of(files)
    jobs["cpu_s"] = seconds_of(jobs, paces)
    jobs["times_measured"] = jobs["cost"] / jobs["pace"].map(paces["largest"])
    costs = jobs.groupby("rule", sort=False).agg(
        jobs=("job", "size"),
        work=("count", "sum"),
        unit=("unit", "first"),
        cpu_s=("cpu_s", lambda seconds: seconds.sum(skipna=False)),  # known of all jobs or of none
        longest_s=("cpu_s", "max"),
        times_measured=("times_measured", "max"),
    )
    costs["wall_s"] = costs.pop("longest_s").clip(lower=costs["cpu_s"] / cores)
    costs.insert(0, "part", "rule")
    return costs.rename_axis("name").reset_index()


def _text(files: Files, costs: pd.DataFrame, measured: Sequence[Path]) -> str:
    """Format a run in one line, its costs by rule and by table, and what they rest on."""
    config, total = files.config, costs[costs["part"] == "run"].iloc[0]
    batch_size = config.training.batch_size
    memory_mb = max(
        training_mb(files.n_of_size(*key), config.network, batch_size) for key in files.sizes
    )
    packed = costs.loc[costs["name"].isin(["pack", "pack_varied"]), "work"].sum()
    disk = scaled(3 * config.network.input_px**2 * packed, SIZES)
    cores = "1 core" if total.cores == 1 else f"{total.cores} cores"
    heading = (
        f"Profile {config.profile} on {cores}: {duration(total.wall_s)}; processor time"
        f" {duration(total.cpu_s)}, disk for packed frames {disk},"
        f" memory of a training job up to {scaled(1e6 * memory_mb, SIZES)}"
    )
    rows = [["", "jobs", "work", "CPU time", "wall time", "x measured"]]
    for r in costs.fillna({"unit": "", "times_measured": 0.0}).to_dict("records"):
        work = f"{number(r['work'])} {r['unit']}" if r["unit"] else ""
        times = [duration(r["cpu_s"]) or "unknown", duration(r["wall_s"])]
        beyond = number(r["times_measured"]) if r["times_measured"] else ""
        rows.append([r["name"], f"{r['jobs']:,}", work, *times, beyond])
    notes = NOTES.format(measured=", ".join(map(str, measured)))
    return f"{heading}\n\n{text_table(rows)}\n{notes}"


def _comparison(paces: pd.DataFrame, run: pd.DataFrame) -> pd.DataFrame:
    """Compare predicted with measured seconds, for every rule whose paces are known."""
    known = run[run["pace"].isin(paces.index)].rename(columns={"cpu_s": "measured_cpu_s"})
    known = known.assign(predicted_cpu_s=seconds_of(known, paces), jobs=1)
    rows = known.groupby("rule")[["jobs", "predicted_cpu_s", "measured_cpu_s"]].sum()
    rows = rows.sort_values("measured_cpu_s", ascending=False)
    rows.loc["total"] = rows.sum()
    rows["factor"] = rows["predicted_cpu_s"] / rows["measured_cpu_s"]
    return rows.astype({"jobs": int}).reset_index()


def _compared(rows: pd.DataFrame) -> str:
    table = [["rule", "jobs", "predicted CPU", "measured CPU", "predicted/measured"]]
    for r in rows.to_dict("records"):
        times = duration(r["predicted_cpu_s"]), duration(r["measured_cpu_s"])
        table.append([r["rule"], f"{r['jobs']:,}", *times, f"{r['factor']:.2f}"])
    return text_table(table)
