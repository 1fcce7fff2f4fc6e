"""``synfeal collect`` that is stopped, killed, or runs out of disk, and goes on."""

import os
import signal
import subprocess
import sys
import time

import pytest

from synfeal.dataset import render_pool
from synfeal.effects import scene
from synfeal.records.files import unfinished_prefix
from synfeal.records.lock import only_command
from synfeal.render import open_renderer
from tests.support.collected import collect, command, only_error, save_room, tree_of
from tests.support.small_disk import mounted, remount


class Interrupting:
    """A renderer that is interrupted after some frames, and counts those it rendered."""

    def __init__(self, limit):
        self.limit = limit
        self.count = 0

    def open(self, *arguments):
        return Counted(open_renderer(*arguments), self)

    def frame(self):
        if self.count == self.limit:
            raise KeyboardInterrupt
        self.count += 1


class Counted:
    """A renderer whose colour frames are counted."""

    def __init__(self, real, owner):
        self.real, self.owner = real, owner

    def render(self, world_from_cam):
        self.owner.frame()
        return self.real.render(world_from_cam)

    def render_rgbd(self, world_from_cam):
        self.owner.frame()
        return self.real.render_rgbd(world_from_cam)

    def render_depth(self, world_from_cam):
        return self.real.render_depth(world_from_cam)

    def close(self):
        self.real.close()


def interrupted(mesh, out, limit=13):
    """The unfinished directory of a collection that stopped after some frames."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene, "open_renderer", Interrupting(limit).open)
        assert collect(mesh, out, "--depth") == 130
    return out.with_name(f"{out.name}.part")


def test_ctrl_c_keeps_whole_sequences_and_says_how_to_go_on(mesh, calm, tmp_path, capfd):
    part = interrupted(mesh, tmp_path / "set")
    assert "kept in" in (message := only_error(capfd))
    assert "same command again" in message
    assert [path.name for path in part.glob("seq-*")] == ["seq-01"]
    (part / ".seq-02-abcd1234").mkdir()  # of a command that was killed
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        pass
    unfinished = unfinished_prefix("manifest").replace(f"-{os.getpid()}-", f"-{ended.pid}-")
    (part / f"{unfinished}12345678.json").write_text("half a mani")
    renderer = Interrupting(100)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scene, "open_renderer", renderer.open)
        assert collect(mesh, tmp_path / "set", "--depth") == 0
    assert renderer.count == 32 - 10
    assert tree_of(tmp_path / "set") == tree_of(calm)
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_collection_survives_being_killed(mesh, calm, tmp_path):
    out, part = tmp_path / "set", tmp_path / "set.part"
    arguments = [sys.executable, "-m", "synfeal.cli", *command(mesh, out, "--depth")]
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while run.poll() is None and not list(part.glob("*seq-*")):
            time.sleep(0.005)
        run.kill()
    assert collect(mesh, out, "--depth") == 0 or run.returncode == 0
    (out / ".work" / "scene").mkdir(parents=True)  # as when killed after the last rename
    assert collect(mesh, out, "--depth") == 0
    assert tree_of(out) == tree_of(calm)
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_worker_that_is_killed_is_one_line(mesh, tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(render_pool, "_start_worker", suicide)
    assert collect(mesh, tmp_path / "set", "--cores", "2") == 1
    assert "fewer --cores" in only_error(capfd)
    assert (tmp_path / "set.part" / "train.csv").is_file()


def suicide(*_):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture
def small_disk(tmp_path):
    with mounted(tmp_path / "disk", "240k") as disk:
        yield disk


@pytest.mark.parametrize("more", [(), ("--cores", "2")], ids=["alone", "processes"])
def test_a_full_disk_is_one_line_and_the_collection_goes_on_when_there_is_room(
    mesh, calm, small_disk, capfd, more
):
    out = small_disk / "set"
    assert collect(mesh, out, "--depth", *more) == 1
    assert "No space left" in (message := only_error(capfd))
    assert "same command again" in message
    assert not out.exists()
    remount(small_disk, "size=50m")
    assert collect(mesh, out, "--depth") == 0
    assert tree_of(out) == tree_of(calm)
    remount(small_disk, "ro")
    capfd.readouterr()
    assert collect(mesh, small_disk / "other") == 1
    assert "Read-only" in (message := only_error(capfd))
    assert "nothing was kept" in message


OTHERS = {
    ("--seed", "1"): "--seed was 0, is 1",
    ("--packed", "16"): "--packed was None, is 16",
    ("--spacing", "0.3"): "--spacing was 0.2, is 0.3",
}


def test_other_settings_and_commands_do_not_go_on_with_it(mesh, tmp_path, capfd):
    part = interrupted(mesh, tmp_path / "set", 2)
    before = sorted(part.rglob("*"))
    other = save_room(tmp_path / "other.glb", seed=1)
    cases = [(mesh, more, words) for more, words in OTHERS.items()]
    for used, more, words in [*cases, (other, [], "sha256` was ")]:
        capfd.readouterr()
        assert collect(used, tmp_path / "set", "--depth", *more) == 1
        assert words in (message := only_error(capfd))
        assert f"delete {part}" in message
    with only_command(part, part / ".work" / "lock"):
        assert collect(mesh, tmp_path / "set", "--depth") == 1
    assert "another run is at work there (process" in only_error(capfd)
    assert sorted(part.rglob("*")) == before


@pytest.mark.parametrize("text", ['{"seed": 0', "[]", '{"synfeal": "0.0"}', None])
def test_a_damaged_record_of_settings_is_named_and_nothing_is_touched(text, mesh, tmp_path, capfd):
    part = tmp_path / "set.part"
    record = part / ".work" / "settings.json"
    (part / ".work" / "scene").mkdir(parents=True)  # prepared, and nothing planned yet
    if text is None:
        record.mkdir()
    else:
        record.write_text(text)
    before = sorted(tmp_path.rglob("*"))
    assert collect(mesh, tmp_path / "set") == 1
    assert f"{record}: " in (message := only_error(capfd))
    assert f"delete {part} to start anew" in message
    assert sorted(tmp_path.rglob("*")) == before
    assert text is None or record.read_text() == text
