"""The benchmark on a mesh of one's own: one file, one command, and no table without rows."""

import os
import re
import subprocess
import sys

import pytest
import yaml

from reproduction.config.load import load_config
from reproduction.config.tables import KEYS
from reproduction.design.experiments import read_design
from reproduction.design.side_tables import SIDE_TABLES
from reproduction.plan.planned import planned_text
from reproduction.report.html import page
from reproduction.report.summary import write_summary
from reproduction.tables import assistance, label_error
from reproduction.tables.columns import side_sheet
from reproduction.tables.sheet import Sheet, sheet_latex, sheet_markdown
from reproduction.tables.speed_vs_error import speeds_of
from synfeal.cli import main
from synfeal.collection.collision import CURVE_HEADER
from synfeal.errors import InputError
from synfeal.records.tables import frame_of
from tests import CONFIG, ROOT
from tests.support.collected import command, save_room
from tests.support.report_page import large_room_design, page_results
from tests.support.report_results import design_of

PAGE = ROOT / "docs/own_mesh.md"
MOST_LINES = 25
LOCALIZERS = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")
OF_LABELS = {"tables/assistance", "tables/label_error"}
# One row of each table; what its runs are called.
ROWS = {
    "table2_ground_truth": ({"labels": "sfm"}, "sfm/pretrained"),
    "table3_inconsistencies": (
        {"block": "both", "labels": "noise", "noise_m": 0.1, "noise_deg": 5},
        "noise-p0.1-r5/pretrained",
    ),
    "table4_size": ({}, "synfeal/pretrained"),
    "table5_from_scratch": ({"init": "scratch"}, "synfeal/scratch"),
    "table6_label_errors": (
        {"labels": "scale", "noise_m": 0.1},
        "scale-p0.1-r0/pretrained",
    ),
    "table7_images_shown": ({"init": "pretrained-half"}, "synfeal/pretrained-half"),
}
assert ROWS.keys() == KEYS.keys()


def shown_file():
    """The file that the page tells people to write."""
    (block,) = re.findall(r"```yaml\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    return block


def own_profile(folder, **changes):
    """Put that file into a folder, with its mesh and its results."""
    profile = yaml.safe_load(shown_file())
    profile["scenes"]["my_room"]["path"] = str(save_room(folder / "my_room.glb"))
    profile |= {"results": str(folder / "results"), **changes}
    return stored(folder / "my_room.yaml", profile)


def stored(path, values):
    path.write_text(yaml.safe_dump(values, sort_keys=False))
    return path


def dry_run(profile, *more):
    """Return what ``synfeal run -n`` says."""
    command = [sys.executable, "-m", "synfeal.cli", "run", "--profile", str(profile)]
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        [*command, "--cores", "2", "--", "--dry-run", *more],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def jobs_of(run):
    """The jobs that a dry run lists."""
    assert run.returncode == 0, run.stdout + run.stderr
    listed, _, total = run.stdout.rstrip().partition("\n\n")
    jobs = listed.splitlines()
    assert total.startswith(f"{len(jobs)} jobs: ")
    assert len(set(jobs)) == len(jobs)
    return set(jobs)


def test_the_file_on_the_page_is_short_and_its_dry_run_lists_the_jobs_of_one_row(tmp_path):
    assert len(shown_file().splitlines()) <= MOST_LINES
    jobs = jobs_of(dry_run(own_profile(tmp_path)))
    trained = {f"train/my_room/small/synfeal/pretrained/{name}/seed0" for name in LOCALIZERS}
    assert {job for job in jobs if job.startswith("train")} == trained
    assert {"scene/my_room", "tables/table4_size", "figures", "report"} <= jobs
    without_rows = (
        OF_LABELS | {"tables/robustness"} | {f"tables/{t}" for t in {*ROWS} - {"table4_size"}}
    )
    assert not jobs & without_rows
    assert not [job for job in jobs if "large_room" in job or "varied" in job or "effects" in job]


@pytest.mark.slow
@pytest.mark.parametrize("table", ROWS)
def test_a_design_of_one_table_plans_that_table_alone(table, tmp_path):
    """Each of the other tables is empty, and those of estimated labels but with Table 2."""
    changes, labels_and_start = ROWS[table]
    row = {"table": table, "scene": "my_room", "size": "small", **changes}
    camera = {"estimation_camera": {"width": 64, "height": 48}}
    jobs = jobs_of(dry_run(own_profile(tmp_path, experiments=[row], tables=None, **camera)))
    assert {job for job in jobs if re.match("tables/table[2-9]", job)} == {f"tables/{table}"}
    assert f"train/my_room/small/{labels_and_start}/posenet2/seed0" in jobs
    estimated = table == "table2_ground_truth"
    assert jobs & OF_LABELS == (OF_LABELS if estimated else set())
    assert "report" in jobs


def test_frames_with_effects_are_tested_on_where_the_file_names_the_data_set(tmp_path):
    asked = {"robustness": {"made": True, "scene": "my_room", "size": "small"}}
    jobs = jobs_of(dry_run(own_profile(tmp_path, **asked)))
    assert "tables/robustness" in jobs
    assert {f"train_varied/{name}" for name in LOCALIZERS} <= jobs


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robustness": {"scene": "my_room"}}, "robustness.size: '6k' is not one of ['small']"),
        ({"robustness": {"scene": "hall"}}, "robustness.scene: 'hall' is not one of"),
        ({"experiments": []}, "experiments: has no rows"),
        (
            {"experiments": [{"table": "table4_size", "scene": "my_room"}]},
            "experiments: row 1: size: missing",
        ),
        (
            {"experiments": [{"table": "table4_size", "scene": "my_room", "size": "large"}]},
            "experiments: row 1: size 'large': allowed: ['small']",
        ),
        (
            {
                "experiments": [
                    {"table": "table4_size", "scene": "my_room", "size": "small"},
                    {
                        "table": "table4_size",
                        "scene": "my_room",
                        "size": "small",
                        "init": "scratch",
                    },
                ]
            },
            "experiments: row 2: table4_size shows each scene, size once, as in experiments: row 1",
        ),
    ],
)
def test_a_wrong_row_or_data_set_is_said_with_its_place(tmp_path, changes, words):
    config = load_config(CONFIG / "config.yaml", own_profile(tmp_path, **changes))
    with pytest.raises(InputError) as refused:
        read_design(config)
    assert words in str(refused.value)


def test_rows_in_the_configuration_are_those_of_a_table_in_a_file(tmp_path):
    row = {"table": "table3_inconsistencies", "scene": "my_room", "size": "small"}
    changes, _ = ROWS["table3_inconsistencies"]
    csv = tmp_path / "design.csv"
    csv.write_text(
        "table,block,scene,size,labels,noise_m,noise_deg,init\n"
        "table3_inconsistencies,both,my_room,small,noise,0.1,5,pretrained\n"
    )
    base = CONFIG / "config.yaml"
    inline = load_config(base, own_profile(tmp_path, experiments=[row | changes]))
    in_file = load_config(base, own_profile(tmp_path, experiments=str(csv)))
    assert read_design(inline) == read_design(in_file)


def profiled(mesh, out, *more):
    """Exit status of ``synfeal profile`` with the options of a small collection."""
    return main(["profile", *command(mesh, out, *more)[1:]])


def test_the_configuration_that_collect_prints_trains(tmp_path, capsys):
    mesh = save_room(tmp_path / "room.glb")
    assert profiled(mesh, tmp_path / "mine") == 0
    printed = tmp_path / "printed.yaml"
    printed.write_text(capsys.readouterr().out)
    jobs = jobs_of(dry_run(printed, "--config", f"results={tmp_path}/results"))
    assert {f"train/scan/all/synfeal/pretrained/{name}/seed0" for name in LOCALIZERS} <= jobs
    assert "report" in jobs
    assert not [job for job in jobs if "large_room" in job]


def test_without_test_frames_the_printed_configuration_says_what_training_needs(tmp_path, capsys):
    mesh = save_room(tmp_path / "room.glb")
    assert profiled(mesh, tmp_path / "mine", "--test-frames", "0") == 0
    text = capsys.readouterr().out
    assert "give --test-frames" in text
    assert "experiments" not in yaml.safe_load(text)


@pytest.mark.parametrize("module", [assistance, label_error])
def test_a_side_table_without_rows_is_a_heading_and_no_lines(module):
    sheet = side_sheet(module.side_layout(frame_of((), module.SCHEMA)))
    check_rowless(sheet)


def test_a_sheet_without_lines_is_a_heading_in_both_languages():
    check_rowless(Sheet("none", "Nothing.", ("Set", "Error"), ()))


def check_rowless(sheet):
    tex = sheet_latex(sheet)
    inner = tex[tex.index("\\midrule") : tex.index("\\bottomrule")]
    assert inner.split() == ["\\midrule"]
    assert tex.count("\\begin{") == tex.count("\\end{")
    table = [line for line in sheet_markdown(sheet).splitlines() if line.startswith("|")]
    assert len(table) == 2  # headings and the line below them


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return page_results(tmp_path_factory.mktemp("page") / "tiny")


@pytest.mark.parametrize("table", KEYS)
def test_the_page_and_the_summary_leave_out_the_table_without_rows(
    table, finished, tmp_path, monkeypatch
):
    monkeypatch.setattr(page, "room_html", lambda scene, *_: f"<p>{scene} in 3D</p>")
    design = design_of(row for row in large_room_design() if row.table != table)
    of_labels = {"assistance", "label_error"} if table != "table2_ground_truth" else set()
    kept = {"table1_meshes", "references", "recall"} | of_labels
    made = [name for name in SIDE_TABLES if name in kept]
    page.write_report(design, finished, tmp_path / "report.html", made)
    html = (tmp_path / "report.html").read_text()
    shown = {
        name
        for name in (*KEYS, "assistance", "label_error", "robustness")
        if f'id="{name}"' in html
    }
    assert shown == {*KEYS} - {table} | of_labels
    assert "robustness.csv is missing" not in html
    assert "Without rows in this run:" in html
    write_summary(design, finished, tmp_path / "summary.md")
    assert len(re.findall(r"^\*\*", (tmp_path / "summary.md").read_text(), re.MULTILINE)) >= 5


def test_jobs_are_listed_stage_by_stage_and_counted():
    text = planned_text(["train/b", "report", "train/a"])
    assert text == "train/a\ntrain/b\nreport\n\n3 jobs: 2 train, 1 report\n"
    assert planned_text(["scene/room"]).endswith("\n1 job: 1 scene\n")
    last = planned_text([f"stage{i:02d}/x" for i in range(40)]).partition("\n\n")[2]
    assert all(re.match(r"\d", line) and len(line) <= 100 for line in last.splitlines())


def test_a_mesh_that_was_not_decimated_has_no_rows_about_decimating(tmp_path):
    """As in the configuration that ``collect`` prints."""
    curve = tmp_path / "scenes/my_room/collision_curve.csv"
    curve.parent.mkdir(parents=True)
    curve.write_text(f"{CURVE_HEADER}\n")
    assert speeds_of("collision", ["my_room"], tmp_path).empty
