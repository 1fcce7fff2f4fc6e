"""What a run costs: every job's law applied to its size, summed by stage and by table.

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

from synfeal.report.cost.jobs import TRAINING, Key
from synfeal.report.cost.laws import seconds_of

# An assumed throughput may be off by this factor either way.
GPU_FACTOR = 2.0
# Assumed of a GPU: starting the kernels of a layer, forward, backward and in the update of weights.
LAUNCH_S = 1e-4
ENDS = ("low", "mid", "high")
CPU, GPU, WALL = ([f"{what}_{end}" for end in ENDS] for what in ("cpu", "gpu", "wall"))
STAGE, ALONE, OWN, RUN = "stage", "table alone", "table", "run"


@dataclass(frozen=True)
class Machine:
    """What a run is planned for."""

    cores: int  # jobs at a time
    gpus: int  # training runs at a time; 0 trains on the processor
    gpu_tflops: float  # sustained by a run on a GPU, in 10^12 operations per second: an assumption
    # Seconds of a training run on a GPU per layer and step, and per TFLOP, if timed.
    gpu_rates: tuple[float, float] | None = None

    def gpu_s(self, layer_steps: Any, tflop: Any) -> Any:
        """Seconds of a training run on a GPU."""
        if self.gpu_rates is not None:
            return self.gpu_rates[0] * layer_steps + self.gpu_rates[1] * tflop
        return np.maximum(tflop / self.gpu_tflops, layer_steps * LAUNCH_S)


def job_costs(jobs: pd.DataFrame, laws: pd.DataFrame, machine: Machine) -> pd.DataFrame:
    """Every job with its law and its costs; NaN where the law was not measured."""
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
    """What some jobs take together, stage after stage, with all of them off the same way."""
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
    """When the last of some jobs ends if the longest waiting one starts on the first free slot."""
    ends = [0.0] * slots
    for job in sorted(seconds, reverse=True):
        heapq.heappushpop(ends, ends[0] + job)
    return max(ends)


def stage_costs(costs: pd.DataFrame, machine: Machine) -> list[dict[str, Any]]:
    """The stages in the order of the jobs; no times where a stage was not measured.

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
    """Each table by itself and its own jobs, then those that several share or none needs.

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
    """Prediction beside measurement, processor seconds: every stage with a law, and the total.

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
