"""Results and profiles of an earlier version: refused in a line, renamed by a command."""

from pathlib import Path

import pandas as pd
import pytest

from reproduction.config.load import parse_config
from reproduction.runs.renamed import refuse_old_names, rename_named, with_present_names
from synfeal.config.load import read_yaml
from synfeal.errors import InputError
from tests import CONFIG

BATCH = "large_room/6k/sfm/train/batch-000.csv"
PRESENT = {
    f"groundtruth/{BATCH}": f"estimates/{BATCH}",
    "datasets/attic/groundtruth/seq-01/frame-000000.color.png": (
        "datasets/attic/estimation/seq-01/frame-000000.color.png"
    ),
    "scenes/attic/detail_groundtruth.glb": "scenes/attic/detail_estimation.glb",
    "scenes/attic/detail_network.glb": "scenes/attic/detail_network.glb",
    "benchmarks/dataset/attic/groundtruth.tsv": "benchmarks/dataset/attic/estimation.tsv",
    "benchmarks/render/attic/groundtruth/seq-01.tsv": (
        "benchmarks/render/attic/estimation/seq-01.tsv"
    ),
    "tables/table2_ground_truth.csv": "tables/table2_ground_truth.csv",
}


def write(root: Path) -> None:
    for name in PRESENT:
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(name)


def test_an_old_run_is_refused_with_the_command_that_renames_it_and_no_file_changes(tmp_path):
    write(tmp_path)
    with pytest.raises(InputError, match=rf"groundtruth: .*reproduction\.runs\.renamed {tmp_path}"):
        refuse_old_names(tmp_path)
    rename_named([str(tmp_path)])
    refuse_old_names(tmp_path)
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.*")}
    assert files == set(PRESENT.values())
    assert {name: (tmp_path / new).read_text() for name, new in PRESENT.items()} == {
        name: name for name in PRESENT
    }


def test_nothing_is_renamed_where_both_names_are_there(tmp_path):
    write(tmp_path)
    (tmp_path / "estimates").mkdir()
    with pytest.raises(InputError, match=r"estimates: is there beside .*groundtruth"):
        rename_named([str(tmp_path)])
    assert all((tmp_path / name).is_file() for name in PRESENT)


@pytest.mark.parametrize("key", ["groundtruth", "groundtruth_camera"])
def test_an_old_key_is_refused_with_its_present_name(key):
    raw = read_yaml(CONFIG / "config.yaml") | {key: {}}
    new = key.replace("groundtruth", "estimation")
    with pytest.raises(InputError, match=f"^my.yaml: {key}: is called {new} now; rename the key"):
        parse_config(raw, "my.yaml")


def test_jobs_of_an_old_run_are_read_by_their_present_names():
    stages = ["render", "detail", "tables", "tables"]
    jobs = ["attic/groundtruth/seq-01", "attic/detail_groundtruth", "robustness", "table4_size"]
    old = pd.DataFrame({"stage": stages, "job": jobs, "cpu_s": [1.0, 2.0, 3.0, 4.0]})
    read = with_present_names(old)
    assert read.stage.tolist() == ["render", "detail", "robustness", "tables"]
    assert read.job.tolist() == [
        "attic/estimation/seq-01",
        "attic/detail_estimation",
        "",
        "table4_size",
    ]
    assert read.cpu_s.tolist() == [1.0, 2.0, 3.0, 4.0]
    # A run that measured effects by themselves keeps the job that lays out their table.
    new = pd.concat([old, pd.DataFrame({"stage": ["robustness"], "job": [""], "cpu_s": [5.0]})])
    assert with_present_names(new).stage.tolist().count("tables") == 2
