"""`python -m benchmarks.reproduce_cost`: two runs on two machines become one ratio."""

import shutil

import pandas as pd
import pytest

from benchmarks.reproduce_cost import (
    PART_OF,
    REST,
    VERSION_01_S,
    as_if_here,
    compared,
    cost_by_part,
    costs_before,
    main,
    part_of,
)
from reproduction.plan.pace import PUBLISHED
from reproduction.runs.job_times import read_measured
from synfeal.errors import InputError
from tests import ROOT

# Made where a profile asks for it, or by a version before the published runs.
UNPUBLISHED = ("detail", "score", "rgbd-odometry", "rgbd-open3d", "external_reference")


def jobs(*rows):
    return pd.DataFrame(rows, columns=["stage", "job", "cpu_s"])


def test_seconds_of_a_stage_are_scaled_by_its_repeated_jobs():
    """Training takes 1.5 times as long here, batches 3 times; others as all of these together."""
    run = jobs(("train", "a", 100.0), ("train", "b", 300.0), ("rgbd", "1", 20.0), ("plan", "x", 8))
    repeated = jobs(("train", "a", 150.0), ("rgbd", "1", 60.0), ("rgbd", "2", 1000.0))
    found = as_if_here(run, repeated)
    assert found.here_cpu_s.tolist() == pytest.approx([150.0, 450.0, 60.0, 8 * 210 / 120])
    assert found.repeated.tolist() == [True, False, True, False]


def test_parts_of_two_runs_add_up_to_one_ratio():
    before = jobs(
        ("train", "a", 100.0), ("train", "b", 300.0), ("rgbd", "1", 50.0), ("score", "a", 2)
    )
    now = jobs(("train", "a", 200.0), ("rgbd", "1", 20.0))
    twice = before[before["stage"] == "train"].assign(cpu_s=lambda run: run["cpu_s"] * 2)
    costs = cost_by_part(as_if_here(now, now))
    table = compared(costs_before(as_if_here(before, twice)), costs).set_index("part")
    assert table.before_cpu_s["training"] == pytest.approx(804.0)
    assert (table.before_jobs["training"], table.before_repeated["training"]) == (3, 2)
    assert table.ratio["training"] == pytest.approx(200.0 / 804.0)
    assert table.ratio["all"] == pytest.approx(220.0 / 904.0)
    # Version 0.1 was timed where the run before was, and is slower here as it is.
    assert table.version_01_cpu_s["all"] / sum(VERSION_01_S.values()) == pytest.approx(
        904.0 / 452.0
    )


def test_another_run_is_compared_with_a_table_made_before(tmp_path):
    table = tmp_path / "before.csv"
    shutil.copy(ROOT / "results/benchmarks/reproduce_cost.csv", table)
    earlier = pd.read_csv(table).set_index("part")
    run, out = ROOT / "results/published/mini", tmp_path / "out.csv"
    assert main(["--kept", str(table), "--now", str(run), "--out", str(out)]) == 0
    found = pd.read_csv(out).set_index("part")
    assert found.before_cpu_s.equals(earlier.before_cpu_s)
    measured = read_measured(run)["cpu_s"].sum()
    assert found.cpu_s["all"] == pytest.approx(measured, abs=1)
    assert found.ratio["all"] == pytest.approx(measured / earlier.before_cpu_s["all"], abs=1e-3)


def test_repeated_jobs_of_another_run_are_refused():
    with pytest.raises(InputError, match="repeat jobs of that run"):
        as_if_here(jobs(("train", "a", 1.0)), jobs(("train", "b", 1.0)))


def test_every_stage_of_a_plan_belongs_to_a_part():
    stages = {stage for root in PUBLISHED for stage in read_measured(ROOT / root)["stage"]}
    rest = {stage for stage in stages if part_of(stage) == REST}
    assert rest == {
        "scene",
        "plan",
        "dataset",
        "coverage",
        "render_speed",
        "collection_speed",
        "tables",
        "claims",
        "figures",
        "summary",
    }
    assert set(PART_OF) <= {*stages, *UNPUBLISHED}
