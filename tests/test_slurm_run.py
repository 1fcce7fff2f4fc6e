"""The evidence of a run through SLURM, from what SLURM 22.05 writes; a cluster, where installed."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.slurm_run.page import compare, job_records, page
from tests.slurm_run.run import CLUSTER, Crash

JOBS = """\
JobId=7 UserId=root(0) GroupId=root(0) Name=wrap JobState=NODE_FAIL Partition=gpu TimeLimit=5 \
Tres=cpu=1,mem=500M,node=1,billing=1 Account= DerivedExitCode=0:0 ExitCode=0:0
JobId=7 UserId=root(0) GroupId=root(0) Name=wrap JobState=COMPLETED Partition=gpu TimeLimit=5 \
Tres=cpu=1,mem=500M,node=1,billing=1 Account= DerivedExitCode=0:0 ExitCode=0:0
"""
LOG = """\
[2026-11-22T06:23:34.517] sched: Allocate JobId=1 NodeList=vm #CPUs=1 Partition=gpu
[2026-11-22T06:24:30.301] requeue job JobId=1 due to failure of node vm
[2026-11-22T06:24:30.302] Requeuing JobId=1
[2026-11-22T06:24:30.302] error: Nodes vm not responding, setting DOWN
[2026-11-22T06:24:57.345] node vm returned to service
"""
CRASH = Crash(3, ("7 group_fits_train_score",), 60.0, 100.0, 110.0)


def test_a_job_that_was_requeued_ends_twice():
    records = job_records(JOBS)
    assert [(r["JobId"], r["JobState"]) for r in records] == [
        ("7", "NODE_FAIL"),
        ("7", "COMPLETED"),
    ]
    assert records[0]["Tres"] == "cpu=1,mem=500M,node=1,billing=1"


@pytest.fixture
def trees(tmp_path):
    for tree in ("local", "slurm"):
        (tmp_path / tree / "tables").mkdir(parents=True)
        (tmp_path / tree / "tables/table4_size.csv").write_text("scene\n")
        (tmp_path / tree / "benchmarks.csv").write_text(tree)  # times: never the same
    (tmp_path / "jobs.txt").write_text(JOBS)
    (tmp_path / "slurmctld.log").write_text(LOG)
    return tmp_path / "local", tmp_path / "slurm"


def test_equal_tables_are_called_equal(tmp_path, trees):
    text = page((100.0, 200.0), CRASH, tmp_path, compare(*trees))
    assert "Files that differ or lack: none." in text
    assert "| of these, tables | 1 | 1 equal |" in text
    assert "SLURM jobs: 1; ends of jobs: 1 COMPLETED, 1 NODE_FAIL." in text
    assert "it was missed after 40 s and back 10 s later" in text
    assert "- `7 group_fits_train_score`: NODE_FAIL, then COMPLETED" in text
    assert "setting DOWN" in text


@pytest.mark.parametrize("change", ["other", "gone"])
def test_a_table_that_differs_or_lacks_is_named(tmp_path, trees, change):
    table = trees[1] / "tables/table4_size.csv"
    if change == "gone":
        table.unlink()
    else:
        table.write_text("rows\n")
    files = compare(*trees)
    assert files.differing == ("tables/table4_size.csv",)
    text = page((None, 200.0), CRASH, tmp_path, files)
    assert "Files that differ or lack: tables/table4_size.csv." in text
    assert "| of these, tables | 1 | 0 equal |" in text


@pytest.mark.parametrize(("error_m", "differing"), [("0.02", 0), ("0.03", 1)])
def test_times_in_a_table_may_differ_and_errors_may_not(trees, error_m, differing):
    name = "tables/label_error.csv"
    (trees[0] / name).write_text("position_m,seconds_per_frame,peak_memory_mb\n0.02,0.1,160\n")
    (trees[1] / name).write_text(
        f"position_m,seconds_per_frame,peak_memory_mb\n{error_m},0.2,170\n"
    )
    assert len(compare(*trees).differing) == differing


@pytest.mark.skipif(
    shutil.which("slurmctld", path="/usr/sbin:/usr/bin") is None
    or not shutil.which("munged", path="/usr/sbin:/usr/bin")
    or Path("/etc/slurm/slurm.conf").exists(),
    reason="needs SLURM installed, and no cluster on this machine",
)
def test_a_cluster_of_one_node_runs_a_job_and_leaves_nothing(tmp_path):
    def cluster(action):
        subprocess.run((CLUSTER, action, tmp_path), check=True, timeout=100)

    cluster("start")
    try:
        job = ("sbatch", "--wait", "--partition=gpu", "--gpus=1", f"--output={tmp_path}/out.txt")
        subprocess.run((*job, "--wrap", "echo $CUDA_VISIBLE_DEVICES"), check=True, timeout=60)
        assert (tmp_path / "out.txt").read_text() == "0\n"
    finally:
        cluster("stop")
    assert not Path("/etc/slurm/slurm.conf").exists()
    assert job_records((tmp_path / "jobs.txt").read_text())[0]["JobState"] == "COMPLETED"
