"""`python -m benchmarks.reproduce_cost`: two runs on two machines become one ratio."""

import pandas as pd
import pytest

from benchmarks.reproduce_cost import PART_OF, REST, cost_by_part, part_of
from reproduction.plan.pace import PUBLISHED
from reproduction.runs.job_times import read_measured
from synfeal.errors import InputError
from tests import ROOT

# Made where a profile asks for it, or by a version before the published runs.
UNPUBLISHED = ("detail", "score", "rgbd-odometry", "rgbd-open3d", "external_reference")


def jobs(*rows):
    return pd.DataFrame(rows, columns=["stage", "job", "cpu_s"])


def test_seconds_of_another_machine_are_scaled_by_work_that_is_the_same():
    """The machine here takes 1.5 times as long for the two batches that both runs have."""
    before = jobs(
        ("train", "a", 100.0),
        ("train", "b", 300.0),
        ("rgbd", "1", 10.0),
        ("rgbd", "2", 30.0),
        ("rgbd", "3", 20.0),
        ("score", "a", 2.0),
    )
    now = jobs(("train", "a", 240.0), ("rgbd", "1", 20.0), ("rgbd", "2", 40.0))
    table = cost_by_part(before, now).set_index("part")
    assert table.before_cpu_s["training"] == pytest.approx(603.0)
    assert table.before_jobs["training"] == 3
    assert table.ratio["training"] == pytest.approx(240.0 / 603.0)
    assert table.before_cpu_s["labels"] == pytest.approx(90.0)
    assert table.ratio["all"] == pytest.approx(300.0 / 693.0)


def test_runs_without_common_work_are_refused():
    with pytest.raises(InputError, match="no jobs of rgbd"):
        cost_by_part(jobs(("train", "a", 1.0)), jobs(("train", "a", 1.0)))


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
