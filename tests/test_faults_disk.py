"""A full disk at every kind of file the stages write: said so, nothing left, whole afterwards."""

from __future__ import annotations

import errno
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from matplotlib.figure import Figure

from baselines.groundtruth.posegraph.graph import PoseGraph, write_g2o
from baselines.groundtruth.trajectory import failed_trajectory, read_trajectory, write_trajectory
from baselines.training.checkpoint import save_atomically
from baselines.training.progress import HistoryRow, write_history
from baselines.training.resume import ResumeFile
from synfeal.dataset.packed import join_packed, new_packed, read_packed
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.files import read_json, write_json
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import Triangles, load_collision_mesh, save_collision_mesh
from synfeal.report.figures.write import save
from synfeal.report.latex import write_text
from tests.small_disk import mounted, remount

N = 2000  # rows, vertices or values: more than the disk holds
ROOM_FOR_NOTHING = "12k"


def poses() -> PoseTable:
    index = np.arange(N)
    position_m = np.random.default_rng(0).normal(size=(N, 3))
    return PoseTable(index, index, position_m, np.tile([1.0, 0, 0, 0], (N, 1)))


def sphere() -> Triangles:
    mesh = trimesh.creation.icosphere(4)
    return Triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def write_mesh(path: Path) -> None:
    vertices, faces = sphere()
    colors = np.zeros((len(vertices), 3), np.uint8)
    save_glb(path, TexturedMesh((MeshPart("sphere", vertices, faces, vertex_rgb=colors),)))


def write_graph(path: Path) -> None:
    write_g2o(path, PoseGraph(np.tile(np.eye(4), (N, 1, 1)), ()))


def write_resume(path: Path) -> None:
    ResumeFile(path, "this training").save_if_due({"weights": torch.nn.Linear(N, 4)}, now=True)


def write_rows(path: Path) -> None:
    write_history(path, [HistoryRow(step, 1 / 3, 1e-3) for step in range(N)])


def write_parts(path: Path) -> None:
    part = path.parents[1] / "part.npy"
    with new_packed(part, N, 4) as packed:
        packed[:] = 7
    join_packed([part], path)


def draw(path: Path) -> None:
    figure = Figure()
    figure.subplots().imshow(np.random.default_rng(0).random((N // 10, N // 10)))
    save(figure, path)


WRITERS: dict[str, tuple[Callable[[Path], object], Callable[[Path], object]]] = {
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
def disk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with mounted(tmp_path_factory.mktemp("faults") / "disk", ROOM_FOR_NOTHING) as place:
        yield place


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_is_named_and_nothing_is_left(name: str, disk: Path) -> None:
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


def test_a_job_tells_of_a_full_disk_where_its_log_lies_too(disk: Path) -> None:
    script = (
        "from pathlib import Path\nfrom synfeal.files import write_json\n"
        f"from synfeal.job import job\nwith job({str(disk / 'job.log')!r}):\n"
        f"    write_json(Path({str(disk / 'facts.json')!r}), ['word'] * 9000)\n"
    )
    (disk / "other").write_bytes(bytes(8192))  # the log's first page is the last that is free
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    place = disk / "facts.json"
    assert run.stderr == f"error: {place}: No space left on device; fix that and start again\n"
    assert not place.exists()
    for path in disk.iterdir():
        path.unlink()
