"""The paper beside ours: cells, ratios and ranks, recomputed from the CSV files by other code."""

import csv
import math
import re
from pathlib import Path

import pytest

from reproduction.report.effects_figure import effects_digest, effects_picture
from reproduction.report.intervals import Interval
from reproduction.report.paper_cells import paper_cells, rank_correlations, ratios
from reproduction.report.paper_figure import cells_digest, paper_figure, paper_picture
from reproduction.report.reproduced import effects, over_smaller, reproduced
from reproduction.report.stamped import shows, write_stamped
from reproduction.tables.layouts import TITLES
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
    parts = {("scene", "size"): "row", ("model",): "model"}
    for keys, within in parts.items():
        found = rank_correlations(cells, quantity, within)
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
        assert found == pytest.approx(expected, abs=1e-9)


def test_orders_that_agree_and_orders_that_are_reversed(cells):
    sizes = cells[(cells.table == "table4_size") & (cells.quantity == "position")]
    same = sizes.assign(ours=3 * sizes.printed)
    reverse = sizes.assign(ours=1 / sizes.printed)
    for within, count in (("row", 8), ("model", 5)):
        assert rank_correlations(same, "position", within) == pytest.approx([1] * count)
        assert rank_correlations(reverse, "position", within) == pytest.approx([-1] * count)
    assert list(ratios(same, "position").values()) == pytest.approx([3] * 5)


def test_the_line_on_networks_says_what_the_cells_say(cells):
    line = reproduced(NIGHT).splitlines()[2].replace("−", "-")
    orders, turns = (rank_correlations(cells, quantity, "row") for quantity in OURS)
    within = [sum(values) / len(values) for values in (orders, turns)]
    assert [float(n) for n in re.findall(r"[+-]\d\.\d\d", line)] == [round(n, 2) for n in within]
    assert f"over the {len(orders)} rows" in line
    assert f"negative in {sum(order < 0 for order in orders)} rows" in line


def claim(run, name):
    with NIGHT.with_name(run).joinpath("claims.csv").open(newline="") as lines:
        return next(row for row in csv.DictReader(lines) if row["id"] == name)


def percents(text):
    """Percentages of a text in order, without those in brackets."""
    return [float(n) for n in re.findall(r"([+-][\d.]+) %", re.sub(r"\(.*?\)", "", text))]


@pytest.mark.parametrize("place", range(5))
def test_effects_are_those_that_claims_were_judged_by(place):
    effect = effects(NIGHT)[place]
    row = claim(effect.run, effect.claim)
    values, ends = (percents(row[f"{of}_{effect.against}"])[:4] for of in ("measured", "interval"))
    paper = [float(n) for n in re.findall(r"([+-]?\d+) %", row["published"])]
    if effect.claim == "C6":  # told as shares of the error with noise
        values, ends, paper = (
            [100 * (1 / (1 - n / 100) - 1) for n in own] for own in (values, ends, paper)
        )
    found = [100 * (change.value - 1) for change in effect.ours]
    assert found == pytest.approx(values[:2], abs=1e-6)
    limits = [100 * (end - 1) for change in effect.ours for end in (change.low, change.high)]
    assert limits == pytest.approx(ends, abs=1e-6)
    if effect.paper is None:
        assert (effect.claim, effect.against) == ("C6", "true")
    else:
        assert [100 * (factor - 1) for factor in effect.paper] == pytest.approx(paper)


def test_a_quarter_of_the_larger_is_a_third_of_the_smaller():
    assert over_smaller(Interval(1.25, 1.2, 1.5)) == pytest.approx((4 / 3, 1.25, 2))


def test_the_noise_of_the_paper_is_that_of_its_table():
    """Table 3: PoseNet2 without noise and with 0.30 m and 20°, both errors."""
    (noise,) = (one for one in effects(NIGHT) if (one.claim, one.against) == ("C6", "labels"))
    cells = [row for row in rows("table3_inconsistencies") if row["model"] == "posenet2"]
    of = {row["noise_m"]: row for row in cells if row["block"] == "both"}
    for factor, name in zip(noise.paper, PAPER.values(), strict=True):
        printed = float(of["0.3"][name]) / float(of["0"][name])
        assert factor == pytest.approx(printed, rel=0.03)  # the paper rounds to whole percents


def test_a_picture_of_effects_shows_these_effects_and_no_others(tmp_path):
    found = effects(NIGHT)
    out = tmp_path / "effects.png"
    write_stamped(effects_picture(found), out)
    assert shows(out, effects_digest(found))
    assert not shows(out, effects_digest(found[:4]))


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


def test_a_run_without_table_4_has_a_figure_without_ratios(cells):
    figure = paper_figure(cells[cells.table != "table4_size"])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [f"{t}\n" for t in TITLES.values()]
    assert "×" in paper_figure(cells).legends[0].get_texts()[0].get_text()


def test_a_run_without_these_tables_has_no_cells(tmp_path):
    assert paper_cells(tmp_path).empty
