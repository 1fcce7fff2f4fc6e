"""Publishing a run: small, whole and of one run; the pages have their numbers from it."""

import errno
import hashlib
import json
import os
import pkgutil
import re
import shutil
import subprocess
from pathlib import Path

import pandas as pd
import pytest

from reproduction.report import pages
from reproduction.report.pages import PAGES, PARTS, main, part_of, rewritten
from reproduction.report.publish import FINISHED, publish
from reproduction.report.publish import main as publish_main
from reproduction.report.published import headline
from reproduction.runs.published import PUBLISHED
from synfeal.errors import InputError
from tests.support.report_results import change_cell

REPOSITORY = Path(__file__).parents[2]
MINI = REPOSITORY / "results/published/mini"
NIGHT = REPOSITORY / "results/published/night"
SINGLE_RUNS = REPOSITORY / "results/published/single_runs"
DIFFICULTY = "results/benchmarks/scene_difficulty"


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A copy of the published results of mini; the working directory is the top of the copy."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(MINI, tmp_path / PUBLISHED / "mini")
    for name in ("single_runs", "replications"):
        archives = shutil.ignore_patterns("10?")
        shutil.copytree(MINI.with_name(name), tmp_path / PUBLISHED / name, ignore=archives)
    shutil.copytree(REPOSITORY / "results/benchmarks/scene_difficulty", tmp_path / DIFFICULTY)
    return tmp_path / PUBLISHED / "mini"


def test_the_pages_show_the_published_results(monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    assert main(["--check"]) == 0


def test_the_readme_tells_networks_of_the_papers_size_as_they_were_measured():
    measured = pd.read_csv(REPOSITORY / "results/benchmarks/gpu_errors.csv")
    large = measured[measured.input_px == 224].set_index("localizer").position_m
    night = pd.read_csv(NIGHT / "tables/references.csv").query(
        "scene == 'large_room' and size == '6k' and labels == 'synfeal'"
    )
    small = night.set_index("method").position_m_true
    told = re.search(
        r"off by (\d+) and (\d+) cm in the Large Room; the small ones, after 30,000 images, by"
        r" (\d+) and (\d+) cm, and matched features by ([\d.]+) ",
        (REPOSITORY / "README.md").read_text(),
    )
    networks = ("posenet", "posenet2")
    expected = [large[name] for name in networks] + [small[name] for name in networks]
    assert [int(number) for number in told.groups()[:4]] == [round(100 * m) for m in expected]
    assert float(told.group(5)) == round(100 * small["structure-rays"], 1)


def test_objections_are_met_with_numbers_of_the_tables():
    page = (REPOSITORY / "docs/objections.md").read_text()
    draws = pd.read_csv(SINGLE_RUNS / "label_draws.csv").set_index("run").columns_lower
    assert draws["night"] == draws["better_labels"]
    counts = "in {} of 10 columns of one single run, in {} of 10 of two others"
    assert counts.format(draws["labels"], draws["night"]) in page
    cells = pd.read_csv(NIGHT / "tables/table2_ground_truth.csv")
    sfm, exact = (cells[cells.labels == n].set_index("model") for n in ("sfm", "synfeal"))
    errors = ["position_m_true", "orientation_deg_true"]
    assert (exact[errors] < sfm[errors]).to_numpy().sum() == draws["night"]

    passes = pd.read_csv(REPOSITORY / "results/benchmarks/passes.csv")
    posenet = passes[passes.localizer == "PoseNet"].pivot_table(
        index="passes", columns="labels", values="orientation_deg"
    )
    harm = (posenet["noisy"] / posenet["exact"] - 1) * 100
    told = "by +{:.0f} % after 5 passes, +{:.0f} % after 20 and +{:.0f} % after 60"
    assert told.format(*harm.loc[[5, 20, 60]]) in page

    large = pd.read_csv(REPOSITORY / "results/benchmarks/gpu_errors.csv").query("input_px == 224")
    metres = large.set_index("localizer").position_m
    told = "PoseNet is at {:.2f} m, PoseNet2 at {:.2f} m, PoseLSTM, shown half as many images, at"
    assert (
        told.format(metres["posenet"], metres["posenet2"]) + f" {metres['poselstm']:.2f} m" in page
    )


def test_what_pages_name_is_there():
    page = (REPOSITORY / "docs/architecture.md").read_text()
    ways = page.split("## Five ways")[1].split("\n## ")[0]
    names = re.findall(r"`((?:synfeal|baselines|reproduction)\.[\w.]+)`", ways)
    assert len(names) > 20
    for name in names:
        assert callable(pkgutil.resolve_name(name)), name
    page = (REPOSITORY / "docs/README.md").read_text()
    paths = re.findall(r"`([\w.]+/[\w./]+)`", page)
    assert len(paths) > 15
    assert [path for path in paths if not (REPOSITORY / path).exists()] == []


TABLES, SCENES = "published/mini/tables", "benchmarks/scene_difficulty"


@pytest.mark.parametrize(
    ("part", "file", "column", "value", "shown"),
    [
        ("table2", f"{TABLES}/table2_ground_truth", "orientation_deg", "99.87", "99.9°"),
        ("table4", f"{TABLES}/table4_size", "position_rms_m", "4.567", "4.57 m"),
        ("table4", f"{TABLES}/table4_size", "published_position_m", "6.54", "*(6.54, "),
        ("table4", f"{TABLES}/table4_size", "position_rms_m", "", "| failed *("),
        ("table5", f"{TABLES}/table5_from_scratch", "orientation_deg", "99.87", "99.9°"),
        ("table3", f"{TABLES}/table3_inconsistencies", "published_position_m", "6.54", "*(6.54, "),
        ("meshes", f"{TABLES}/table1_meshes", "vertices", "7654321", "| 7,654,321 *("),
        ("label_quality", "published/replications/label_errors", "position_m", "0.999", "99.9 cm"),
        (
            "verdicts",
            "published/replications/claims",
            "verdict",
            "holds by construction",
            "**holds by construction / ",
        ),
        ("difficulty", f"{SCENES}/large_room-sift", "covered_share_mean", "0.99", "| 99 % ("),
        ("difficulty", f"{SCENES}/large_room-repetition", "far_share", "0.777", "77.7 %"),
    ],
)
def test_changing_a_result_changes_the_text(root, part, file, column, value, shown):
    assert shown not in PARTS[part](root)
    change_cell(root.parent.parent / f"{file}.csv", column, value)
    assert shown in PARTS[part](root)


def test_parts_are_replaced_and_nothing_else():
    text = "a\n<!-- x mini -->\nold\n<!-- /x -->\nb <!-- y -->\n<!-- x night -->\n<!-- /x -->\n"
    once = rewritten(text, lambda name, profile: f"\\1 {name} of {profile}")
    assert once == (
        "a\n<!-- x mini -->\n\n\\1 x of mini\n\n<!-- /x -->\nb <!-- y -->\n"
        "<!-- x night -->\n\n\\1 x of night\n\n<!-- /x -->\n"
    )
    assert rewritten(once, lambda name, profile: f"\\1 {name} of {profile}") == once


def test_a_part_without_an_end_is_refused():
    with pytest.raises(InputError, match="has no end"):
        rewritten("<!-- x mini -->\nold\n", lambda *_: "")


def test_the_headline_is_of_the_largest_profile_published(root):
    assert headline().name == "mini"
    shutil.copytree(root, root.with_name("night"))
    change_cell(root.with_name("night") / "tables/table4_size.csv", "position_rms_m", "4.42")
    assert headline().name == "night"
    assert "4.42 m" in part_of("table4", "headline")
    assert "4.42 m" not in part_of("table4", "mini")


def test_unknown_parts_and_unpublished_results_are_input_errors(root):
    of_the_profile = {"origin", "meshes", "table2", "table3", "table4", "table5"}
    of_photographs = {name for name in PARTS if name.startswith(("real", "photographs"))}
    for name in of_the_profile | of_photographs:
        with pytest.raises(InputError, match="results/published/paper"):
            part_of(name, "paper")
    shutil.rmtree(root.with_name("replications"))
    for name in ("reproduced", "verdicts", "label_quality", "found"):
        with pytest.raises(InputError, match="results/published/replications"):
            part_of(name, "mini")
    with pytest.raises(InputError, match="<!-- sizes mini -->: no such part"):
        part_of("sizes", "mini")


def test_a_run_without_the_tables_of_its_findings_leaves_those_of_the_claims(root):
    told = part_of("found", "mini")
    assert told.startswith("1. Noise in all labels")
    assert "matched image features" not in told


def test_check_writes_nothing_and_publishing_writes_all(root, capsys):
    shutil.copytree(NIGHT, root.with_name("night"))  # it has what the figure is drawn from
    for page in PAGES:
        page.parent.mkdir(exist_ok=True)
        page.write_text("<!-- table4 headline --><!-- /table4 -->\n")
    assert main(["--check"]) == 1
    assert str(PAGES[0]) in capsys.readouterr().out
    assert PAGES[0].read_text() == "<!-- table4 headline --><!-- /table4 -->\n"
    assert not pages.FIGURE.exists()
    assert main([]) == 0
    assert "Large Room 6k" in PAGES[0].read_text()
    assert main(["--check"]) == 0
    references = root.with_name("night") / "tables/references.csv"
    rows = pd.read_csv(references)
    rows["position_m_true"] /= 2
    rows.to_csv(references, index=False)
    assert main(["--check"]) == 1  # the figure alone


REPOSITORY = Path(__file__).parents[2]
LIMIT_MB = 4.0


@pytest.fixture
def finished(tmp_path, monkeypatch):
    """A finished run in ``results/mini``, and pages that show one of its two figures."""
    monkeypatch.chdir(tmp_path)
    run = tmp_path / "results/mini"
    texts = {
        "tables/table1_meshes.csv": "scene\n",
        "tables/table1_meshes.tex": "\\begin{table}\n",
        "figures/shown.png": "png",
        "figures/unseen.png": "png",
        "runs/model.pt": "weights",
        "report.html": "<html>",
        **dict.fromkeys(FINISHED, "text\n"),
    }
    recorded = {
        name: hashlib.sha256(text.encode()).hexdigest()
        for name, text in texts.items()
        if name.startswith(("tables", "figures"))
    }
    texts["provenance.json"] = json.dumps({"files": recorded})
    for name, text in texts.items():
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        (run / name).write_text(text)
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text("![x](results/published/mini/figures/shown.png)\n")
    (tmp_path / "docs/a.md").write_text("[x](../results/published/other/figures/other.png)\n")
    return run


def files_below(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


def test_a_run_is_published_without_what_no_page_shows_and_so_is_one_of_labels_alone(finished):
    target = finished.parent / "published/mini"
    (target / "tables").mkdir(parents=True)
    (target / "tables/of_an_older_design.csv").write_text("old")
    assert publish_main(["--profile", "mini"]) == 0
    tables = {f"tables/table1_meshes.{end}" for end in ("csv", "tex")}
    assert files_below(target) == tables | {"figures/shown.png"} | set(FINISHED)
    assert all((target / name).read_bytes() == (finished / name).read_bytes() for name in tables)
    for name in FINISHED:
        (finished / name).unlink()
    assert publish_main([]) == 0
    assert "figures/shown.png" in files_below(finished.parent / "published/mini")


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("claims.csv", None, "claims.csv: missing; finish the run"),
        ("figures/shown.png", None, r"shown.png: missing, and README.md shows it"),
        ("tables/table1_meshes.csv", "another run's", "is not the file of .*provenance.json"),
    ],
)
def test_what_does_not_belong_together_is_not_published(finished, name, text, said):
    if text is None:
        (finished / name).unlink()
    else:
        (finished / name).write_text(text)
    target = Path("results/published/mini")
    target.mkdir(parents=True)
    (target / "kept.txt").touch()
    with pytest.raises(InputError, match=said):
        publish(Path("results/mini"), target, [Path("README.md")])
    assert files_below(target) == {"kept.txt"}


def test_an_interrupted_publication_leaves_what_was_published(finished, monkeypatch):
    target = Path("results/published/mini")
    target.mkdir(parents=True)
    (target / "kept.txt").touch()

    def full_disk(source, copy):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(copy))

    with monkeypatch.context() as patch:
        patch.setattr("shutil.copyfile", full_disk)
        with pytest.raises(OSError, match="No space left"):
            publish(Path("results/mini"), target, [Path("README.md")])
    assert files_below(target.parent) == {"mini/kept.txt"}
    publish(Path("results/mini"), target, [Path("README.md")])
    assert "claims.csv" in files_below(target)
    assert "kept.txt" not in files_below(target)
    assert [path.name for path in target.parent.iterdir()] == ["mini"]


def test_tracked_results_are_small_and_of_their_provenance():
    listed = subprocess.run(
        ["git", "ls-files", "-z", "results"], cwd=REPOSITORY, capture_output=True, check=True
    )
    paths = [REPOSITORY / name for name in listed.stdout.decode().split("\0") if name]
    assert {p.relative_to(REPOSITORY).parts[1] for p in paths} == {"published", "benchmarks"}
    assert sum(p.stat().st_size for p in paths) <= LIMIT_MB * 1e6


# Made later, from what was published of the run (docs/rules.md).
LATER = {NIGHT / "tables/shape_changes.csv"}


@pytest.mark.parametrize("profile", ["mini", "night"])
def test_published_results_are_those_of_a_recorded_run(profile):
    finished = REPOSITORY / "results/published" / profile
    record = json.loads((finished / "provenance.json").read_text())
    assert len(record["commit"]) >= 40
    assert record["stages"]
    paths = {*(finished / "tables").glob("*.csv"), *(finished / "figures").glob("*")} - LATER
    paths |= {p for p in (finished / "claims.csv", finished / "summary.md") if p.is_file()}
    assert len(paths) > 8
    for path in paths:
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        assert record["files"][path.relative_to(finished).as_posix()] == sha256
