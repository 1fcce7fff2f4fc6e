"""What goes wrong around a collection ends in one line, and it goes on once the cause is gone."""

from __future__ import annotations

import errno
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.collect_faults import check_whole, save_room, tree_of
from synfeal.cli import main
from synfeal.config.models import CameraConfig
from synfeal.dataset.frame_writer import FrameWriter
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.render_sequence import render_packed, render_sequence
from synfeal.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")

SMALL = ("--width", "80", "--height", "64", "--spacing", "0.2", "--packed", "48")


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mesh") / "room.glb"
    save_room(path)
    return path


@pytest.fixture(scope="module")
def expected(mesh: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    out = tmp_path_factory.mktemp("calm") / "set"
    assert collect(mesh, out) == 0
    return tree_of(out)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own; its size and mode can be changed with :func:`remount`."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=240k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("only root may mount a small disk")
    yield disk
    subprocess.run(["umount", "--lazy", str(disk)], check=True)


def remount(disk: Path, option: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{option}", str(disk)], check=True)


def collect(mesh: Path, out: Path, *more: str) -> int:
    frames = ("--frames", "40", "--test-frames", "10")
    return main(["collect", "--mesh", str(mesh), "--out", str(out), *frames, *SMALL, *more])


def small_camera() -> CameraConfig:
    return CameraConfig.model_validate({"width": 80, "height": 64})


def only_error(capfd: pytest.CaptureFixture[str]) -> str:
    """The message, before it nothing but progress: no traceback of any process."""
    *before, last = capfd.readouterr().err.strip().splitlines()
    assert not [line for line in before if not line.startswith("shard ")], before
    assert last.startswith("error: ")
    return last


def test_a_full_disk_is_one_line_and_the_collection_goes_on_when_there_is_room(
    mesh: Path, small_disk: Path, expected: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    out = small_disk / "set"
    assert collect(mesh, out) == 1
    message = only_error(capfd)
    assert "No space left" in message
    assert "same command again" in message
    assert not out.exists()
    assert check_whole(small_disk / "set.part" / "data") > 3
    remount(small_disk, "size=50m")
    assert collect(mesh, out) == 0
    assert tree_of(out) == expected
    assert [path.name for path in small_disk.iterdir()] == ["set"]


def test_a_full_disk_ends_all_processes(
    mesh: Path, small_disk: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("synfeal.dataset.shards.PIECE_FRAMES", 10)
    assert collect(mesh, small_disk / "set", "--workers", "2") == 1
    assert "No space left" in only_error(capfd)
    assert not (small_disk / "set").exists()
    check_whole(small_disk / "set.part" / "data")


def test_a_directory_that_became_read_only(
    mesh: Path, small_disk: Path, expected: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    remount(small_disk, "size=50m")
    assert collect(mesh, small_disk / "set", "--shard", "1/2") == 0
    remount(small_disk, "ro")
    capfd.readouterr()
    assert collect(mesh, small_disk / "set") == 1
    assert "Read-only" in only_error(capfd)
    remount(small_disk, "rw")
    assert collect(mesh, small_disk / "set") == 0
    assert tree_of(small_disk / "set") == expected


def test_a_read_only_place_is_refused(
    mesh: Path, small_disk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    remount(small_disk, "ro")
    assert collect(mesh, small_disk / "set") == 1
    message = only_error(capfd)
    assert "Read-only" in message
    assert "nothing was kept" in message


def test_a_mesh_that_vanished_between_plan_and_shard(
    mesh: Path, tmp_path: Path, expected: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    copy, out = tmp_path / "copy.glb", tmp_path / "set"
    copy.write_bytes(mesh.read_bytes())
    assert collect(copy, out, "--shard", "1/3") == 0
    copy.unlink()
    capfd.readouterr()
    assert collect(copy, out, "--shard", "2/3") == 1
    assert "copy.glb" in only_error(capfd)
    assert not out.exists()
    assert collect(mesh, out) == 0
    found = tree_of(out)
    assert found == expected


@contextmanager
def writes_that_fail(after: int) -> Iterator[None]:
    """Every file from one on meets a full disk, half-written."""
    place: Callable[[FrameWriter, Path, bytes], None] = FrameWriter._place
    calls = iter(range(10**9))

    def failing(writer: FrameWriter, path: Path, data: bytes) -> None:
        if next(calls) >= after:
            (writer._scratch / path.name).write_bytes(data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        place(writer, path, data)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FrameWriter, "_place", failing)
        yield


@pytest.mark.parametrize("after", [0, 7, 60])
def test_errors_of_writing_threads_come_out(
    mesh: Path,
    tmp_path: Path,
    expected: dict[str, str],
    capfd: pytest.CaptureFixture[str],
    after: int,
) -> None:
    out = tmp_path / "set"
    with writes_that_fail(after):
        assert collect(mesh, out) == 1
    assert "No space left" in only_error(capfd)
    assert len([p for p in tmp_path.rglob("frame-*") if p.is_file()]) == after
    assert collect(mesh, out) == 0
    assert tree_of(out) == expected


def test_a_sequence_of_the_workflow_is_whole_or_absent(
    mesh: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert collect(mesh, tmp_path / "set") == 0
    plan, camera = read_pose_table(tmp_path / "set" / "train.csv"), small_camera()
    place = tmp_path / "workflow"
    place.mkdir()
    with writes_that_fail(20), pytest.raises(InputError, match="No space left"):
        render_sequence(mesh, camera, plan, place / "seq-01", True)
    assert list(place.iterdir()) == []


def test_a_full_disk_does_not_kill_the_process_that_packs(
    mesh: Path, tmp_path: Path, small_disk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Pages of a sparse file that find no room end a process with a signal, not an exception."""
    assert collect(mesh, tmp_path / "set") == 0
    plan, camera = read_pose_table(tmp_path / "set" / "train.csv"), small_camera()
    with pytest.raises(InputError, match="No space left"):
        render_packed(mesh, camera, plan, 48, small_disk / "train.npy")
    with pytest.raises(OSError, match="No space left"):
        pack_frames([tmp_path / "set" / "seq-01"], 48, small_disk / "train.npy")
    assert list(small_disk.iterdir()) == []
