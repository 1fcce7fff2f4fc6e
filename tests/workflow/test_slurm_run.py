"""The evidence of a run through SLURM, from what SLURM 22.05 writes; a cluster, where installed."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.slurm_run.__main__ import CLUSTER, differing_files, page

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
CRASH = ["The node was killed.", "7 group_fits_train_score"]


@pytest.fixture
def trees(tmp_path):
    for tree in ("local", "slurm"):
        (tmp_path / tree / "tables").mkdir(parents=True)
        (tmp_path / tree / "tables/table4_size.csv").write_text("scene\n")
        (tmp_path / tree / "benchmarks.csv").write_text(tree)  # times: never the same
    (tmp_path / "jobs.txt").write_text(JOBS)
    (tmp_path / "slurmctld.log").write_text(LOG)
    return tmp_path / "local", tmp_path / "slurm"


@pytest.mark.parametrize("change", ["none", "other", "gone"])
def test_a_table_that_differs_or_lacks_is_named(tmp_path, trees, change):
    table = trees[1] / "tables/table4_size.csv"
    if change == "gone":
        table.unlink()
    elif change == "other":
        table.write_text("rows\n")
    text, differing = page(trees, (None, 200.0), CRASH, tmp_path)
    named = [] if change == "none" else ["tables/table4_size.csv"]
    assert differing == named
    for line in (
        f"Files that differ or lack: {', '.join(named) or 'none'}.",
        f"| of these, tables | 1 | {1 - len(named)} equal |",
        "SLURM jobs: 1; ends of jobs: 1 COMPLETED, 1 NODE_FAIL.",
        "The node was killed. Lost with it:",
        "- `7 group_fits_train_score`: NODE_FAIL, then COMPLETED",
    ):
        assert f"{line}\n" in text
    assert "setting DOWN" in text
    assert "Allocate" not in text


@pytest.mark.parametrize(("error_m", "differing"), [("0.02", 0), ("0.03", 1)])
def test_times_in_a_table_may_differ_and_errors_may_not(trees, error_m, differing):
    name = "tables/label_error.csv"
    (trees[0] / name).write_text("position_m,seconds_per_frame,peak_memory_mb\n0.02,0.1,160\n")
    (trees[1] / name).write_text(
        f"position_m,seconds_per_frame,peak_memory_mb\n{error_m},0.2,170\n"
    )
    assert len(differing_files(*trees)[1]) == differing


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
    assert "JobState=COMPLETED" in (tmp_path / "jobs.txt").read_text()
