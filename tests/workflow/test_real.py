"""The workflow from a scan to photographs, on photographs of a stand-in room and on real ones."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation

from reproduction.real.config import parse_real_config
from reproduction.real.design import design_of
from reproduction.real.findings import real_findings, real_table
from reproduction.real.stand_in import CAMERA, SEQUENCE_FROM_ROOM, write_stand_in
from reproduction.tables.real import read_real
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.sevenscenes import pose_text
from synfeal.geometry.poses import inverse, pose_matrix, quat_wxyz_of

ROOT = Path(__file__).parents[2]


def snakemake(*arguments, **settings):
    """Run the workflow with settings in place of those of ``config/real.yaml``."""
    given = [f"{key}={value}" for key, value in settings.items()]
    command = [sys.executable, "-m", "snakemake", "--snakefile", "workflow/real/Snakefile"]
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    return subprocess.run(
        [*command, "--cores", "2", *arguments, *(["--config", *given] if given else [])],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)},
    )


@pytest.fixture
def sequence(tmp_path):
    """Files that a dry run looks for; no image is opened."""
    folder = tmp_path / "photographs"
    folder.mkdir()
    for number in range(200):
        stem = folder / f"frame-{number:06d}"
        Path(f"{stem}.color.png").touch()
        Path(f"{stem}.depth.png").touch()
        Path(f"{stem}.pose.txt").write_text(pose_text(np.eye(4)))
    return folder


def planned(tmp_path, **settings):
    run = snakemake("--dry-run", results=tmp_path / "results", **settings)
    assert run.returncode == 0, run.stdout + run.stderr
    return {name: int(n) for name, n in re.findall(r"^(\w+) +(\d+)$", run.stdout, re.MULTILINE)}


def test_every_row_of_the_design_is_trained_and_localized(sequence, tmp_path):
    jobs = planned(tmp_path, sequence=sequence, curve_photographs="[50,100]")
    # Forward 4 rows x 5 localizers x 3 seeds, the two others 2 x 3 each; figure: three numbers of
    # frames, 50 photographs and a scan of them, all 100 of them scanned.
    assert jobs["train"] == jobs["localize"] == 60 + 2 * 6 + 3 + 3
    assert (jobs["scan"], jobs["scan_fewer"], jobs["collect"]) == (3, 2, 5)
    assert jobs["map"] == jobs["localize_in_map"] == 4
    assert jobs["localize_refined"] == 1
    assert jobs["references"] == jobs["cover"] == jobs["picture"] == 3


def test_labels_by_sfm_are_a_row_of_their_own(sequence, tmp_path):
    labels = tmp_path / "labels.txt"
    labels.touch()
    jobs = planned(tmp_path, sequence=sequence, sfm_labels=labels, curve_photographs="[50]")
    assert (jobs["scan"], jobs["scan_fewer"]) == (4, 1)
    assert jobs["train"] == 60 + 2 * 6 + 3 + 3 + 2


def test_tables_of_what_is_there_ask_for_nothing_else(sequence, tmp_path):
    there = tmp_path / "reverse" / "runs" / "randomised" / "posenet2" / "seed1"
    there.mkdir(parents=True)
    (there / "poses.csv").touch()
    settings = {"sequence": sequence, "results": tmp_path, "only_there": True}
    design = design_of(parse_real_config(settings))
    assert [run.directory for run in design.every_run] == ["reverse/runs/randomised/posenet2/seed1"]
    assert [part.name for part in design.parts] == ["reverse"]
    assert (design.maps, design.fewer) == ((), ())


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "sequence: missing; say where the photographs are"),
        ({"sequence": "nowhere"}, "nowhere: is not a folder"),
        ({"sequence": "tests", "imges": 3}, "config/real.yaml: imges"),
        ({"sequence": "tests"}, "tests: holds no frame-000000.color.png"),
    ],
)
def test_what_cannot_be_planned_is_told_in_one_line(settings, message, tmp_path):
    run = snakemake("--dry-run", results=tmp_path, **settings)
    assert run.returncode != 0
    (line,) = [line for line in run.stderr.splitlines() if line.startswith("error: ")]
    assert message in line


TRIED = {"trained_on": ["photographs", "randomised"], "localizers": ["posenet2"]}
TOY = {
    "scene": "stand_in",
    "frames": 40,
    "images": 128,
    "map_frames": 40,
    "seeds": 2,
    "block_frames": 10,
    "width": 96,
    "height": 72,
    "directions": {
        "forward": {**TRIED, "maps": ["rendered", "refined", "photographs"]},
        "reverse": None,
        "alternate": None,
    },
    "labels": {"trained_on": ["randomised"], "localizers": ["posenet2"], "maps": []},
    "curve_frames": [20],
    "curve_photographs": [],
    "depth_from_color": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
}


def write_sfm_labels(photographs, file):
    """The same poses in a world of their own, a millimetre off, as such files hold them."""
    frames = read_posed_sequence(photographs)
    turn = Rotation.from_euler("xyz", [20, -40, 70], degrees=True).as_matrix()
    own_from_given = pose_matrix(turn, [5.0, -3.0, 1.0])
    rng = np.random.default_rng(1)
    lines = []
    for name, pose in zip(frames.names, frames.world_from_cam, strict=True):
        moved = own_from_given @ pose
        moved[:3, 3] += rng.normal(0, 0.001, 3)
        cam_from_world = inverse(moved)
        cells = [*quat_wxyz_of(cam_from_world), *cam_from_world[:3, 3], 525.0]
        lines.append(f"seq-01/{name}.color.png {' '.join(f'{cell:.9f}' for cell in cells)}\n")
    file.write_text("".join(lines))


def named_poses(photographs):
    frames = read_posed_sequence(photographs)
    return zip(frames.names, frames.world_from_cam, strict=True)


def median_error_m(poses, truth, localized=False):
    """Measure a file of poses by its columns alone."""
    table = pd.read_csv(poses)
    if localized:
        table = table[table.status == "localized"]
    names = ["/".join(Path(image).parts[-2:]).removesuffix(".color.png") for image in table.image]
    places = np.array([truth[name][:3, 3] for name in names])
    return np.median(np.linalg.norm(table[["tx", "ty", "tz"]].to_numpy() - places, axis=1))


@pytest.mark.slow
def test_the_whole_chain_ends_in_a_table_figures_and_sentences(tmp_path):
    photographs, root = tmp_path / "photographs", tmp_path / "real"
    write_stand_in(photographs, frames=100, width=96, spacing_m=0.3)
    write_sfm_labels(photographs, tmp_path / "sfm.txt")
    camera = photographs / CAMERA
    down = " ".join(f"{-value:.6f}" for value in SEQUENCE_FROM_ROOM[:3, 2])
    settings = TOY | {
        "sequence": str(photographs),
        "results": str(root),
        "sfm_labels": [str(tmp_path / "sfm.txt")],
        "cameras": f"--color-camera {camera}",
        "map_cameras": f"--depth-camera {camera}",
        "scan": f"--voxel 0.04 --keep-calibration --gravity {down}",
        "collect": "--margin 0.05",
    }
    (tmp_path / "toy.yaml").write_text(yaml.safe_dump(settings))
    run = snakemake("--configfile", str(tmp_path / "toy.yaml"))
    assert run.returncode == 0, run.stdout + run.stderr
    table = read_real(root / "tables" / "table8_real.csv")
    assert set(zip(table.labels, table.trained_on, table.method, strict=True)) == {
        *(("given", row, "posenet2") for row in ("photographs", "randomised")),
        *(("given", of, "structure") for of in ("photographs", "rendered")),
        ("given", "rendered", "structure-refined"),
        ("sfm", "randomised", "posenet2"),
        *((labels, "rendered", name) for labels in ("given", "sfm") for name in NEAREST),
        *((labels, "photographs", "mean") for labels in ("given", "sfm")),
    }
    rows = table[table.labels == "given"].set_index(["trained_on", "method"])
    # An oracle that copies a rendered pose beats the mean pose.
    assert rows.position_m["rendered", "nearest"] < rows.position_m["photographs", "mean"]
    # What a line says, from the poses that the command wrote.
    tested = {f"seq-01/{name}": pose for name, pose in named_poses(photographs)}
    folder = root / "forward" / "runs" / "randomised" / "posenet2"
    medians = [median_error_m(folder / f"seed{seed}" / "poses.csv", tested) for seed in (0, 1)]
    assert rows.position_m["randomised", "posenet2"] == pytest.approx(np.mean(medians), rel=1e-4)
    assert rows.position_m_worst["randomised", "posenet2"] == pytest.approx(max(medians), rel=1e-4)
    runs = pd.read_csv(root / "tables" / "real_runs.csv")
    keys = "direction == 'forward' and labels == 'given' and trained_on == 'randomised'"
    of_posenet2 = runs.query(f"{keys} and method == 'posenet2'")
    assert list(of_posenet2.position_m) == pytest.approx(medians, rel=1e-4)
    # What is found by features is found well, in the world of the photographs, which leans.
    for of in ("photographs", "rendered", "refined"):
        poses = root / "forward" / "maps" / of / "poses.csv"
        assert median_error_m(poses, tested, localized=True) < 0.15
    # Both labels are the same poses but for a millimetre and the world.
    difference = json.loads((root / "forward" / "label_difference.json").read_text())
    assert difference["position_m_max"] < 0.01
    np.testing.assert_allclose(table.position_m_sfm, table.position_m, atol=0.005)
    amount = pd.read_csv(root / "tables" / "real_amount.csv")
    assert set(amount[amount.kind == "frames"].amount) == {20, 40}
    shares = pd.read_csv(root / "forward" / "cover.csv").covered
    assert len(shares) == 50
    assert shares.between(0, 1).all()
    assert shares.mean() > 0.5
    for name in ("real_amount.png", "real_cover.svg"):
        assert (root / "figures" / name).stat().st_size > 1000
    assert "when trained only on renderings of the scan" in real_findings(root)
    assert "labels by SfM" in real_table(root)
    again = snakemake("--dry-run", "--configfile", str(tmp_path / "toy.yaml"))
    assert "Nothing to be done" in again.stdout + again.stderr


NEAREST = ("retrieval", "nearest")
REAL = os.environ.get("SYNFEAL_TEST_SEQUENCE")


@pytest.mark.slow
@pytest.mark.skipif(not REAL, reason="SYNFEAL_TEST_SEQUENCE names no sequence of photographs")
def test_real_photographs_are_split_and_planned(tmp_path):
    """The part of the chain that takes seconds; the rest is `make real`."""
    out = tmp_path / "real"
    run = snakemake(f"{out}/forward/truth_given.csv", sequence=REAL, results=out)
    assert run.returncode == 0, run.stdout + run.stderr
    frames = read_posed_sequence(Path(REAL))
    scanned = read_posed_sequence(out / "forward" / "train")
    tested = read_posed_sequence(out / "forward" / "test")
    assert len(scanned) + len(tested) == len(frames)
    np.testing.assert_allclose(
        np.concatenate([scanned.world_from_cam, tested.world_from_cam]),
        frames.world_from_cam,
        atol=1e-9,
    )
