"""However often a collection is interrupted or shared out, its bytes are the same."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchmarks.collect_faults import check_whole, command, save_room, tree_of
from synfeal.cli import main
from synfeal.dataset import collect as collect_module
from synfeal.dataset import render_pieces
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.sequences import sequences_of
from synfeal.dataset.sevenscenes import read_split
from synfeal.dataset.shards import Shard, pieces_of
from synfeal.dataset.unfinished import locked, unfinished_of
from synfeal.render import open_renderer

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")

N_TRAIN, N_TEST = 24, 8
FRAMES = ("--frames", str(N_TRAIN), "--test-frames", str(N_TEST))
SMALL = ("--width", "40", "--height", "32", "--spacing", "0.2", "--depth", "--packed", "24")


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


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("synfeal.dataset.shards.PIECE_FRAMES", 5)


def collect(mesh: Path, out: Path, *more: str) -> int:
    options = ("--mesh", str(mesh), "--out", str(out), *FRAMES, *SMALL, *more)
    return main(["collect", *options])


def only_error(capsys: pytest.CaptureFixture[str]) -> str:
    """The message; where standard error is a file, lines of progress come before it."""
    *before, last = capsys.readouterr().err.strip().splitlines()
    assert not [line for line in before if not line.startswith("shard ")], before
    assert last.startswith("error: ")
    return last


class Interrupting:
    """A renderer that is interrupted after some frames, and counts those it rendered."""

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.count = 0

    def open(self, *arguments: object) -> Interrupting:
        self.real = open_renderer(*arguments)  # type: ignore[arg-type]
        return self

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> object:
        if self.count == self.limit:
            raise KeyboardInterrupt
        self.count += 1
        return self.real.render_rgbd(world_from_cam)

    def __enter__(self) -> Interrupting:
        return self

    def __exit__(self, *_: object) -> None:
        self.real.close()


def interrupt_after(monkeypatch: pytest.MonkeyPatch, limit: int) -> Interrupting:
    renderer = Interrupting(limit)
    monkeypatch.setattr(render_pieces, "open_renderer", renderer.open)
    return renderer


@given(st.integers(1, 300), st.integers(0, 300), st.integers(1, 120), st.integers(1, 9))
def test_shards_hold_every_frame_once(n_train: int, n_test: int, size: int, of: int) -> None:
    sequences = sequences_of(n_train, n_test, size)
    every = [(s.name, number) for s in sequences for number in range(len(s))]
    bounds = [Shard(number, of).bounds(n_train + n_test) for number in range(1, of + 1)]
    pieces = [piece for first, last in bounds for piece in pieces_of(sequences, first, last)]
    found = [(p.sequence.name, number) for p in pieces for number in range(p.start, p.stop)]
    assert found == every
    lengths = [last - first for first, last in bounds]
    assert max(lengths) - min(lengths) <= 1


@pytest.mark.parametrize("order", [("1/2", "2/2"), ("3/3", "1/3")])
def test_shards_make_the_same_bytes(
    mesh: Path, tmp_path: Path, expected: dict[str, str], order: tuple[str, ...]
) -> None:
    out = tmp_path / "set"
    for shard in order:
        assert collect(mesh, out, "--shard", shard) == 0
        assert not out.exists()
    assert collect(mesh, out) == 0
    assert tree_of(out) == expected
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_processes_make_the_same_bytes(
    mesh: Path, tmp_path: Path, expected: dict[str, str]
) -> None:
    assert collect(mesh, tmp_path / "set", "--workers", "2") == 0
    assert tree_of(tmp_path / "set") == expected


def test_unfinished_directories_of_machines_without_a_common_disk_can_be_copied_together(
    mesh: Path, tmp_path: Path, expected: dict[str, str]
) -> None:
    moved = Path(shutil.copy(mesh, tmp_path / "elsewhere.glb"))
    assert collect(mesh, tmp_path / "here" / "set", "--shard", "1/2") == 0
    shutil.copytree(tmp_path / "here", tmp_path / "there")
    assert collect(moved, tmp_path / "there" / "set", "--shard", "2/2") == 0
    for name in ("seq-01", "seq-02"):
        source = tmp_path / "there" / "set.part" / "data" / name
        if source.exists():
            target = tmp_path / "here" / "set.part" / "data" / name
            shutil.copytree(source, target, dirs_exist_ok=True)
    assert collect(mesh, tmp_path / "here" / "set") == 0
    assert tree_of(tmp_path / "here" / "set") == expected


def test_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(
    mesh: Path,
    tmp_path: Path,
    expected: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "set"
    with monkeypatch.context() as patch:
        interrupt_after(patch, 13)
        assert collect(mesh, out) == 130
    message = only_error(capsys)
    assert "kept in" in message
    assert "same command again" in message
    assert not out.exists()
    kept = len(list(tmp_path.rglob("*.color.png")))
    assert 10 <= kept <= 13  # the third piece is given up
    renderer = interrupt_after(monkeypatch, 100)
    assert collect(mesh, out) == 0
    assert renderer.count == N_TRAIN + N_TEST - kept
    assert tree_of(out) == expected


def test_ctrl_c_before_anything_is_planned_keeps_nothing(
    mesh: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(collect_module, "load_mesh", interrupt)
    assert collect(mesh, tmp_path / "set") == 130
    assert "nothing was kept" in only_error(capsys)
    assert list(tmp_path.iterdir()) == []


def interrupted(mesh: Path, out: Path, limit: int = 13) -> Path:
    """The unfinished directory of a collection that stopped after some frames."""
    with pytest.MonkeyPatch.context() as patch:
        interrupt_after(patch, limit)
        assert collect(mesh, out) == 130
    return unfinished_of(out)


def test_damaged_and_temporary_files_are_made_anew(
    mesh: Path, tmp_path: Path, expected: dict[str, str]
) -> None:
    part = interrupted(mesh, tmp_path / "set")
    (part / "data" / "seq-01" / "frame-000002.color.png").write_bytes(b"")
    (part / "data" / "seq-01" / "frame-000003.pose.txt").unlink()
    (part / "data" / ".manifest-12345678.json").write_text("half a mani")
    (part / "tmp-12345678").mkdir()
    (part / "tmp-12345678" / "seq-01-frame-000009.color.png").write_bytes(b"half a frame")
    (tmp_path / "set.part-tmp-1234").mkdir()
    assert collect(mesh, tmp_path / "set") == 0
    assert tree_of(tmp_path / "set") == expected
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--seed", "1"), ["seed was 0, is 1"]),
        (("--width", "48"), ["camera.width was 40, is 48"]),
        (("--packed", "16"), ["packed was 24, is 16"]),
        (("--test-frames", "9"), ["test_frames was 8, is 9"]),
        (("--spacing", "0.3"), ["frame_spacing_m was 0.2, is 0.3"]),
    ],
)
def test_another_job_does_not_go_on_with_it(
    mesh: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    more: tuple[str, ...],
    words: list[str],
) -> None:
    part = interrupted(mesh, tmp_path / "set", 2)
    before = tree_of(part)
    capsys.readouterr()
    assert collect(mesh, tmp_path / "set", *more) == 1
    message = only_error(capsys)
    assert all(word in message for word in [*words, "delete", "set.part"]), message
    assert tree_of(part) == before


def test_another_mesh_does_not_go_on_with_it(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    interrupted(mesh, tmp_path / "set", 2)
    save_room(tmp_path / "other.glb", seed=1)
    capsys.readouterr()
    assert collect(tmp_path / "other.glb", tmp_path / "set") == 1
    assert "mesh_sha256" in only_error(capsys)


def test_frames_of_another_plan_are_found(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = interrupted(mesh, tmp_path / "set")
    foreign = part / "data" / "seq-01" / "frame-000004.pose.txt"
    foreign.write_text(foreign.read_text().replace("e+00", "e+01", 1))
    capsys.readouterr()
    assert collect(mesh, tmp_path / "set") == 1
    assert "frame-000004.pose.txt" in only_error(capsys)
    assert not (tmp_path / "set").exists()


def test_two_commands_do_not_work_on_one_directory(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = interrupted(mesh, tmp_path / "set", 2)
    capsys.readouterr()
    with locked(part, alone=False):
        assert collect(mesh, tmp_path / "set") == 1
        assert "another command" in only_error(capsys)
        assert collect(mesh, tmp_path / "set", "--shard", "2/2") == 0  # shards share
    with locked(part, alone=True):
        assert collect(mesh, tmp_path / "set", "--shard", "1/2") == 1


def test_a_command_killed_after_the_last_step_leaves_only_a_directory_to_remove(
    mesh: Path, tmp_path: Path, expected: dict[str, str]
) -> None:
    part = interrupted(mesh, tmp_path / "set", 2)
    shutil.copytree(part, tmp_path / "kept")
    assert collect(mesh, tmp_path / "set") == 0
    shutil.copytree(tmp_path / "kept", part)
    shutil.rmtree(part / "data")
    assert collect(mesh, tmp_path / "set") == 0
    assert tree_of(tmp_path / "set") == expected
    assert not part.exists()


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "a/b", "-1/3", "1/0", "1/2/3"])
def test_wrong_shards(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    assert collect(mesh, tmp_path / "set", f"--shard={text}") == 1
    assert "--shard" in only_error(capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("more", [("--workers", "0"), ("--packed", "32"), ("--packed", "0")])
def test_numbers_out_of_range(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, str]
) -> None:
    assert collect(mesh, tmp_path / "set", *more) == 1
    assert more[0] in only_error(capsys)
    assert list(tmp_path.iterdir()) == []


def test_progress_is_one_line_per_shard_where_there_is_no_terminal(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert collect(mesh, tmp_path / "set") == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 7  # 24 and 8 frames by 5
    assert lines[1].startswith("shard 2/7: seq-01 frames 5-9, 5 frames in ")
    assert lines[5].startswith("shard 6/7: seq-02 frames 0-4, 5 frames in ")


def test_packed_frames_are_those_of_the_files(mesh: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    assert collect(mesh, out) == 0
    for split, count in (("train", N_TRAIN), ("test", N_TEST)):
        pack_frames(read_split(out, split), 24, tmp_path / "again.npy")
        assert (out / f"{split}.npy").read_bytes() == (tmp_path / "again.npy").read_bytes()
        assert np.load(out / f"{split}.npy").shape == (count, 24, 24, 3)


def kill_at(arguments: list[str], part: Path, n_files: int) -> bool:
    """Start a collection and kill it once so many files of frames are there; whether it was."""
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while run.poll() is None and sum(1 for _ in part.rglob("frame-*")) < n_files:
            time.sleep(0.01)
        run.kill()
    return run.returncode == -signal.SIGKILL


def test_a_collection_survives_being_killed(mesh: Path, tmp_path: Path) -> None:
    """``benchmarks/collect_faults.py`` does this more often."""
    calm, killed = tmp_path / "calm", tmp_path / "killed"
    part = tmp_path / "killed.part" / "data"
    assert main(command(mesh, calm, 160)[3:]) == 0
    assert kill_at(command(mesh, killed, 160), part, 1)
    check_whole(part)
    if kill_at(command(mesh, killed, 160), part, 200):
        check_whole(part)
    if not killed.exists():
        assert main(command(mesh, killed, 160)[3:]) == 0
    assert tree_of(killed) == tree_of(calm)
    assert json.loads((killed / "manifest.json").read_text())["frames"]["train"] == 160
    assert sorted(path.name for path in tmp_path.iterdir()) == ["calm", "killed"]
