"""Side tables: what each needs, and one of another package from its declaration to the page."""

import dataclasses
import json
import re
import subprocess
import sys

import pytest
import yaml

from reproduction.design import side_tables
from reproduction.design.jobs import jobs_of_run
from reproduction.design.side_tables import (
    NAMES,
    SIDE_TABLES,
    code_of,
    made_side_tables,
    needs_of,
)
from reproduction.tables.side import Table, table_named
from synfeal.errors import InputError
from tests import ROOT
from tests.reproduction.test_design_files import files_of
from tests.support.added_methods import install

ROW = {"table": "table4_size", "scene": "large_room", "size": "6k"}
SFM = {**ROW, "table": "table2_ground_truth", "labels": "sfm"}
ALWAYS = {"table1_meshes", "references", "recall", "speed_vs_error"}
PAGE = (ROOT / "docs/adding.md").read_text()
(EXAMPLE,) = re.findall(r"`my_tables/worst\.py`:\n\n```python\n(.*?)```", PAGE, re.DOTALL)


def test_a_profile_makes_the_tables_that_it_has_files_for():
    assert set(made_side_tables(files_of({**ROW, "scene": "sanctuary"}))) == ALWAYS
    estimated = files_of(ROW, SFM)  # on the data set that effects are tested on
    assert set(made_side_tables(estimated)) == ALWAYS | {
        "robustness",
        "assistance",
        "label_error",
        "label_ranking",
    }
    made = [job["side"] for job in jobs_of_run(estimated)["side_table"]]
    assert made == [name for name in SIDE_TABLES if name in made_side_tables(estimated)]


def test_needs_are_filled_in_every_combination_and_by_table():
    files = files_of(ROW, SFM)
    needs = needs_of(files, "label_error")
    folder = f"{files.root}/labels/large_room/6k"
    for split in ("train", "test"):
        assert f"{folder}/sfm/{split}-unassisted.csv" in needs
        assert f"{folder}/synfeal/{split}.csv" in needs
        assert f"{folder}/synfeal/{split}-unassisted.csv" not in needs
    batches = [need for need in needs if "/estimates/" in need]
    assert len(batches) == 3 + 2  # 60 and 25 frames in batches of up to 21 that share one
    histories = [need for need in needs_of(files, "speed_vs_error") if "/history.csv" in need]
    assert len(histories) == 5  # Table 4 alone
    assert f"{files.root}/tables/label_error.csv" in needs_of(files, "speed_vs_error")
    assert not [n for n in needs_of(files_of(ROW), "speed_vs_error") if "label_error" in n]


@pytest.mark.parametrize("need", ["runs/{rnu}/errors.csv", "scenes/{scene:attic}/mesh.glb"])
def test_a_name_that_there_is_not_is_refused_with_those_there_are(need, monkeypatch):
    wrong = dataclasses.replace(SIDE_TABLES["recall"], needs=(need,))
    monkeypatch.setitem(side_tables.SIDE_TABLES, "recall", wrong)
    name = re.escape(need.partition("{")[2].partition("}")[0])
    with pytest.raises(
        InputError, match=rf"recall:RecallTable: needs: '{name}' is not one of .*run"
    ):
        needs_of(files_of(ROW), "recall")
    assert "run" in NAMES


@pytest.mark.parametrize("name", SIDE_TABLES)
def test_every_declaration_is_of_a_table_that_is_called_so(name):
    table = table_named(name)
    assert isinstance(table, Table)
    assert type(table).kind.name == name
    assert len(code_of(name)) == 16


WORK = """
import sys
from pathlib import Path
from reproduction.design.side_tables import SIDE_TABLES
assert SIDE_TABLES["worst"].title == "Largest errors"
assert not {"my_tables.worst", "pandas", "torch"} & set(sys.modules)
from reproduction.tables.side import read_side_table, write_side_table
from reproduction.report.html.tables import side_html, table_title
from reproduction.report.summary import write_summary
from tests.support.report_results import design_of, experiment
root, row = Path(sys.argv[1]), experiment("table4_size")
design = design_of([row])
for k, run in enumerate(design.runs):
    folder = root / "runs" / run.directory
    folder.mkdir(parents=True)
    (folder / "errors.csv").write_text(f"frame,position_m\\n0,0.5\\n1,{k + 1}.25\\n")
write_side_table("worst", design, {}, root, root / "worst.csv", root / "worst.tex")
rows, layout = read_side_table("worst", root / "worst.csv")
assert sorted(rows.position_m) == [1.25, 2.25, 3.25, 4.25, 5.25]
assert "5.25" in (root / "worst.tex").read_text()
assert table_title("worst") == "Largest errors"
assert "5.25" in side_html(layout)
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    return install(folder, {"worst": EXAMPLE}, package="my_tables", group="synfeal.tables")


def python(environment, code, *arguments):
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True)


def test_the_example_of_the_page_is_written_read_and_shown(environment, tmp_path):
    run = python(environment, WORK, tmp_path)
    assert run.returncode == 0, run.stderr


def test_the_workflow_makes_a_table_of_another_package(environment, tmp_path):
    """Its job reads what the declaration needs, and the record and the page read the table."""
    profile, out = tmp_path / "mine.yaml", tmp_path / "jobs.json"
    profile.write_text(yaml.safe_dump({"experiments": [ROW], "tables": None}))
    command = ["-m", "tests.support.dry_run", str(profile), str(tmp_path / "results"), str(out)]
    run = subprocess.run(
        [sys.executable, *command], env=environment, cwd=ROOT, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr
    jobs = json.loads(out.read_text())
    made = [job for job in jobs if any(name.endswith("/worst.csv") for name in job["output"])]
    assert [job["rule"] for job in made] == ["side_table"]
    assert len(made[0]["input"]) == 5
    assert all(name.endswith("/errors.csv") for name in made[0]["input"])
    table = next(name for name in made[0]["output"] if name.endswith(".csv"))
    readers = {job["rule"] for job in jobs if table in job["input"]}
    assert {"all", "provenance", "report"} <= readers
