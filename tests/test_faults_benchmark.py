"""The benchmark of faults: it kills whole trees of processes and sees what differs."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import pytest

from benchmarks.workflow_faults.determinism import Others, row_of, stage_of
from benchmarks.workflow_faults.kills import begin_anew
from benchmarks.workflow_faults.session import (
    HARD_CASES,
    RESULTS,
    cpu_of,
    jobs_of,
    kill_session,
    processes_of,
)
from benchmarks.workflow_faults.stages import why
from benchmarks.workflow_faults.trees import Hashes, damaged, missing


def test_no_process_of_a_session_survives(tmp_path: Path) -> None:
    """Neither children in groups of their own nor those that ignore signals."""
    folder = tmp_path / ".snakemake" / "scripts"
    folder.mkdir(parents=True)
    scripts = [folder / "tmpab_c1.train.py", folder / "tmpab_c2.sfm.py"]
    for script in scripts:
        script.write_text("trap '' TERM INT HUP\nwhile true; do :; done\n")
    command = ["bash", "-c", f"set -m; bash {scripts[0]} & bash {scripts[1]} & wait"]
    with subprocess.Popen(command, start_new_session=True) as process:
        for _ in range(3000):
            jobs, alive = jobs_of(process.pid), processes_of(process.pid)
            if len(jobs) == 2 and len(alive) == 3 and any(map(cpu_of, alive)):
                break
            time.sleep(0.02)
        kill_session(process)
    assert jobs == ("sfm", "train")
    assert len(alive) == 3
    assert processes_of(process.pid) == []
    assert process.returncode == -9


def tree(root: Path, **changed: str) -> dict[str, str]:
    """Hashes of a small tree of results."""
    content = {"plans/room/train.csv": "1", "logs/plan.log": "3 s", "tables/table4_size.csv": "2"}
    for name, text in (content | changed).items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    (root / "plans" / ".train-ab12cd34.csv").write_text("half")
    (root / "frames" / "room" / "shards").mkdir(parents=True)
    (root / "frames" / "room" / "shards" / "seq-01.npy").write_text("goes when it is packed")
    return Hashes().tree(root)


def test_only_what_is_promised_and_differs_is_damaged(tmp_path: Path) -> None:
    calm = tree(tmp_path / "calm")
    assert sorted(calm) == ["logs/plan.log", "plans/room/train.csv", "tables/table4_size.csv"]
    changed = {"plans/room/train.csv": "9", "logs/plan.log": "4 s", "claims.csv": "new"}
    found = tree(tmp_path / "killed", **changed)
    assert damaged(calm, found) == ["claims.csv", "plans/room/train.csv"]
    assert missing(calm, {}) == sorted(calm)


def timed_tree(root: Path, rmse: str, seconds: str) -> dict[str, str]:
    """Hashes of results of which an error or a time is another one."""
    tables = {
        "tables/label_error.csv": f"rmse,seconds_per_frame,peak_memory_mb\n{rmse},{seconds},9\n",
        "tables/label_error.tex": f"SfM & {rmse} m & {seconds} & 9 MB\n",
        "claims.csv": f"id,measured\nC13,{rmse}\nC14,{seconds} frames/s\nC15,1\n",
    }
    return tree(root, **tables)


def test_times_in_a_table_may_differ_and_errors_may_not(tmp_path: Path) -> None:
    calm = timed_tree(tmp_path / "calm", "0.5", "2")
    assert damaged(calm, timed_tree(tmp_path / "slower", "0.5", "3")) == []
    wrong = damaged(calm, timed_tree(tmp_path / "wrong", "0.6", "2"))
    assert wrong == ["claims.csv", "tables/label_error.csv", "tables/label_error.tex"]


def test_a_stage_counts_its_files_and_says_why_they_differ() -> None:
    calm = {"logs/a.log": "1", "runs/r/6k/synfeal/scratch/posenet/seed0/model.pt": "2"}
    others = Others(again=calm | {"logs/a.log": "5"}, one_core=dict.fromkeys(calm, "6"))
    assert stage_of("runs/r/6k/synfeal/scratch/posenet/seed0/model.pt") == "trained weights"
    trained = ("trained weights", 1, 1, 1, 0, 1, "model.pt", "NOT EXPECTED")
    assert row_of("trained weights", calm, others) == trained
    assert row_of("what jobs took", calm, others)[1:5] == (1, 0, 1, 0)
    not_made = row_of("trained weights", calm, others._replace(one_core={}))
    assert not_made == ("trained weights", 1, 1, 0, 0, 1, "", "")


def test_a_run_begins_anew_but_for_what_takes_long(tmp_path: Path) -> None:
    kept = [RESULTS / "scenes" / "room" / "mesh.glb", Path(HARD_CASES)]
    for name in [*kept, RESULTS / "figures" / "a.png", RESULTS / "tables" / "table4_size.csv"]:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x")
    begin_anew(tmp_path)
    left = [path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file()]
    assert sorted(left) == sorted(kept)
    assert not (tmp_path / RESULTS / "figures").exists()


@pytest.mark.parametrize(
    ("printed", "said"),
    [
        ("Job stats\nerror: results/m.glb: No space left; mend\n", "error: m.glb: No space left"),
        ("OSError: [Errno 28] No space left on device\n", "OSError: [Errno 28] No space left"),
        ("all is well\n", ""),
    ],
)
def test_the_line_that_says_why(printed: str, said: str) -> None:
    assert why(printed).startswith(said)
    assert bool(why(printed)) == bool(said)
