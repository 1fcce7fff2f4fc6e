"""Two runs in one directory, runs that were killed, and too little memory."""

from __future__ import annotations

import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch

from baselines.training.device import memory_errors
from synfeal.dataset.directories import atomic_directory
from synfeal.errors import InputError
from synfeal.files import atomic_path
from synfeal.run_lock import begin_run

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parent.parent
HOLD = "import sys, time; from pathlib import Path; from synfeal.run_lock import begin_run\n"
HOLD += "begin_run(Path(sys.argv[1])); print('begun', flush=True); time.sleep(600)"

# A job as a dry run lists it: rule, what it reads, what it writes.
JOB = re.compile(
    r"^(?:local)?rule (\w+):\n(?:    input: (.*)\n)?(?:    output: (.*)\n)?", re.MULTILINE
)


def other_run(root: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", HOLD, str(root)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


def snakemake(results: Path, target: str, *more: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *more]
    command += ["--configfile", "config/smoke.yaml", "--config", f"results={results}"]
    command += ["--", target]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_a_second_run_is_refused_until_the_first_is_dead(tmp_path: Path) -> None:
    root = tmp_path / "results" / "smoke"
    with other_run(root) as process:
        with pytest.raises(InputError, match=rf"another run .* \(process {process.pid} on "):
            begin_run(root)
        second = snakemake(root.parent, f"{root}/tables/hard_cases.csv")
        assert second.returncode == 1
        errors = [line for line in second.stderr.splitlines() if line.startswith("error:")]
        assert errors == [line for line in errors if "another run is at work there" in line] != []
        assert "Traceback" not in second.stderr
        assert [path.name for path in root.iterdir()] == [".lock"]
        process.send_signal(signal.SIGKILL)
    begin_run(root)  # nothing has to be unlocked


def write_file_of_killed_run(path: Path, root: Path) -> None:
    """A job goes on after its run was killed, and the next run begins meanwhile."""
    with atomic_path(path) as file:
        file.write_bytes(b"half")
        begin_run(root)
        assert not file.exists()


def write_directory_of_killed_run(path: Path, root: Path) -> None:
    with atomic_directory(path) as directory:
        (directory / "frame-000000.color.png").write_bytes(b"half")
        begin_run(root)
        assert not directory.exists()


def test_what_killed_runs_left_half_written_is_removed_and_nothing_else(tmp_path: Path) -> None:
    place = tmp_path / "frames" / "room"
    finished = ["train.npy", "resume.pt", ".snakemake_timestamp", ".nfs0a1b2c3d", ".hidden-file"]
    place.mkdir(parents=True)
    for name in finished:
        (place / name).write_text("whole")
    with pytest.raises(FileNotFoundError):
        write_file_of_killed_run(place / "test.npy", tmp_path)
    assert sorted(path.name for path in place.iterdir()) == sorted(finished)


def test_a_directory_half_written_is_removed(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_directory_of_killed_run(tmp_path / "seq-01", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [".lock"]


def test_a_clock_that_jumped_back_leaves_no_date_in_the_future(tmp_path: Path) -> None:
    jump_s = 3600
    ages_s = {"plan.csv": 60, "mesh.glb": -jump_s, "frames.npy": -jump_s, "model.pt": -jump_s - 1}
    now = time.time()
    for name, age_s in ages_s.items():
        (tmp_path / name).write_text(name)
        os.utime(tmp_path / name, (now - age_s, now - age_s))
    begin_run(tmp_path)
    dates = {name: (tmp_path / name).stat().st_mtime for name in ages_s}
    assert dates["plan.csv"] == pytest.approx(now - 60, abs=1e-3)
    assert now <= dates["mesh.glb"] == dates["frames.npy"] < dates["model.pt"] <= time.time()


def test_a_file_system_without_locks_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def no_locks(descriptor: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("synfeal.run_lock.fcntl.flock", no_locks)
    begin_run(tmp_path)
    message = f"{tmp_path}/.lock: No locks available; see yourself that no other run starts\n"
    assert capsys.readouterr().err == message


def test_a_results_directory_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file")
    with pytest.raises(InputError, match=re.escape(f"{tmp_path}/results")):
        begin_run(tmp_path / "results" / "mini")


def test_torch_out_of_memory_is_a_memory_error() -> None:
    with (
        pytest.raises(MemoryError, match=r"can't allocate memory: you tried to allocate \d+ bytes"),
        memory_errors(),
    ):
        torch.empty(2**56, dtype=torch.uint8)
    with pytest.raises(RuntimeError, match="shape") as caught, memory_errors():
        torch.zeros(3).reshape(2)
    assert not isinstance(caught.value, MemoryError)


def test_a_job_tells_of_too_little_memory_in_one_line(tmp_path: Path) -> None:
    log = tmp_path / "job.log"
    script = f"from synfeal.job import job\nwith job({str(log)!r}):\n    bytes(2**60)\n"
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    (line,) = run.stderr.splitlines()
    assert line.startswith("error: out of memory (no more is to be had); ")
    assert "--cores" in line
    assert "MemoryError" in log.read_text()


@pytest.mark.parametrize("target", ["all", "runs", "labels"])
def test_every_job_has_an_output_that_the_target_asks_for(target: str, tmp_path: Path) -> None:
    """Else Snakemake takes old results for those of a changed configuration after a failed job."""
    plan = snakemake(tmp_path, target, "--dry-run", "--quiet", "host").stdout
    jobs = JOB.findall(plan)
    (asked,) = (set(inputs.split(", ")) for rule, inputs, _ in jobs if rule == target)
    made = [(rule, set(outputs.split(", "))) for rule, _, outputs in jobs if outputs]
    assert {"scene", "plan", "sfm", "rgbd", "posegraph", "chain"} <= {rule for rule, _ in made}
    temporary = {"render_packed", "features"}  # what is made of their output is asked for
    assert [rule for rule, outputs in made if rule not in temporary and not outputs & asked] == []
