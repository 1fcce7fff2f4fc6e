"""``synfeal collect``: what is on disk afterwards, whatever happens on the way."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from synfeal.cli import main
from synfeal.dataset import render_pool
from synfeal.dataset.manifest import verify_manifest
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import frame_paths, read_pose, read_split
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.render import open_renderer
from synfeal.run_lock import only_command
from tests.collected import collect, command, save_room, tree_of
from tests.small_disk import mounted, remount
from tests.test_workflow import snakemake

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_room(tmp_path_factory.mktemp("mesh") / "room.glb")


@pytest.fixture(scope="module")
def calm(mesh: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set nothing happened to."""
    out = tmp_path_factory.mktemp("calm") / "set"
    assert collect(mesh, out, "--depth") == 0
    return out


def only_error(capfd: pytest.CaptureFixture[str]) -> str:
    """The message; before it nothing but lines of progress, and no traceback of any process."""
    *before, last = capfd.readouterr().err.strip().splitlines()
    assert not [line for line in before if not line.startswith("seq-")], before
    assert last.startswith("error: ")
    return last


def test_collect_makes_a_complete_data_set(calm: Path) -> None:
    splits = ["TestSplit.txt", "TrainSplit.txt", "test.csv", "train.csv"]
    about = ["coverage.json", "manifest.json", "preview.png"]
    sequences = [f"seq-{number:02d}" for number in (1, 2, 3, 4)]
    assert sorted(path.name for path in calm.iterdir()) == sorted([*splits, *about, *sequences])
    assert len(list((calm / "seq-01").iterdir())) == 30
    verify_manifest(calm)
    table = read_pose_table(calm / "train.csv")
    header, first, *_ = (calm / "train.csv").read_text().splitlines()
    assert header.endswith(",qz,image")
    assert first.endswith(",seq-01/frame-000000.color.png")
    images = [line.rpartition(",")[2] for line in (calm / "test.csv").read_text().splitlines()[1:]]
    assert images == [f"seq-04/frame-{number:06d}.color.png" for number in range(8)]
    assert main(["evaluate", str(calm), str(calm / "test.csv")]) == 0
    last = read_pose(frame_paths([calm / "seq-03"], "pose.txt")[-1])
    np.testing.assert_allclose(last, table.world_from_cam[-1], atol=1e-9)
    assert not np.array_equal(table.position_m[:5], read_pose_table(calm / "test.csv").position_m)
    with Image.open(calm / "preview.png") as preview:
        assert preview.width > 240
    assert [path.name for path in calm.parent.iterdir()] == ["set"]


@pytest.mark.parametrize("more", [(), ("--workers", "2")], ids=["again", "processes"])
def test_the_same_command_gives_the_same_bytes(
    mesh: Path, calm: Path, tmp_path: Path, more: tuple[str, ...]
) -> None:
    assert collect(mesh, tmp_path / "set", "--depth", *more) == 0
    assert tree_of(tmp_path / "set") == tree_of(calm)


def test_the_workflow_makes_the_same_bytes_from_the_printed_configuration(
    mesh: Path, calm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert collect(mesh, tmp_path / "set", "--depth", "--print-config") == 0
    profile = tmp_path / "mine.yaml"
    profile.write_text(capsys.readouterr().out)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.yaml"]
    results = ("--config", f"results={tmp_path}/results")
    run = snakemake("--configfile", str(profile), *results, "--", "datasets")
    assert run.returncode == 0, run.stderr
    found = tree_of(tmp_path / "results" / "set" / "datasets" / "scan" / "network")
    found = {name: value for name, value in found.items() if not name.endswith("_timestamp")}
    assert found == tree_of(calm)


def test_packed_frames_are_those_of_the_files_and_another_seed_gives_others(
    mesh: Path, calm: Path, tmp_path: Path
) -> None:
    assert collect(mesh, tmp_path / "set", "--packed", "24", "--seed", "1") == 0
    pack_frames(read_split(tmp_path / "set", "train"), 24, tmp_path / "again.npy")
    assert (tmp_path / "set" / "train.npy").read_bytes() == (tmp_path / "again.npy").read_bytes()
    assert np.load(tmp_path / "set" / "test.npy").shape == (8, 24, 24, 3)
    assert tree_of(tmp_path / "set")["train.csv"] != tree_of(calm)["train.csv"]


def test_boxes_and_angles_confine_the_camera(mesh: Path, tmp_path: Path) -> None:
    boxes = ["--box", "-2.5", "-0.5", "-2", "0", "-0.5", "0.5", "--box=1 2 -1e0 1 -.5 5e-1"]
    angles = ["--roll", "-1", "1", "--pitch", "-5", "10", "--yaw", "170", "190"]
    more = ["--min-path", "0.3", "--min-view-distance", "0.5"]
    assert collect(mesh, tmp_path / "set", *boxes, *angles, *more, "--frames", "90") == 0
    table = read_pose_table(tmp_path / "set" / "train.csv")
    first = within(table.position_m, [-2.5, -2, -0.5], [-0.5, 0, 0.5])
    second = within(table.position_m, [1, -1, -0.5], [2, 1, 0.5])
    assert (first | second).all()
    assert first.mean() == pytest.approx(2 / 3, abs=0.1)  # 4 and 2 m³
    assert not np.isin(table.path[first], table.path[second]).any()
    forward = table.world_from_cam[:, :3, 2]
    assert (forward[:, 0] < -0.9).all()
    down = np.rad2deg(np.arcsin(-forward[:, 2]))
    assert down.min() >= -5 - 1e-9
    assert down.max() <= 10 + 1e-9
    level = rotation_from_rpy([0.0, 0.0, 0.0])
    assert level[:, 2].tolist() == [1.0, 0.0, 0.0]  # the convention that yaw is measured in


def within(points: NDArray[np.float64], low: list[float], high: list[float]) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = ((points >= low) & (points <= high)).all(axis=1)
    return inside


@pytest.mark.parametrize("backend", ["opengl", "raycast"])
def test_the_background_has_the_colour_asked_for(mesh: Path, tmp_path: Path, backend: str) -> None:
    (tmp_path / "away.txt").write_text("0 0 0 9 1 0 0 0\n" * 24)  # above the room, looking down
    repeat = ["--mode", "repeat", "--poses", str(tmp_path / "away.txt"), "--test-frames", "0"]
    look = ["--background", "10", "200", "30", "--supersampling", "1", "--backend", backend]
    assert collect(mesh, tmp_path / "set", *repeat, *look) == 0
    with Image.open(tmp_path / "set" / "seq-01" / "frame-000000.color.png") as frame:
        assert frame.getpixel((0, 0)) == (10, 200, 30)
        assert frame.getpixel((20, 16)) != (10, 200, 30)


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


def interrupted(mesh: Path, out: Path, limit: int = 13) -> Path:
    """The unfinished directory of a collection that stopped after some frames."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render_pool, "open_renderer", Interrupting(limit).open)
        assert collect(mesh, out, "--depth") == 130
    return out.with_name(f"{out.name}.part")


def test_ctrl_c_keeps_whole_sequences_and_says_how_to_go_on(
    mesh: Path, calm: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    part = interrupted(mesh, tmp_path / "set")
    assert "kept in" in (message := only_error(capfd))
    assert "same command again" in message
    assert [path.name for path in part.glob("seq-*")] == ["seq-01"]
    (part / ".seq-02-abcd1234").mkdir()  # of a command that was killed
    (part / ".manifest-12345678.json").write_text("half a mani")
    renderer = Interrupting(100)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render_pool, "open_renderer", renderer.open)
        assert collect(mesh, tmp_path / "set", "--depth") == 0
    assert renderer.count == 32 - 10
    assert tree_of(tmp_path / "set") == tree_of(calm)
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_a_collection_survives_being_killed(mesh: Path, calm: Path, tmp_path: Path) -> None:
    out, part = tmp_path / "set", tmp_path / "set.part"
    arguments = [sys.executable, "-m", "synfeal.cli", *command(mesh, out, "--depth")]
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while run.poll() is None and not list(part.glob("*seq-*")):
            time.sleep(0.005)
        run.kill()
    assert collect(mesh, out, "--depth") == 0 or run.returncode == 0
    assert tree_of(out) == tree_of(calm)
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_killed_after_the_last_rename_there_is_only_a_directory_to_remove(
    mesh: Path, calm: Path, tmp_path: Path
) -> None:
    assert collect(mesh, tmp_path / "set", "--depth") == 0
    (tmp_path / "set" / ".work" / "scene").mkdir(parents=True)
    assert collect(mesh, tmp_path / "set", "--depth") == 0
    assert tree_of(tmp_path / "set") == tree_of(calm)


def test_a_worker_that_is_killed_is_one_line(
    mesh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(render_pool, "_start_worker", suicide)
    assert collect(mesh, tmp_path / "set", "--workers", "2") == 1
    assert "fewer --workers" in only_error(capfd)
    assert (tmp_path / "set.part" / "train.csv").is_file()


def suicide(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    with mounted(tmp_path / "disk", "240k") as disk:
        yield disk


@pytest.mark.parametrize("more", [(), ("--workers", "2")], ids=["alone", "processes"])
def test_a_full_disk_is_one_line_and_the_collection_goes_on_when_there_is_room(
    mesh: Path,
    calm: Path,
    small_disk: Path,
    capfd: pytest.CaptureFixture[str],
    more: tuple[str, ...],
) -> None:
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
    "seed": (["--seed", "1"], "--seed was 0, is 1"),
    "width": (["--width", "48"], "--width was 40, is 48"),
    "packed": (["--packed", "16"], "packed_px was None, is 16"),
    "test frames": (["--test-frames", "9"], "--test-frames was 8, is 9"),
    "spacing": (["--spacing", "0.3"], "--spacing was 0.2, is 0.3"),
}


def test_other_settings_and_commands_do_not_go_on_with_it(
    mesh: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    part = interrupted(mesh, tmp_path / "set", 2)
    before = sorted(part.rglob("*"))
    other = save_room(tmp_path / "other.glb", seed=1)
    refused = [(mesh, more, words) for more, words in OTHERS.values()]
    for used, more, words in [*refused, (other, [], "sha256 was ")]:
        capfd.readouterr()
        assert collect(used, tmp_path / "set", "--depth", *more) == 1
        assert words in (message := only_error(capfd))
        assert f"delete {part}" in message
    with only_command(part, part / ".work" / "lock"):
        assert collect(mesh, tmp_path / "set", "--depth") == 1
    assert "another run is at work there (process" in only_error(capfd)
    assert sorted(part.rglob("*")) == before


FOREIGN: dict[str, str | None] = {
    "cut": '{"seed": 0',
    "a list": "[]",
    "of another version": '{"synfeal": "0.0"}',
    "a directory": None,
}


@pytest.mark.parametrize("case", FOREIGN)
def test_a_damaged_record_of_settings_is_named_and_nothing_is_touched(
    case: str, mesh: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    part = tmp_path / "set.part"
    record = part / ".work" / "settings.json"
    (part / ".work" / "scene").mkdir(parents=True)  # prepared, and nothing planned yet
    (part / ".work" / "lock").touch()
    if (text := FOREIGN[case]) is None:
        record.mkdir()
    else:
        record.write_text(text)
    before = sorted(tmp_path.rglob("*"))
    assert collect(mesh, tmp_path / "set") == 1
    assert f"{record}: " in (message := only_error(capfd))
    assert f"delete {part} to start anew" in message
    assert sorted(tmp_path.rglob("*")) == before
    assert text is None or record.read_text() == text


def test_print_config_and_manifest_say_the_same(calm: Path) -> None:
    manifest = json.loads((calm / "manifest.json").read_text())
    assert manifest["frames"] == {"train": 24, "test": 8}
    assert manifest["scene"]["name"] == "scan"
    assert manifest["render"]["backend"] != "auto"
    assert "path" not in manifest["scene"]


# Options beside those of a small collection, and what the one line has to say.
REFUSED = {
    "no frames": (["--frames", "0"], "--frames: "),
    "negative frames": (["--frames", "-3"], "--frames: "),
    "endless frames": (["--frames", "99999999999"], "--frames: "),
    "negative test frames": (["--test-frames", "-1"], "--test-frames: "),
    "narrow": (["--width", "2"], "--width: "),
    "no unit": (["--unit-m", "0"], "--unit-m: "),
    "no spacing": (["--spacing", "nan"], "--spacing: "),
    "endless spacing": (["--spacing", "1e-9"], "--spacing: "),
    "flat lens": (["--fov", "180"], "--fov: "),
    "box": (["--box", "1", "0", "0", "1", "0", "1"], "--box: x: "),
    "second box": (["--box=0 1 0 1 0 1", "--box=0 1 2 1 0 1"], "--box: "),
    "far box": (["--box", "90", "91", "0", "1", "0", "1"], "--unit-m"),
    "small scene": (["--unit-m", "1e-5"], "--unit-m"),
    "seed": (["--seed", "-1"], "--seed: "),
    "roll": (["--roll", "5", "-5"], "--roll: the first number must be below"),
    "pitch": (["--pitch", "-90", "0"], "--pitch: must lie within -90 and 90"),
    "colour": (["--background", "0", "256", "0"], "--background: "),
    "samples": (["--supersampling", "9"], "--supersampling: "),
    "workers": (["--workers", "0"], "--workers: "),
    "packed": (["--packed", "33"], "--packed: "),
    "no poses": (["--mode", "repeat"], "--poses: "),
    "long paths": (["--min-path", "1e6"], "--min-path"),
    "the root": (["--out", "/"], "--out: / is a whole file system"),
    "a file": (["--out", "notes.txt"], "notes.txt: exists"),
    "below a file": (["--out", "notes.txt/set"], "notes.txt"),
    "a circle": (["--out", "loop/set"], "loop"),
    "a long name": (["--out", "x" * 300], "--out: "),
    "no mesh": (["--mesh", "none.glb"], "--mesh: none.glb does not exist"),
    "a directory": (["--mesh", "."], "--mesh: . is a directory"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_person_can_mend_is_one_line_and_nothing_is_written(
    case: str,
    mesh: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "loop").symlink_to("loop")
    options, words = REFUSED[case]
    assert collect(mesh, tmp_path / "set", *options) == 1
    assert words in only_error(capfd)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["loop", "notes.txt"]
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("options", [["collect"], ["collect", "--frames", "many"], ["paint"], []])
def test_wrong_usage_exits_with_2(options: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(options)
    assert caught.value.code == 2
