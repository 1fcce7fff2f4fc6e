"""Cost of jobs as a function of their size, from measured jobs; by stage and by table.

Costs are columns: seconds of the processor ``cpu_``, of a GPU ``gpu_`` and from start to end
``wall_``, each ``low``, ``mid`` (expected) and ``high``.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from reproduction.plan.jobs import TRAINING, Key

# Least ratio of the largest to the smallest job that tells the fixed part from the part per unit.
LEAST_RATIO = 1.5
# Relative residual from which a job counts as an outlier: another job had the processor.
OUTLIER = 0.15
# A range needs this many jobs.
LEAST_JOBS = 3
QUANTILES = (0.1, 0.9)
# A law: seconds of a job are ``fixed_s + rate_other * other + rate * size``, and 10 and 90 % of the
# measured ones are below ``low`` and ``high`` times that (1 for under three jobs). ``largest`` of
# the measured sizes, NaN where all jobs are alike; ``base_mb``, peak memory without the data a job
# holds, NaN where it was not measured.
LAW = ("fixed_s", "rate_other", "rate", "low", "high", "largest", "base_mb")


def matched(jobs: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    """Join measured jobs with what is known of those of the same name."""
    return measured.merge(jobs, on=["stage", "job"])


def fit_laws(pairs: pd.DataFrame, training: tuple[float, ...] | None = None) -> pd.DataFrame:
    """Fit a law (columns :data:`LAW`) per name to all measured jobs that :func:`matched` gives.

    ``training`` are the parts per unit of training runs, where they are known better.
    """
    start_s = _start(pairs)
    laws = {
        name: _law(group, start_s, training if name == TRAINING else None)
        for name, group in pairs.groupby("law", sort=False)
    }
    return pd.DataFrame.from_dict(laws, orient="index", columns=list(LAW), dtype=float)


def seconds_of(jobs: pd.DataFrame, laws: pd.DataFrame) -> pd.Series[float]:
    """Predict the seconds of every job by its law; NaN where there is none."""
    law = jobs[["law"]].join(laws, on="law")
    work = law["rate_other"] * jobs["other"].fillna(0.0) + law["rate"] * jobs["size"].fillna(0.0)
    return law["fixed_s"] + work


def fit_seconds(
    sizes: NDArray[np.float64], seconds: NDArray[np.float64], start_s: float
) -> tuple[float, tuple[float, ...]]:
    """Fit a fixed part, at least the start of a program, and parts per unit, none negative.

    Sizes (N, K) that differ enough are fitted by robust least squares on relative residuals. Else
    the fixed part is the start of a program, and what all jobs took beyond that is per main (last)
    unit.
    """
    n_units = sizes.shape[1]
    if n_units == 0:
        return float(np.mean(seconds)), ()
    varied = max(np.ptp(np.log(np.maximum(column, 1e-12))) for column in sizes.T)
    if len(sizes) >= 2 * (n_units + 1) and varied >= np.log(LEAST_RATIO):
        return _regression(sizes, seconds, min(start_s, float(seconds.min())))
    fixed_s, work = min(start_s, float(np.median(seconds))), float(sizes[:, -1].sum())
    rate = max(float(np.sum(seconds - fixed_s)), 0.0) / work if work else 0.0
    return fixed_s, (*[0.0] * (n_units - 1), rate)


def _regression(
    sizes: NDArray[np.float64], seconds: NDArray[np.float64], least_s: float
) -> tuple[float, tuple[float, ...]]:
    """Fit a fixed part, at least ``least_s``, and parts per unit, none negative."""
    design = np.column_stack([np.ones(len(sizes)), sizes])
    scale = np.maximum(design.max(axis=0), 1e-12)
    weighted = design / scale / seconds[:, None]
    least = np.array([least_s, *[0.0] * sizes.shape[1]])
    fit = least_squares(
        lambda x: weighted @ x - 1,
        least + seconds.mean() / len(least),
        bounds=(least, np.inf),
        loss="soft_l1",
        f_scale=OUTLIER,
    )
    fixed_s, *rates = fit.x / scale
    return float(fixed_s), tuple(float(rate) for rate in rates)


def _law(pairs: pd.DataFrame, start_s: float, known: tuple[float, ...] | None) -> list[float]:
    sizes = pairs[["other", "size"]].dropna(axis="columns").to_numpy()
    seconds = np.maximum(pairs["cpu_s"].to_numpy(), 1e-3)
    if known is None:
        fixed_s, rates = fit_seconds(sizes, seconds, start_s)
        # Scenes differ, and a robust fit follows most jobs: the sum of all is what is asked for.
        level = float(seconds.sum() / (fixed_s + sizes @ np.array(rates)).sum())
        fixed_s, rates = fixed_s * level, tuple(rate * level for rate in rates)
    else:
        rates = known
        fixed_s = max(start_s, float(np.median(seconds - sizes @ np.array(rates))))
    spread = np.ones(2)
    if len(pairs) >= LEAST_JOBS:
        spread = np.quantile(seconds / (fixed_s + sizes @ np.array(rates)), QUANTILES)
    base_mb = (pairs["peak_mb"] - pairs["held_bytes"] / 1e6).max()
    return [fixed_s, *(0.0, 0.0, *rates)[-2:], *spread, pairs["size"].max(), base_mb]


def _start(pairs: pd.DataFrame) -> float:
    """Estimate the seconds to start a program: the median of the stage where it is least."""
    stages = pairs.groupby("stage")["cpu_s"].agg(["median", "size"])
    enough = stages[stages["size"] >= LEAST_JOBS]
    return float((enough if len(enough) else stages)["median"].min())


# An assumed throughput may be off by this factor either way.
GPU_FACTOR = 2.0
# Assumed of a GPU: starting the kernels of a layer, forward, backward and in the update of weights.
LAUNCH_S = 1e-4
ENDS = ("low", "mid", "high")
CPU, GPU, WALL = ([f"{what}_{end}" for end in ENDS] for what in ("cpu", "gpu", "wall"))
STAGE, ALONE, OWN, RUN = "stage", "table alone", "table", "run"


@dataclass(frozen=True)
class Machine:
    """Machine that a run is planned for."""

    cores: int  # jobs at a time
    gpus: int  # training runs at a time; 0 trains on the processor
    gpu_tflops: float  # sustained by a run on a GPU, in 10^12 operations per second: an assumption
    # Seconds of a training run on a GPU per layer and step, and per TFLOP, if timed.
    gpu_rates: tuple[float, float] | None = None

    def gpu_s(self, layer_steps: Any, tflop: Any) -> Any:
        """Predict the seconds of a training run on a GPU."""
        if self.gpu_rates is not None:
            return self.gpu_rates[0] * layer_steps + self.gpu_rates[1] * tflop
        return np.maximum(tflop / self.gpu_tflops, layer_steps * LAUNCH_S)


def job_costs(jobs: pd.DataFrame, laws: pd.DataFrame, machine: Machine) -> pd.DataFrame:
    """Tabulate every job with its law and its costs; NaN where the law was not measured."""
    costs = jobs.join(laws, on="law")
    known = costs["fixed_s"].notna()
    on_gpu = costs["law"].eq(TRAINING) & bool(machine.gpus)
    gpu_s = machine.gpu_s(costs["other"], costs["size"]).where(on_gpu, 0.0).where(known)
    on_core_s = costs["fixed_s"].where(on_gpu, seconds_of(jobs, laws))
    shares: tuple[Any, ...] = (costs["low"], 1.0, costs["high"])
    for end, share, off in zip(ENDS, shares, (1 / GPU_FACTOR, 1.0, GPU_FACTOR), strict=True):
        costs[f"gpu_{end}"] = gpu_s * off
        costs[f"cpu_{end}"] = on_core_s * share + costs[f"gpu_{end}"]
    costs["peak_mb"] = costs["base_mb"] + costs["held_bytes"] / 1e6
    costs["beyond"] = costs["size"] / costs["largest"].where(costs["largest"] > 0)
    return costs


def summed(costs: pd.DataFrame, machine: Machine) -> dict[str, Any]:
    """Add up jobs stage after stage, assuming fully correlated errors."""
    walls = []  # from the start of each stage to its end
    for _, stage in costs.groupby("stage", sort=False):
        on_gpu = stage["gpu_mid"].gt(0).any()
        slots = min(machine.cores, machine.gpus) if on_gpu else machine.cores
        walls.append([wall_seconds(stage[column].dropna(), slots) for column in CPU])
    return {
        "jobs": len(costs),
        **costs[[*CPU, *GPU]].sum(),
        **dict(zip(WALL, np.sum(walls, axis=0) if walls else np.zeros(3), strict=True)),
        "disk_bytes": costs["disk_bytes"].sum(),
        "peak_mb": costs["peak_mb"].max(),
    }


def wall_seconds(seconds: Iterable[float], slots: int) -> float:
    """Schedule jobs, longest first, on free slots: seconds until the last one ends."""
    ends = [0.0] * slots
    for job in sorted(seconds, reverse=True):
        heapq.heappushpop(ends, ends[0] + job)
    return max(ends)


def stage_costs(costs: pd.DataFrame, machine: Machine) -> list[dict[str, Any]]:
    """List the stages in the order of the jobs; no times where a stage was not measured.

    ``work`` is the sum of the sizes in their ``unit``, ``beyond`` the largest planned job over the
    largest measured one.
    """
    rows = []
    for name, stage in costs.groupby("stage", sort=False):
        row = {"part": STAGE, "name": name, **summed(stage, machine)}
        row |= {"unit": stage["unit"].iloc[0], "work": stage["size"].sum(min_count=1)}
        row |= {"beyond": stage["beyond"].max(), "measured": "yes"}
        if stage["fixed_s"].isna().all():
            row |= dict.fromkeys((*CPU, *GPU, *WALL), np.nan) | {"measured": "no"}
        rows.append(row)
    return rows


def table_costs(
    costs: pd.DataFrame, needed: Mapping[str, frozenset[Key]], machine: Machine
) -> list[dict[str, Any]]:
    """List each table alone and its own jobs, then those that several share or none needs.

    Every job is counted once but in a table ``alone``: what it costs if nothing else is made.
    """
    keys = pd.Series(list(zip(costs["stage"], costs["job"], strict=True)), index=costs.index)
    owned = {table: keys.isin(list(wanted)) for table, wanted in needed.items()}
    owners = pd.DataFrame(owned, index=costs.index).sum(axis="columns")
    parts = [(ALONE, table, mask) for table, mask in owned.items()]
    parts += [(OWN, table, mask & (owners == 1)) for table, mask in owned.items()]
    parts += [(OWN, "shared by several", owners > 1), (OWN, "report and figures", owners == 0)]
    return [{"part": p, "name": name, **summed(costs[m], machine)} for p, name, m in parts]


def compare_cost(laws: pd.DataFrame, pairs: pd.DataFrame) -> pd.DataFrame:
    """Compare predicted and measured processor seconds: every stage with a law, and the total.

    The most expensive come first, the total last; ``factor`` is predicted over measured.
    """
    known = pairs[pairs["law"].isin(laws.index)].join(laws[["low", "high"]], on="law")
    known["mid"] = seconds_of(known, laws)
    known["jobs"] = 1
    for end in ("low", "high"):
        known[end] *= known["mid"]
    columns = ["jobs", "mid", "low", "high", "cpu_s"]
    stages = known.groupby("stage", sort=False)[columns].sum()
    stages = stages.sort_values("cpu_s", ascending=False, kind="stable")
    stages.loc["total"] = stages.sum()
    factor = stages["mid"] / stages["cpu_s"].where(stages["cpu_s"] > 0)
    return stages.astype({"jobs": int}).assign(factor=factor).reset_index()
