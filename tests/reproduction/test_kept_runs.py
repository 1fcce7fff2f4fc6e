"""Finished runs in one file and back: nothing is lost, nothing trained again, nothing mistaken."""

import hashlib
import json
import re
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from baselines.training.record import write_training_record
from baselines.training.score import score_run
from reproduction.config.load import load_config
from reproduction.design.experiments import Run, read_design
from reproduction.design.labels import estimation_parameters
from reproduction.design.references import answered_by, data_sets
from reproduction.design.runs import training_parameters
from reproduction.runs.keep import POSES
from synfeal.cli import main
from synfeal.dataset.pose_table import COLUMNS, write_pose_table
from synfeal.records.files import write_json
from tests import CONFIG
from tests.support.collected import refused
from tests.support.property_support import random_table
from tests.workflow.test_workflow import snakemake

DESIGN = """table,block,scene,size,labels,noise_m,noise_deg,init
table2_ground_truth,,large_room,6k,sfm,0,0,pretrained
table3_inconsistencies,position,large_room,6k,noise,0.1,0,pretrained
table4_size,,large_room,6k,synfeal,0,0,pretrained
table4_size,,large_room,20k,synfeal,0,0,pretrained
"""


def smoke_config(folder):
    """The smoke profile with twenty runs, in a folder."""
    (folder / "design.csv").write_text(DESIGN, encoding="utf-8")
    raw = load_config(CONFIG / "config.yaml", CONFIG / "smoke.yaml")
    return raw.model_copy(update={"results": folder, "experiments": folder / "design.csv"})


def write_records(config):
    """What tables read of scenes, frames and reference methods."""
    root = config.root
    write_json(root / "frames/large_room/train.json", {})
    write_json(root / "frames/large_room/test.json", {})
    facts = ("properties.json", "collection_speed.json", "collision_curve.csv", "render_speed.csv")
    for name in (*facts, "test_depth.npy"):
        write_json(root / "scenes/large_room" / name, {})
    design = read_design(config).rows
    for key in data_sets(design):
        for method in answered_by(design, key, config.references):
            for name in ("metrics.json", "facts.json"):
                write_json(root.joinpath("references", *key, method, name), {})


def table(count):
    """The first poses of one plan, four frames to a path."""
    return random_table(500, 7, 4).first(count)


def write_results(config):
    """What a finished run of the workflow leaves that is kept; and models, which are not."""
    root = config.root
    for size in ("6k", "20k"):
        for split in ("train", "test"):
            count = config.n_frames("large_room", size, split)
            write_pose_table(root / f"labels/large_room/{size}/synfeal/{split}.csv", table(count))
    estimated = root / "labels/large_room/6k/sfm"
    for name in ("train", "test", "train-unassisted", "test-unassisted"):
        write_pose_table(estimated / f"{name}.csv", table(25))
    write_json(estimated / "assistance.json", {"method": "sfm"})
    write_pose_table(root / "labels/large_room/6k/noise-p0.1-r0/test.csv", table(25))
    write_json(estimated / "estimation.json", {"parameters": estimation_parameters(config, "sfm")})
    for split, batches in (("train", 3), ("test", 2)):
        for batch in range(batches):
            stem = root / f"groundtruth/large_room/6k/sfm/{split}/batch-{batch:03d}"
            write_json(stem.with_suffix(".json"), {"frames": 20})
            stem.with_suffix(".csv").write_text("x\n")
    for run in read_design(config).runs:
        folder = root / "runs" / run.directory
        test_labels = root / f"labels/{run.scene}/{run.size}/{run.labels}/test.csv"
        folder.mkdir(parents=True)
        for name in ("predictions.csv", "common_predictions.csv"):
            shutil.copyfile(test_labels, folder / name)
        (folder / "history.csv").write_text("samples_seen\n320\n")
        (folder / "model.pt").write_bytes(b"large")
        record = training_parameters(config, run), {"test_labels": test_labels}
        write_training_record(folder / "training.json", *record)


def contents(root):
    return {
        path.relative_to(root).as_posix(): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and path.suffix != ".zip" and path.name not in (".lock", "restored.json")
    }


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    config = smoke_config(tmp_path_factory.mktemp("made"))
    write_results(config)
    write_records(config)
    assert main(["keep", str(config.root)]) == 0
    return config


@pytest.fixture(scope="module")
def package(made):
    return made.root / "predictions.zip"


def test_everything_but_models_comes_back_byte_for_byte(made, package, tmp_path):
    assert main(["restore", str(package), str(tmp_path / "new")]) == 0
    before = {k: v for k, v in contents(made.root).items() if not k.endswith("model.pt")}
    assert contents(tmp_path / "new") == before
    restored = json.loads((tmp_path / "new/restored.json").read_text())["files"]
    assert sorted(restored) == sorted(before)


def test_the_file_is_a_data_package_that_holds_shared_poses_once(made, package):
    """Checked by the standard's words alone: hashes, sizes, schema; no code of ours reads it."""
    with zipfile.ZipFile(package) as opened:
        descriptor = json.loads(opened.read("datapackage.json"))
        for entry in descriptor["resources"]:
            data = opened.read(entry.get("member", entry["path"]))[: entry["bytes"]]
            assert entry["hash"] == f"sha256:{hashlib.sha256(data).hexdigest()}"
            assert (entry.get("schema") == "schemas/poses.json") == data.startswith(b"frame,path,")
        schema = json.loads(opened.read("schemas/poses.json"))
        names = opened.namelist()
    assert [field["name"] for field in schema["fields"]] == list(COLUMNS)
    assert schema == POSES
    assert "labels/large_room/20k/synfeal/train.csv" in names
    assert "labels/large_room/6k/synfeal/train.csv" not in names  # the 20k set begins with it


def test_a_longer_run_gives_the_same_bytes_for_what_was_there(made, package, tmp_path):
    root = Path(shutil.copytree(made.root, tmp_path / "smoke"))
    main(["keep", str(root), "--out", str(tmp_path / "same.zip")])
    assert (tmp_path / "same.zip").read_bytes() == package.read_bytes()
    with zipfile.ZipFile(package) as opened:
        first = opened.infolist()[0]
        at = package.read_bytes()[: first.header_offset + first.compress_size]
    for kind in ("runs", "labels"):
        there = root / kind / "large_room/6k/synfeal"
        shutil.copytree(there, there.with_name("synfeal2"))  # sorts behind
    main(["keep", str(root), "--out", str(tmp_path / "more.zip")])
    assert (tmp_path / "more.zip").read_bytes().startswith(at)


PREDICTED = "runs/large_room/20k/synfeal/pretrained/posenet/seed0/predictions.csv"
OUTSIDE = b'{"resources": [{"path": "../x", "hash": "sha256:0", "bytes": 1}]}'


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"datapackage.json": None}, "datapackage.json"),
        ({"datapackage.json": b'{"resources": [{"path": "a"}]}'}, "synfeal keep"),
        ({"datapackage.json": OUTSIDE}, "'../x' does not lie"),
        ({PREDICTED: None}, f"{PREDICTED}: is damaged"),
        ({PREDICTED: b"other\n"}, f"{PREDICTED}: differs from its hash"),
        (None, "synfeal keep"),
    ],
)
def test_a_damaged_package_is_refused_in_one_line_and_writes_nothing(
    package, tmp_path, capsys, changes, words
):
    bad = tmp_path / "bad.zip"
    if changes is None:
        bad.write_bytes(package.read_bytes()[:-30])
    else:
        with zipfile.ZipFile(package) as old, zipfile.ZipFile(bad, "w") as new:
            for name in old.namelist():
                data = changes.get(name, old.read(name))
                if data is not None:
                    new.writestr(name, data)
    line = refused(capsys, "restore", bad, tmp_path / "out")
    assert words in line
    assert str(bad) in line
    assert not (tmp_path / "out").exists()


def test_neither_other_results_are_overwritten_nor_other_labels_scored(
    made, package, tmp_path, capsys
):
    other = tmp_path / "out" / PREDICTED
    other.parent.mkdir(parents=True)
    other.write_text("mine\n")
    line = refused(capsys, "restore", package, tmp_path / "out")
    assert f"{other}: exists and differs" in line
    assert [p for p in (tmp_path / "out").rglob("*") if p.is_file()] == [other]
    run = Run("large_room", "6k", "synfeal", "pretrained", "posenet", 0)
    folder = Path(shutil.copytree(made.root / "runs" / run.directory, tmp_path / "run"))
    labels = made.root / "labels/large_room/6k/synfeal"
    outputs = tmp_path / "errors.csv", tmp_path / "metrics.json"
    given = (folder / "predictions.csv", labels / "test.csv", labels / "test.csv")
    score_run(*given, labels / "train.csv", *outputs, {})
    moved = replace(table(25), position_m=table(25).position_m + 1)
    write_pose_table(tmp_path / "other.csv", moved)
    with pytest.raises(Exception, match="not the labels that"):
        score_run(given[0], tmp_path / "other.csv", given[2], labels / "train.csv", *outputs, {})


def planned(config, target, *changes):
    given = [f"results={config.results}", f"experiments={config.experiments}", *changes]
    smoke = ("--dry-run", "--configfile", "config/smoke.yaml")
    return snakemake(*smoke, "--config", *given, "--", target)


def jobs_of(run):
    assert run.returncode == 0, run.stdout + run.stderr
    return {name for name, _ in re.findall(r"^(\w+) +(\d+)$", run.stdout, re.MULTILINE)}


def test_the_workflow_goes_on_from_restored_runs(package, tmp_path):
    config = smoke_config(tmp_path)
    assert main(["restore", str(package), str(config.root)]) == 0
    tables = jobs_of(planned(config, "rescored"))
    assert {"score", "table", "recall", "claims", "summary"} <= tables
    assert not {"scene", "plan", "render_packed", "pack", "train", "sfm", "features"} & tables
    # Labels with errors are made anew, which is no reason to answer anew what was restored.
    assert "erroneous_labels" in tables
    assert not {"image_references", "structure_references", "descriptors"} & tables
    everything = jobs_of(planned(config, "all"))
    assert {"scene", "render", "pack", "score"} <= everything  # all of it is made again ...
    assert not {"train", "sfm", "chain"} & everything  # ... but for what was restored
    changed = planned(config, "all", "training={batch_size: 16}")
    assert changed.returncode == 1
    assert "training.batch_size" in changed.stderr
    assert "Traceback" not in changed.stderr
    shutil.rmtree(config.root / "runs/large_room/20k")
    assert "train" in jobs_of(planned(config, "all"))
    missing = planned(config, "rescored")
    assert missing.returncode == 1
    assert "5 of 20 runs have no predictions" in missing.stderr
