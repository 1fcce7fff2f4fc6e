"""``synfeal collect``, and the same from Python: what is on disk afterwards."""

import copy
import json
import re
import subprocess
import sys

import cv2
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

import synfeal
from synfeal.cli import main
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sequence_listing import list_sequences
from synfeal.dataset.sevenscenes import frame_paths, read_pose, read_split
from synfeal.errors import InputError
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.validation.manifest import check_manifest
from tests import ROOT
from tests.support.collected import collect, command, refused, tree_of
from tests.workflow.test_workflow import snakemake


def test_collect_makes_a_complete_data_set(calm):
    splits = ["TestSplit.txt", "TrainSplit.txt", "test.csv", "train.csv"]
    about = ["coverage.json", "manifest.json", "preview.png"]
    sequences = [f"seq-{number:02d}" for number in (1, 2, 3, 4)]
    assert sorted(path.name for path in calm.iterdir()) == sorted([*splits, *about, *sequences])
    assert len(list((calm / "seq-01").iterdir())) == 30
    assert not check_manifest(calm, list_sequences(calm), {}, int).failures
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


@pytest.mark.parametrize("more", [(), ("--cores", "2")], ids=["again", "processes"])
def test_the_same_command_gives_the_same_bytes(mesh, calm, tmp_path, more):
    assert collect(mesh, tmp_path / "set", "--depth", *more) == 0
    assert tree_of(tmp_path / "set") == tree_of(calm)


@pytest.mark.slow
def test_the_workflow_makes_the_same_bytes_from_the_printed_configuration(
    mesh, calm, tmp_path, capsys
):
    _, *asked = command(mesh, tmp_path / "set", "--depth")
    assert main(["profile", *asked]) == 0
    profile = tmp_path / "mine.yaml"
    profile.write_text(capsys.readouterr().out)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.yaml"]
    results = ("--config", f"results={tmp_path}/results")
    run = snakemake("--configfile", str(profile), *results, "--", "datasets")
    assert run.returncode == 0, run.stderr
    found = tree_of(tmp_path / "results" / "set" / "datasets" / "scan" / "network")
    found = {name: value for name, value in found.items() if not name.endswith("_timestamp")}
    assert found == tree_of(calm)


def test_packed_frames_are_those_of_the_files_and_another_seed_gives_others(mesh, calm, tmp_path):
    assert collect(mesh, tmp_path / "set", "--packed", "24", "--seed", "1") == 0
    pack_frames(read_split(tmp_path / "set", "train"), 24, tmp_path / "again.npy")
    assert (tmp_path / "set" / "train.npy").read_bytes() == (tmp_path / "again.npy").read_bytes()
    assert np.load(tmp_path / "set" / "test.npy").shape == (8, 24, 24, 3)
    assert tree_of(tmp_path / "set")["train.csv"] != tree_of(calm)["train.csv"]


def test_boxes_and_angles_confine_the_camera(mesh, tmp_path):
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


def within(points, low, high):
    return ((points >= low) & (points <= high)).all(axis=1)


@pytest.mark.parametrize("backend", ["opengl", "raycast"])
def test_the_background_has_the_colour_asked_for(mesh, tmp_path, backend):
    (tmp_path / "away.txt").write_text("0 0 0 9 1 0 0 0\n" * 24)  # above the room, looking down
    repeat = ["--mode", "repeat", "--poses", str(tmp_path / "away.txt"), "--test-frames", "0"]
    look = ["--background", "10", "200", "30", "--supersampling", "1", "--backend", backend]
    assert collect(mesh, tmp_path / "set", *repeat, *look) == 0
    with Image.open(tmp_path / "set" / "seq-01" / "frame-000000.color.png") as frame:
        assert frame.getpixel((0, 0)) == (10, 200, 30)
        assert frame.getpixel((20, 16)) != (10, 200, 30)
    manifest = json.loads((tmp_path / "set" / "manifest.json").read_text())
    assert manifest["graphics"]["backend"] == manifest["render"]["backend"] == backend
    assert {"embreex", "moderngl"} <= manifest["versions"].keys()
    assert ("gl_renderer" in manifest["graphics"]) == (backend == "opengl")
    assert all(manifest["graphics"].values())


def test_print_config_and_manifest_say_the_same(calm):
    manifest = json.loads((calm / "manifest.json").read_text())
    assert manifest["frames"] == {"train": 24, "test": 8}
    assert manifest["scene"]["name"] == "scan"
    assert manifest["render"]["backend"] != "auto"
    assert "path" not in manifest["scene"]


@pytest.mark.parametrize("options", [["collect"], ["collect", "--frames", "many"], ["paint"], []])
def test_wrong_usage_exits_with_2(options):
    with pytest.raises(SystemExit) as caught:
        main(options)
    assert caught.value.code == 2


def test_a_preview_shows_two_sets_side_by_side(damaged, tmp_path, monkeypatch, capsys):
    preview = ["preview", str(damaged), str(damaged), "--frames", "9"]
    assert main(preview) == 0
    with Image.open(damaged / "preview.gif") as picture:
        assert (picture.n_frames, picture.width) == (9, 640)
    film = tmp_path / "film.mp4"
    assert main([*preview, "--out", str(film)]) == 0
    assert main([*preview, "--out", str(film)]) == 1  # it is not overwritten
    assert f"{film}: exists" in capsys.readouterr().err
    decoder = cv2.VideoCapture(str(film))
    shown = [decoder.read()[1] for _ in range(9)]
    assert not decoder.read()[0]
    with Image.open(damaged / "seq-01" / "frame-000004.color.png") as frame:
        ideal = np.asarray(frame.convert("RGB").resize((320, 240), Image.Resampling.LANCZOS))
    assert shown[4].shape == (16 + 240, 640, 3)
    off = shown[4][16:, :320, ::-1].astype(int) - ideal
    assert np.abs(off).mean() < 4  # grey levels, of coding
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    line = refused(capsys, "preview", damaged, "--out", tmp_path / "other.mp4")
    assert "apt-get install ffmpeg or pip install 'synfeal[video]'" in line
    assert [path.name for path in tmp_path.glob("*.mp4")] == ["film.mp4"]


def texts(notebook):
    """Return the output of each cell of code: printed, or its value."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    said = [[o.get("text") or o.data.get("text/plain", "") for o in c.outputs] for c in cells]
    return ["".join(parts).split(" at 0x")[0] for parts in said]


def test_the_quick_start_runs(tmp_path):
    shown = nbformat.read(ROOT / "docs" / "quickstart.ipynb", as_version=4)
    ran = copy.deepcopy(shown)
    place = {"metadata": {"path": tmp_path}}
    NotebookClient(ran, timeout=600, startup_timeout=600, resources=place).execute()
    for notebook in (shown, ran):  # what stands in the file, and what comes of it now
        _, seen, made, scored = texts(notebook)
        assert "(120, 160, 3) nearest surface at" in seen
        assert "40 training frames, 10 test frames, camera 160\nwrong with it: nothing" in made
        assert re.search(r"position_m +0\.080", scored)
    assert synfeal.open_dataset(tmp_path / "mydata").train.poses.position_m.shape == (40, 3)


def test_the_functions_make_what_the_command_makes(mesh, calm, tmp_path):
    options = {"width": 40, "height": 33, "spacing_m": 0.2, "sequence_frames": 10, "depth": True}
    data = synfeal.collect(mesh, tmp_path / "called", 24, test_frames=8, **options)
    assert tree_of(data.path) == tree_of(calm)
    assert data.test.images[0] == data.path / "seq-04" / "frame-000000.color.png"
    with pytest.raises(InputError, match=r"^spacing_m: "):
        synfeal.plan(mesh, 10, spacing_m=-1)
    with pytest.raises(InputError, match=r"^color: no such option"):
        synfeal.plan(mesh, 10, color="red")


def loaded_by(code, among):
    """Return those of some modules that a fresh interpreter has loaded after some code."""
    code = f"{code}\nimport sys; print(*sorted({among!r} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return run.stdout.strip()


def test_nothing_is_loaded_early_and_collecting_needs_no_networks():
    assert not loaded_by("import synfeal", {"numpy", "pydantic", "scipy", "torch", "trimesh"})
    names = ("api", "inspection.run", "validation.run", "exporting.run", "evaluation.run")
    code = "\n".join(f"import synfeal.{name}" for name in names)
    assert not loaded_by(code, {"baselines", "cv2", "gtsam", "open3d", "snakemake", "torch"})
