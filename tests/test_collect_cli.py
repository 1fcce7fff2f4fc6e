"""The command line as a person uses it: exit status, messages, and what is on disk afterwards."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from synfeal.cli import main
from synfeal.dataset.manifest import verify_manifest
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import frame_paths, read_pose
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    box = trimesh.creation.box((6.0, 5.0, 3.0))
    colors = np.random.default_rng(0).integers(0, 256, (8, 3), np.uint8)
    part = MeshPart("room", np.asarray(box.vertices), np.asarray(box.faces), vertex_rgb=colors)
    path = tmp_path_factory.mktemp("mesh") / "room.glb"
    save_glb(path, TexturedMesh((part,)))
    return path


def arguments(mesh: Path, out: Path, *more: str) -> list[str]:
    small = ["--width", "32", "--height", "24", "--spacing", "0.2"]
    return ["collect", "--mesh", str(mesh), "--out", str(out), *small, *more]


def only_error(capsys: pytest.CaptureFixture[str]) -> str:
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("error: ")
    return lines[0]


def test_collect_makes_a_complete_data_set(mesh: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"
    assert main(arguments(mesh, out, "--frames", "12", "--test-frames", "5", "--depth")) == 0
    names = sorted(path.name for path in out.iterdir())
    assert names == [
        "TestSplit.txt",
        "TrainSplit.txt",
        "coverage.json",
        "manifest.json",
        "preview.png",
        "seq-01",
        "seq-02",
        "test.csv",
        "train.csv",
    ]
    assert len(list((out / "seq-01").iterdir())) == 36
    verify_manifest(out)
    table = read_pose_table(out / "train.csv")
    last = read_pose(frame_paths([out / "seq-01"], "pose.txt")[-1])
    np.testing.assert_allclose(last, table.world_from_cam[-1], atol=1e-9)
    assert not np.array_equal(table.position_m[:5], read_pose_table(out / "test.csv").position_m)
    with Image.open(out / "preview.png") as preview:
        assert preview.width > 240
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_the_same_seed_gives_the_same_bytes(mesh: Path, tmp_path: Path) -> None:
    for name, seed in (("a", "3"), ("b", "3"), ("c", "4")):
        assert main(arguments(mesh, tmp_path / name, "--frames", "4", "--seed", seed)) == 0
    hashes = [
        json.loads((tmp_path / name / "manifest.json").read_text())["sequences"][0]["sha256"]
        for name in "abc"
    ]
    assert hashes[0] == hashes[1] != hashes[2]


def test_box_confines_the_camera(mesh: Path, tmp_path: Path) -> None:
    box = ["--box", "-1", "1", "-2", "0", "-0.5", "0.5", "--min-path", "0.5"]
    assert main(arguments(mesh, tmp_path / "set", "--frames", "30", *box)) == 0
    positions = read_pose_table(tmp_path / "set" / "train.csv").position_m
    assert (positions >= [-1, -2, -0.5]).all()
    assert (positions <= [1, 0, 0.5]).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--frames", "0"], ["--frames", "at least 1"]),
        (["--frames", "-3"], ["--frames"]),
        (["--frames", "3", "--test-frames", "-1"], ["--test-frames"]),
        (["--frames", "3", "--width", "2"], ["width", "16"]),
        (["--frames", "3", "--unit-m", "0"], ["unit_m"]),
        (["--frames", "3", "--spacing", "nan"], ["frame_spacing_m"]),
        (["--frames", "3", "--fov", "180"], ["horizontal_fov_deg"]),
        (["--frames", "3", "--box", "1", "0", "0", "1", "0", "1"], ["sampling_box", "x"]),
        (["--frames", "3", "--unit-m", "0.001"], ["near_m", "unit-m"]),
        (["--frames", "3", "--box", "90", "91", "0", "1", "0", "1"], ["outside", "unit_m"]),
    ],
)
def test_what_a_person_can_mend_is_one_line(
    mesh: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    options: list[str],
    words: list[str],
) -> None:
    assert main(arguments(mesh, tmp_path / "set", *options)) == 1
    message = only_error(capsys)
    assert all(word in message for word in words), message
    assert list(tmp_path.iterdir()) == []


def test_missing_mesh(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments(tmp_path / "none.glb", tmp_path / "set", "--frames", "2")) == 1
    assert "none.glb" in only_error(capsys)


def test_existing_output_is_refused_and_kept(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert main(arguments(mesh, tmp_path, "--frames", "2")) == 1
    assert "not empty" in only_error(capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("options", [["collect"], ["collect", "--frames", "many"], ["paint"], []])
def test_wrong_usage_exits_with_2(options: list[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(options)
    assert caught.value.code == 2
