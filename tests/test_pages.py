"""The pages: their numbers are those of the tracked result files."""

import importlib
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from synfeal.errors import InputError
from synfeal.report import pages
from synfeal.report.findings import HERE, PAPER, effects, mean_factor, sentences
from synfeal.report.findings_figure import is_drawn_from, write_findings_figure
from synfeal.report.pages import PAGES, PARTS, headline, main, part_of, rewritten
from synfeal.report.publish import PUBLISHED
from tests.report_results import change_cell

REPOSITORY = Path(__file__).parent.parent
MINI = REPOSITORY / "results/published/mini"
DIFFICULTY = "results/benchmarks/scene_difficulty"


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A copy of the published results of mini; the working directory is the top of the copy."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(MINI, tmp_path / PUBLISHED / "mini")
    shutil.copytree(REPOSITORY / "results/benchmarks/scene_difficulty", tmp_path / DIFFICULTY)
    return tmp_path / PUBLISHED / "mini"


def test_the_pages_show_the_published_results(monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    assert main(["--check"]) == 0


def test_what_pages_name_is_there():
    page = (REPOSITORY / "docs/architecture.md").read_text()
    ways = page.split("## Four ways")[1].split("\n## ")[0]
    names = re.findall(r"`((?:synfeal|baselines)\.[\w.]+)`", ways)
    assert len(names) > 20
    for name in names:
        module, _, function = name.rpartition(".")
        assert callable(getattr(importlib.import_module(module), function)), name
    page = (REPOSITORY / "docs/README.md").read_text()
    paths = re.findall(r"`([\w.]+/[\w./]+)`", page)
    assert len(paths) > 15
    assert [path for path in paths if not (REPOSITORY / path).exists()] == []


TABLES, SCENES = "published/mini/tables", "benchmarks/scene_difficulty"


@pytest.mark.parametrize(
    ("part", "file", "column", "value", "shown"),
    [
        ("size", f"{TABLES}/table4_size", "position_m_true", "7.654", "4.42 m"),  # over sqrt(3)
        ("size", f"{TABLES}/table4_size", "published_position_m", "6.54", "*(6.54, "),
        ("labels", f"{TABLES}/table2_ground_truth", "orientation_deg_true", "99.87", "99.9°"),
        ("difficulty", f"{SCENES}/large_room-sift", "covered_share_mean", "0.99", "| 99 % ("),
        ("difficulty", f"{SCENES}/large_room-repetition", "far_share", "0.777", "77.7 %"),
    ],
)
def test_changing_a_result_changes_the_text(root, part, file, column, value, shown):
    before = PARTS[part](root)
    assert shown not in before
    change_cell(root.parent.parent / f"{file}.csv", column, value)
    assert shown in PARTS[part](root)


def test_a_failed_cell_says_so(root):
    change_cell(root / "tables/table4_size.csv", "position_m_true", "")
    assert "| failed *(" in PARTS["size"](root)


def test_parts_are_replaced_and_nothing_else():
    text = "a\n<!-- x mini -->\nold\n<!-- /x -->\nb <!-- y -->\n<!-- x night -->\n<!-- /x -->\n"
    once = rewritten(text, lambda name, profile: f"\\1 {name} of {profile}")
    assert once == (
        "a\n<!-- x mini -->\n\n\\1 x of mini\n\n<!-- /x -->\nb <!-- y -->\n"
        "<!-- x night -->\n\n\\1 x of night\n\n<!-- /x -->\n"
    )
    assert rewritten(once, lambda name, profile: f"\\1 {name} of {profile}") == once


def test_the_headline_is_of_the_largest_profile_published(root):
    assert headline() == "mini"
    shutil.copytree(root, root.with_name("night"))
    change_cell(root.with_name("night") / "tables/table4_size.csv", "position_m_true", "7.654")
    assert headline() == "night"
    assert "4.42 m" in part_of("size", "headline")
    assert "4.42 m" not in part_of("size", "mini")


def test_unknown_parts_and_unpublished_results_are_input_errors(root):
    for name in PARTS:
        if name != "difficulty":
            with pytest.raises(InputError, match="results/published/paper"):
                part_of(name, "paper")
    with pytest.raises(InputError, match="<!-- sizes mini -->: no such part"):
        part_of("sizes", "mini")


def test_check_writes_nothing_and_publishing_writes_all(root, capsys):
    for page in PAGES:
        page.parent.mkdir(exist_ok=True)
        page.write_text("<!-- size headline --><!-- /size -->\n")
    assert main(["--check"]) == 1
    assert all(str(page) in capsys.readouterr().out for page in PAGES[:1])
    assert PAGES[0].read_text() == "<!-- size headline --><!-- /size -->\n"
    assert not pages.FIGURE.exists()
    assert main([]) == 0
    assert "Large Room 6k" in PAGES[0].read_text()
    assert main(["--check"]) == 0
    change_cell(root / "tables/table2_ground_truth.csv", "position_m_true", "9.9")
    assert main(["--check"]) == 1  # the figure alone


def test_effects_are_those_of_the_tables_as_printed():
    """The paper's own figures, by hand from its tables."""
    found = effects(MINI)
    posenet2 = found[(found.model == "posenet2") & (found.source == PAPER)]
    factors = posenet2.set_index(["change", "measure"]).factor
    exact, size = "exact labels, not SfM's", "80k frames, not 6k, Large Room"
    noise = "label noise of 0.3 m and 20°, against the labels"
    assert factors[exact, "position_m"] == pytest.approx(0.14 / 0.31)
    assert factors[size, "orientation_deg"] == pytest.approx(4.59 / 6.70)
    assert factors[noise, "position_m"] == pytest.approx(0.39 / 0.14)
    assert factors["from scratch, 80k frames", "position_m"] == pytest.approx(0.03 / 0.04)
    every = found[(found.change == exact) & (found.measure == "position_m")]
    here = every.factor[every.source == HERE]
    assert mean_factor(found, exact, "position_m", HERE) == pytest.approx(
        np.prod(here) ** (1 / len(here))
    )


def test_sentences_follow_the_results(root):
    path = root / "tables/table3_inconsistencies.csv"
    table = pd.read_csv(path)
    noisy = (table.block == "both") & (table.noise_m == 0.3)
    clean = table[(table.block == "both") & (table.noise_m == 0)].set_index("model")
    models = table.model[noisy]
    table.loc[noisy, "position_m"] = 3 * clean.position_m[models].to_numpy()
    table.loc[noisy, "orientation_deg_true"] = clean.orientation_deg_true[models].to_numpy() / 2
    table.to_csv(path, index=False)
    said = sentences(root)
    assert len(said) == 5
    assert "the position error changes by +200 % (+120 %)" in said[2]
    assert said[2].endswith("and −50 %.")


def test_a_figure_knows_what_it_was_drawn_from(tmp_path):
    found = effects(MINI)
    png = tmp_path / "figure.png"
    assert not is_drawn_from(png, found)
    write_findings_figure(found, png)
    assert is_drawn_from(png, found)
    assert not is_drawn_from(png, found.assign(factor=found.factor * 1.01))
