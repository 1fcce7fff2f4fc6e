"""The paper beside ours: cells, ratios and ranks, recomputed from the CSV files by other code."""

import csv
import math
from pathlib import Path

import pytest

from reproduction.claims.levels import CELLS_SCHEMA
from reproduction.report.paper_cells import best_known_cells, paper_cells, pooled_cells, ratios
from reproduction.report.paper_figure import cells_digest, paper_figure, paper_picture
from reproduction.report.stamped import shows, write_stamped
from reproduction.tables.layouts import TITLES
from synfeal.records.tables import frame_of

REPOSITORY = Path(__file__).parents[2]
NIGHT = REPOSITORY / "results/published/night"
PAPER = {"position": "published_position_m", "orientation": "published_orientation_deg"}
OURS = {"position": "position_m", "orientation": "orientation_deg"}


def rows(table):
    with (NIGHT / f"tables/{table}.csv").open(newline="") as lines:
        return [row for row in csv.DictReader(lines) if row["published_flag"] == "none"]


def ours(row, quantity):
    """Median error in the paper's unit: root mean square over the axes for positions."""
    return float(row[OURS[quantity]]) / (math.sqrt(3) if quantity == "position" else 1)


@pytest.fixture(scope="module")
def cells():
    return paper_cells(NIGHT)


@pytest.mark.parametrize(
    "table", ["table2_ground_truth", "table3_inconsistencies", "table4_size", "table5_from_scratch"]
)
@pytest.mark.parametrize("quantity", [*OURS])
def test_every_printed_cell_is_there_and_no_misprint(cells, table, quantity):
    expected = sorted(
        (row["model"], float(row[PAPER[quantity]]), round(ours(row, quantity), 5))
        for row in rows(table)
        if row[PAPER[quantity]]
    )
    own = cells[(cells.table == table) & (cells.quantity == quantity)]
    found = sorted(zip(own.model, own.printed, own.ours.round(5), strict=True))
    assert len(found) >= 20
    for one, other in zip(found, expected, strict=True):
        assert one[:2] == other[:2]
        assert one[2] == pytest.approx(other[2], abs=2e-5)


def test_ratios_are_geometric_means_over_table_4(cells):
    sizes = cells[(cells.table == "table4_size") & (cells.quantity == "position")]
    assert list(ratios(sizes.assign(ours=3 * sizes.printed), "position").values()) == (
        pytest.approx([3] * 5)
    )
    own = [row for row in rows("table4_size") if row["model"] == "posenet"]
    found = [ours(row, "position") / float(row[PAPER["position"]]) for row in own]
    assert ratios(cells, "position")["posenet"] == pytest.approx(
        math.prod(found) ** (1 / len(found)), rel=1e-4
    )


@pytest.fixture
def pooled(tmp_path):
    """Errors of three cells over five replications: of Table 2, Table 3 and Table 4."""
    same = {"scene": "large_room", "size": "6k", "init": "pretrained", "replications": 5}
    errors = [
        {"labels": "sfm", "test_set": "own", "against": "labels", "position_m": 0.3},
        {"labels": "sfm", "test_set": "own", "against": "true", "position_m": 9},
        {"labels": "noise-p0.3-r20", "test_set": "own", "against": "labels", "position_m": 0.6},
        {"labels": "synfeal", "test_set": "common", "against": "true", "position_m": 0.9},
    ]
    rows = [
        {**same, "model": "posenet", "orientation_deg": 10, **error}
        | {f"{unit}_{end}": 1 for unit in ("position_m", "orientation_deg") for end in ENDS}
        for error in errors
    ]
    frame_of(rows, CELLS_SCHEMA).to_csv(tmp_path / "cell_errors.csv", index=False)
    return tmp_path


ENDS = ("low", "high")


def test_cells_of_replications_stand_beside_the_printed_ones(pooled, cells):
    found = pooled_cells(pooled).query("quantity == 'position'").set_index("table")
    assert len(found) == 3
    # Printed: PoseNet's first cells of Tables 2 and 4, and its last of Table 3.
    expected = {
        "table2_ground_truth": (0.34, 0.3),
        "table3_inconsistencies": (0.50, 0.6),
        "table4_size": (0.29, 0.9),
    }
    for table, (printed, distance_m) in expected.items():
        assert found.printed[table] == printed
        assert found.ours[table] == pytest.approx(distance_m / math.sqrt(3))
    together = best_known_cells(NIGHT, pooled)
    assert len(together) == len(cells)
    assert (together.replications == 5).sum() == 6
    own = together[(together.replications == 5) & (together.table == "table4_size")]
    assert set(own.ours.round(4)) == {round(0.9 / math.sqrt(3), 4), 10}
    figure = paper_figure(together)
    marks = [line for axes in figure.axes for line in axes.lines if line.get_linestyle() == "None"]
    full = [line for line in marks if line.get_markerfacecolor() != "none"]
    assert sum(len(line.get_xdata()) for line in full) == 6
    assert sum(len(line.get_xdata()) for line in marks) == len(together)


def test_the_figure_has_a_mark_for_every_cell_and_knows_what_it_shows(cells, tmp_path):
    axes = paper_figure(cells).axes
    marks = [line for one in axes for line in one.lines if line.get_linestyle() == "None"]
    assert sum(len(line.get_xdata()) for line in marks) == len(cells)
    out = tmp_path / "paper.png"
    write_stamped(paper_picture(cells), out)
    assert shows(out, cells_digest(cells))
    moved = cells.assign(ours=cells.ours * 1.001)
    assert not shows(out, cells_digest(moved))
    assert not shows(tmp_path / "none.png", cells_digest(cells))


def test_a_run_without_table_4_has_a_figure_without_ratios(cells):
    figure = paper_figure(cells[cells.table != "table4_size"])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [f"{t}\n" for t in TITLES.values()]
    assert "×" in paper_figure(cells).legends[0].get_texts()[0].get_text()


def test_a_run_without_these_tables_has_no_cells(tmp_path):
    assert paper_cells(tmp_path).empty
