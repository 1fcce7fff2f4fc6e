"""The paper beside ours: cells, ratios and ranks, recomputed from the CSV files by other code."""

import csv
import math
import re
from pathlib import Path

import pytest

from reproduction.report.paper_cells import order_of_networks, paper_cells, ratios
from reproduction.report.paper_figure import cells_digest, paper_figure, paper_picture
from reproduction.report.reproduced import reproduced
from reproduction.report.stamped import shows, write_stamped
from synfeal.errors import InputError

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


def ranks(values):
    """Ranks from 1; equal values share the mean of theirs."""
    return [
        sum(other < value for other in values) + (1 + sum(other == value for other in values)) / 2
        for value in values
    ]


def correlation(first, second):
    """Pearson's correlation, by its definition."""
    means = [sum(values) / len(values) for values in (first, second)]
    apart = [
        [value - mean for value in values]
        for values, mean in zip((first, second), means, strict=True)
    ]
    norms = [math.sqrt(sum(value**2 for value in values)) for values in apart]
    return sum(a * b for a, b in zip(*apart, strict=True)) / math.prod(norms)


@pytest.mark.parametrize("quantity", [*OURS])
def test_ranks_within_rows_and_within_networks(cells, quantity):
    found = order_of_networks(cells, quantity)
    parts = {("scene", "size"): found.within_rows, ("model",): found.within_networks}
    for keys, printed in parts.items():
        groups = {}
        for row in rows("table4_size"):
            groups.setdefault(tuple(row[key] for key in keys), []).append(row)
        expected = [
            correlation(
                ranks([float(row[PAPER[quantity]]) for row in group]),
                ranks([ours(row, quantity) for row in group]),
            )
            for group in groups.values()
        ]
        assert printed == pytest.approx(sum(expected) / len(expected), abs=1e-9)


def test_orders_that_agree_and_orders_that_are_reversed(cells):
    sizes = cells[(cells.table == "table4_size") & (cells.quantity == "position")]
    same = sizes.assign(ours=3 * sizes.printed)
    assert order_of_networks(same, "position") == pytest.approx((1, 1))
    reversed_order = order_of_networks(sizes.assign(ours=1 / sizes.printed), "position")
    assert reversed_order == pytest.approx((-1, -1))
    assert list(ratios(same, "position").values()) == pytest.approx([3] * 5)


def test_the_lines_say_what_the_cells_say(cells):
    line = reproduced(NIGHT).splitlines()[2]
    text = line.replace("−", "-")
    within = [order_of_networks(cells, quantity) for quantity in OURS]
    assert [float(n) for n in re.findall(r"[+-]\d\.\d\d", text)] == [
        round(one[part], 2) for part in (0, 1) for one in within
    ]
    shown = [float(n) for n in re.findall(r"\w (\d\.\d\d)", line)]
    assert shown == [round(value, 2) for value in ratios(cells, "position").values()]


def test_a_run_that_the_lines_need_is_named_where_it_is_missing(tmp_path):
    (tmp_path / "night").symlink_to(NIGHT)
    with pytest.raises(InputError, match=r"controls"):
        reproduced(tmp_path / "night")


def test_the_figure_has_a_mark_for_every_cell_and_knows_what_it_shows(cells, tmp_path):
    axes = paper_figure(cells).axes
    assert sum(len(line.get_xdata()) for one in axes for line in one.lines[:5]) == len(cells)
    out = tmp_path / "paper.png"
    write_stamped(paper_picture(cells), out)
    assert shows(out, cells_digest(cells))
    moved = cells.assign(ours=cells.ours * 1.001)
    assert not shows(out, cells_digest(moved))
    assert not shows(tmp_path / "none.png", cells_digest(cells))


def test_a_run_without_these_tables_has_no_cells(tmp_path):
    assert paper_cells(tmp_path).empty
