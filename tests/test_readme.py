"""The read-me: its numbers are those of the tracked result files."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from synfeal.errors import InputError
from synfeal.report import readme
from synfeal.report.readme import PARTS, ROOT, main, rewritten

REPOSITORY = Path(__file__).parent.parent


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A copy of the tracked results."""
    shutil.copytree(REPOSITORY / ROOT / "tables", tmp_path / "results/published/mini/tables")
    shutil.copy(REPOSITORY / ROOT / "summary.md", tmp_path / "results/published/mini/summary.md")
    shutil.copytree(
        REPOSITORY / readme.DIFFICULTY, tmp_path / "results/benchmarks/scene_difficulty"
    )
    return tmp_path / "results/published/mini"


def test_the_readme_shows_the_tracked_results(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    assert main(["--check"]) == 0


def changed_in(path: Path, column: str, value: str) -> None:
    """Set a column of the first row of a CSV."""
    head, first, *rest = path.read_text().splitlines()
    cells = first.split(",")
    cells[head.split(",").index(column)] = value
    path.write_text("\n".join([head, ",".join(cells), *rest]) + "\n")


@pytest.mark.parametrize(
    ("part", "file", "column", "value", "shown"),
    [
        ("size", "published/mini/tables/table4_size.csv", "position_m_true", "7.654", "7.65 m"),
        (
            "size",
            "published/mini/tables/table4_size.csv",
            "published_position_m",
            "6.54",
            "*(6.54 m",
        ),
        (
            "labels",
            "published/mini/tables/table2_ground_truth.csv",
            "orientation_deg_true",
            "99.87",
            "99.9°",
        ),
        (
            "difficulty",
            "benchmarks/scene_difficulty/large_room-sift.csv",
            "covered_share_mean",
            "0.99",
            "| 99 % (",
        ),
        (
            "difficulty",
            "benchmarks/scene_difficulty/large_room-repetition.csv",
            "far_share",
            "0.777",
            "77.7 %",
        ),
    ],
)
def test_changing_a_result_changes_the_text(
    root: Path, part: str, file: str, column: str, value: str, shown: str
) -> None:
    before = PARTS[part](root)
    assert shown not in before
    changed_in(root.parent.parent / file, column, value)
    assert shown in PARTS[part](root)


def test_changing_a_label_error_changes_the_text(root: Path) -> None:
    before = PARTS["assistance"](root)
    path = root / "tables/label_error.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()]
    place = {name: rows[0].index(name) for name in ("split", "assistance", "position_m_median")}
    for row in rows[1:]:
        if (row[place["split"]], row[place["assistance"]]) == ("test", "after"):
            row[place["position_m_median"]] = "0.4321"
    path.write_text("\n".join(map(",".join, rows)) + "\n")
    assert "43.2 cm" not in before
    assert "43.2 cm" in PARTS["assistance"](root)


def test_findings_are_those_of_the_summary(root: Path) -> None:
    (root / "summary.md").write_text("# Title\n\ntext\n\n- one\n- two\n\n| a |\n")
    assert PARTS["findings"](root) == "- one\n- two"


def test_a_failed_cell_says_so(root: Path) -> None:
    changed_in(root / "tables/table4_size.csv", "position_m_true", "")
    assert "| failed *(" in PARTS["size"](root)


def test_parts_are_replaced_and_nothing_else() -> None:
    text = "a\n<!-- x -->\nold\n<!-- /x -->\nb <!-- y -->\n"
    once = rewritten(text, {"x": "new \\1"})
    assert once == "a\n<!-- x -->\n\nnew \\1\n\n<!-- /x -->\nb <!-- y -->\n"
    assert rewritten(once, {"x": "new \\1"}) == once


def test_a_part_without_a_place_is_an_input_error() -> None:
    with pytest.raises(InputError, match="size"):
        rewritten("nothing", {"size": "text"})


def test_missing_results_are_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        PARTS["size"](tmp_path)
