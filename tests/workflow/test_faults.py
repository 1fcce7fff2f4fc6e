"""A full disk at every kind of file the stages write: said so, nothing left, whole afterwards."""

import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from matplotlib.figure import Figure

from baselines.labels.batches import failed_trajectory, read_trajectory, write_trajectory
from baselines.labels.posegraph.graph import PoseGraph, write_g2o
from baselines.localizers.memory import memory_errors
from baselines.training.checkpoint import save_atomically
from baselines.training.resume import ResumeFile
from baselines.training.selection import HistoryRow, write_history
from reproduction.figures.registry import save
from synfeal.dataset.packed import join_packed, new_packed, read_packed
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import Triangles, load_collision_mesh, save_collision_mesh
from synfeal.records.files import read_json, write_json, write_text
from synfeal.records.lock import begin_run, remove_unfinished
from tests.support.collected import painted
from tests.support.jobs import run_job
from tests.support.small_disk import mounted, remount
from tests.workflow.test_workflow import snakemake

N = 2000  # rows, vertices or values: more than the disk holds
ROOM_FOR_NOTHING = "12k"


def poses():
    index = np.arange(N)
    position_m = np.random.default_rng(0).normal(size=(N, 3))
    return PoseTable(index, index, position_m, np.tile([1.0, 0, 0, 0], (N, 1)))


def sphere():
    mesh = trimesh.creation.icosphere(4)
    return Triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def write_mesh(path):
    save_glb(path, painted(trimesh.creation.icosphere(4)))


def write_graph(path):
    write_g2o(path, PoseGraph(np.tile(np.eye(4), (N, 1, 1)), ()))


def write_resume(path):
    ResumeFile(path, "this training").save_if_due({"weights": torch.nn.Linear(N, 4)}, now=True)


def write_rows(path):
    write_history(path, [HistoryRow(step, 1 / 3, 1e-3) for step in range(N)])


def write_parts(path):
    part = path.parents[1] / "part.npy"
    with new_packed(part, N, 4) as packed:
        packed[:] = 7
    join_packed([part], path)


def draw(path):
    figure = Figure()
    figure.subplots().imshow(np.random.default_rng(0).random((N // 10, N // 10)))
    save(figure, path)


WRITERS = {
    "mesh.glb": (write_mesh, load_mesh),
    "collision.ply": (lambda path: save_collision_mesh(path, sphere()), load_collision_mesh),
    "properties.json": (lambda path: write_json(path, list(range(N))), read_json),
    "train.csv": (lambda path: write_pose_table(path, poses()), read_pose_table),
    "train.npy": (write_parts, read_packed),
    "batch-000.csv": (lambda p: write_trajectory(p, failed_trajectory(N)), read_trajectory),
    "batch-000.g2o": (write_graph, lambda path: path.read_text()),
    "googlenet.pt": (lambda path: save_atomically(path, torch.zeros(N, 4)), torch.load),
    "resume.pt": (write_resume, Path.read_bytes),
    "history.csv": (write_rows, Path.read_text),
    "table.tex": (lambda path: write_text(path, "cell & " * N), Path.read_text),
    "figure.png": (draw, Path.read_bytes),
    "figure.svg": (draw, Path.read_bytes),
}


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    with mounted(tmp_path_factory.mktemp("faults") / "disk", ROOM_FOR_NOTHING) as place:
        yield place


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_is_named_and_nothing_is_left(name, disk):
    write, read = WRITERS[name]
    with pytest.raises(OSError, match="No space left on device") as caught:
        write(disk / name)
    assert caught.value.errno == errno.ENOSPC
    assert caught.value.filename == str(disk / name)
    assert list(disk.iterdir()) == []
    remount(disk, "size=50m")
    write(disk / name)
    read(disk / name)
    assert [path.name for path in disk.iterdir()] == [name]
    (disk / name).unlink()
    remount(disk, f"size={ROOM_FOR_NOTHING}")


def test_a_job_tells_of_a_full_disk_where_its_log_lies_too(disk):
    place = disk / "facts.json"
    (disk / "other").write_bytes(bytes(8192))  # the log's first page is the last that is free
    write = f"import pathlib; write_json(pathlib.Path({str(place)!r}), ['word'] * 9000)"
    run = run_job(disk, f"from synfeal.records.files import write_json; {write}")
    assert run.returncode == 1
    assert run.stderr == f"error: {place}: No space left on device; fix that and start again\n"
    assert not place.exists()
    for path in disk.iterdir():
        path.unlink()


HOLD = "import sys, time; from pathlib import Path; from synfeal.records.lock import begin_run\n"
HOLD += "begin_run(Path(sys.argv[1])); print('begun', flush=True); time.sleep(600)"

# A job as a dry run lists it: rule, what it reads, what it writes.
JOB = re.compile(
    r"^(?:local)?rule (\w+):\n(?:    input: (.*)\n)?(?:    output: (.*)\n)?", re.MULTILINE
)


def other_run(root):
    command = [sys.executable, "-c", HOLD, str(root)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


def smoke(results, target, *more):
    given = ("--configfile", "config/smoke.yaml", "--config", f"results={results}")
    return snakemake(*more, *given, "--", target)


@pytest.mark.slow
def test_a_second_run_is_refused_until_the_first_is_dead(tmp_path):
    root = tmp_path / "results" / "smoke"
    with other_run(root) as process:
        with pytest.raises(InputError, match=rf"another run .* \(process {process.pid} on "):
            begin_run(root)
        second = smoke(root.parent, f"{root}/tables/table1_meshes.csv")
        assert second.returncode == 1
        errors = [line for line in second.stderr.splitlines() if line.startswith("error:")]
        assert errors == [line for line in errors if "another run is at work there" in line] != []
        assert "Traceback" not in second.stderr
        assert [path.name for path in root.iterdir()] == [".lock"]
        process.send_signal(signal.SIGKILL)
    begin_run(root)  # nothing has to be unlocked


ATOMIC = {"test.npy": "atomic_path", "seq-01": "atomic_directory"}
WRITE = """
import os, sys, time
from pathlib import Path
from synfeal.records.files import atomic_directory, atomic_path
path = Path(sys.argv[1])
with {writer}(path) as half:
    (half / "frame.png" if half.is_dir() else half).write_bytes(b"half")
    print(half, flush=True)
    sys.stdin.readline()
"""
SOMEBODYS = (".notes-20261101.md", ".cache-download", ".hidden-file", ".nfs0a1b2c3d", "train.npy")


@pytest.mark.parametrize("name", ATOMIC)
def test_what_killed_writers_left_is_removed_and_nothing_else(name, tmp_path):
    """Neither files that somebody keeps there nor what a living process is still writing."""
    place = tmp_path / "frames" / "room"
    place.mkdir(parents=True)
    for kept in SOMEBODYS:
        (place / kept).write_text("whole")
    command = [sys.executable, "-c", WRITE.format(writer=ATOMIC[name]), str(place / name)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as killed, subprocess.Popen(command, **pipes) as alive:
        left, written = (Path(p.stdout.readline().strip()) for p in (killed, alive))
        killed.kill()
        killed.wait()
        begin_run(tmp_path)
        assert not left.exists()
        assert written.exists()
        alive.communicate("go on\n")
    assert alive.returncode == 0
    assert sorted(path.name for path in place.iterdir()) == sorted((*SOMEBODYS, name))


def test_what_another_machine_is_writing_stays_for_a_day(tmp_path):
    fresh, old = (tmp_path / f".synfeal-unfinished-node7-123-{n}-abcdefgh.npy" for n in "ab")
    for path in (fresh, old):
        path.write_bytes(b"half")
    long_ago_s = time.time() - 3 * 86400
    os.utime(old, (long_ago_s, long_ago_s))
    remove_unfinished(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [fresh.name]


def test_jumped_clocks_leave_no_date_in_the_future_and_missing_locks_are_said(
    tmp_path, monkeypatch, capsys
):
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
    assert "3 files dated in the future" in capsys.readouterr().err

    def no_locks(descriptor, operation):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.flock", no_locks)
    begin_run(tmp_path)
    message = f"{tmp_path}/.lock: No locks available; see yourself that no other run starts\n"
    assert capsys.readouterr().err == message


def test_too_little_memory_is_a_memory_error_and_one_line(tmp_path):
    with (
        pytest.raises(MemoryError, match=r"can't allocate memory: you tried to allocate \d+ bytes"),
        memory_errors(),
    ):
        torch.empty(2**56, dtype=torch.uint8)
    with pytest.raises(RuntimeError, match="shape") as caught, memory_errors():
        torch.zeros(3).reshape(2)
    assert not isinstance(caught.value, MemoryError)
    run = run_job(tmp_path, "bytes(2**60)")
    assert run.returncode == 1
    (line,) = run.stderr.splitlines()
    assert line.startswith("error: out of memory (no more is to be had); ")
    assert "--cores" in line
    assert "MemoryError" in (tmp_path / "job.log").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("target", ["all", "runs", "labels"])
def test_every_job_has_an_output_that_the_target_asks_for(target, tmp_path):
    """Else Snakemake takes old results for those of a changed configuration after a failed job."""
    plan = smoke(tmp_path, target, "--dry-run", "--quiet", "host").stdout
    jobs = JOB.findall(plan)
    (asked,) = (set(inputs.split(", ")) for rule, inputs, _ in jobs if rule == target)
    made = [(rule, set(outputs.split(", "))) for rule, _, outputs in jobs if outputs]
    assert {"scene", "plan", "sfm", "rgbd", "posegraph", "chain"} <= {rule for rule, _ in made}
    # What is made of the output of these is asked for.
    temporary = {"render_packed", "render_varied", "features", "views"}
    assert [rule for rule, outputs in made if rule not in temporary and not outputs & asked] == []
