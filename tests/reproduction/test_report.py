"""Tables from results: known scores in, exact cells out."""

import math
from collections import Counter
from statistics import mean

import pytest

from baselines.config.learning import MODELS
from reproduction.tables.cells import FOLDER, key_of, published_cells
from synfeal.records.tables import NUMBER, read_frame
from tests.support.report_results import (
    ROWS,
    SIZES,
    TABLE4,
    cell,
    experiment,
    failed_metrics,
    fill,
    lines_of,
    make,
    metrics,
    read,
    shipped_design,
    write_run,
)

KEYS = {
    "table1_meshes": ["scene"],
    "table2_ground_truth": ["scene", "labels", "model"],
    "table3_inconsistencies": ["block", "noise_m", "noise_deg", "model"],
    TABLE4: ["scene", "size", "model"],
    "table5_from_scratch": ["scene", "size", "model"],
    "table6_label_errors": ["labels", "noise_m", "noise_deg", "model"],
    "table7_images_shown": ["scene", "size", "init", "model"],
}


@pytest.mark.parametrize(("table", "count"), [("table1_meshes", 2), *ROWS.items()])
def test_a_complete_table_has_all_rows_and_no_empty_cell(results, table, count):
    rows = read(results / "tables" / f"{table}.csv")
    assert len(rows) == count
    empty = {(row.get("labels"), k) for row in rows for k in row if row[k] == ""}
    # These results have no errors of single frames.
    empty = {(labels, name) for labels, name in empty if not name.startswith("yardstick_")}
    if table not in ("table6_label_errors", "table7_images_shown"):  # our own
        assert {labels for labels, _ in empty} <= {"kinect-fusion"}  # a row the paper has not
    assert all(column.startswith("published_") for _, column in empty)
    assert list(rows[0])[: len(KEYS[table])] == KEYS[table]
    assert len({tuple(row[key] for key in KEYS[table]) for row in rows}) == len(rows)


def test_cells_carry_scores_limits_counts_changes_and_the_published_values(results):
    rows = read(results / "tables" / "table3_inconsistencies.csv")
    found = cell(rows, block="both", noise_m="0.1", noise_deg="5", model="posenet")
    # 1 + 3 * 0.1 from the noise level; true scores are half of it.
    expected = {
        "position_m": 1.3,
        "orientation_deg": 26,
        "position_m_true": 0.65,
        "orientation_deg_true": 13,
        "position_rms_m": 1.3 / math.sqrt(3),
        "baseline_orientation_deg_true": 60,
        "floor_position_m": 0.25,
        "position_m_low": 1.17,
        "orientation_deg_true_high": 15.6,
        "n_train": 300,
        "n_test": 125,
        "n_seeds": 1,
        "failed": 0,
        "published_position_m": 0.35,
        "published_orientation_deg": 11.47,
    }
    assert {k: float(found[k]) for k in expected} == pytest.approx(expected, rel=1e-5)
    misprint = cell(rows, block="both", noise_m="0.1", model="posenet2")
    assert misprint["published_orientation_deg"] == "0.75"
    assert misprint["published_flag"] == "misprint"
    rows = read(results / "tables" / "table1_meshes.csv")
    assert rows[0] == {
        "scene": "large_room",
        "vertices": "50000",
        "faces": "90000",
        "volume_m3": "88.25",
        "published_vertices": "122248",
        "published_faces": "192500",
        "published_volume_m3": "89.4",
    }
    assert (rows[1]["published_faces"], rows[1]["published_volume_m3"]) == ("397516", "183.18")
    rows = read(results / "tables" / "table5_from_scratch.csv")
    changes = ("position", "orientation", "position_true", "orientation_true")
    for row in rows:  # scratch scores are twice the others
        assert [row[f"{c}_change_percent"] for c in changes] == ["100"] * 4
    found = cell(rows, size="80k", model="posenet2")
    assert found["published_position_change_percent"] == "-25"
    assert found["published_orientation_change_percent"] == "-1.96"
    tex = (results / "tables" / "table5_from_scratch.tex").read_text()
    assert tex.count(r"\textcolor{red!85!black}{$+$100.0\%}") == 40
    assert r"\textcolor{green!45!black}{$-$25.0\%}, \textcolor{green!45!black}{$-$2.0\%}" in tex
    assert r"\textcolor{green!45!black}{$+$0.0\%}" in tex  # the paper: 0.0 % is green


def test_what_the_paper_does_not_have_is_not_compared_with_it(tmp_path):
    noise = {"labels": "noise", "noise_m": 0.05, "noise_deg": 0}
    row = experiment("table3_inconsistencies", block="position", **noise)
    fill(tmp_path, [row])
    rows, tex = make(row.table, [row], tmp_path)
    assert len(rows) == 5
    assert {r["published_position_m"] + r["published_flag"] for r in rows} == {""}
    assert "0.05 m, 0$^\\circ$" in tex
    assert "& paper &" not in tex.replace(r"\textcolor{gray}{paper}", "paper")
    rows = [experiment(TABLE4, init="scratch"), experiment(TABLE4, scene="sanctuary", size="80k")]
    fill(tmp_path, rows)
    found, _ = make(TABLE4, rows, tmp_path)
    assert [row["published_position_m"] for row in found] == [""] * 10


def test_the_best_of_each_column_is_bold_and_a_failed_run_counted_and_never_bold(tmp_path):
    rows = [experiment(TABLE4, size=size) for size in SIZES]
    scores = [(0.50, 8.0), (0.304, 6.0), (0.296, 7.0), (0.40, 9.0)]
    for row, (position, orientation) in zip(rows, scores, strict=True):
        for model in MODELS:
            write_run(tmp_path, row, model, metrics(row.size, position, orientation))
    _, tex = make(TABLE4, rows, tmp_path)
    first_model = [line[2] for line in lines_of(tex, "labels = truth")]
    assert first_model == [
        r"0.50 m, 8.00$^\circ$",
        r"\textbf{0.30 m}, \textbf{6.00$^\circ$}",
        r"\textbf{0.30 m}, 7.00$^\circ$",  # a tie as printed
        r"0.40 m, 9.00$^\circ$",
    ]
    fill(tmp_path, rows)
    write_run(tmp_path, rows[0], "poselstm", failed_metrics("6k"))
    found, tex = make(TABLE4, rows, tmp_path)
    failed = cell(found, size="6k", model="poselstm")
    assert (failed["position_m"], failed["failed"], failed["n_seeds"]) == ("", "125", "1")
    assert (failed["n_test"], failed["published_position_m"]) == ("125", "0.24")
    assert lines_of(tex, "labels = truth")[0][3] == "failed$^{a}$"
    assert "125 of 125 predictions failed" in tex


def test_a_failed_run_with_transfer_learning_leaves_no_change_to_report(tmp_path):
    row = experiment("table5_from_scratch", init="scratch")
    fill(tmp_path, [row])
    reference = row.model_copy(update={"init": "pretrained"})
    write_run(tmp_path, reference, "posenet", failed_metrics("6k"))
    found, tex = make(row.table, [row], tmp_path)
    assert cell(found, model="posenet")["position_change_percent"] == ""
    assert cell(found, model="posenet2")["position_change_percent"] == "100"
    assert "no change known" in tex


def test_repetitions_are_averaged_with_their_spread_and_failures_stay_visible(tmp_path):
    row = experiment(TABLE4)
    for k, score in enumerate((0.2, 0.3, 0.4)):
        for model in MODELS:
            write_run(tmp_path, row, model, metrics("6k", score, 10.0), k)
    write_run(tmp_path, row, "posenet2", failed_metrics("6k"), 2)
    found, tex = make(TABLE4, [row], tmp_path, repetitions=3)
    whole = cell(found, model="posenet")
    assert float(whole["position_m"]) == pytest.approx(0.3)
    assert float(whole["position_m_sd"]) == pytest.approx(0.1)  # of 0.2, 0.3, 0.4
    # Wider than the normal distribution has it, no wider than Student's t with two degrees of
    # freedom, whose tabulated 97.5 % point is 4.303.
    error = 0.1 / math.sqrt(3)
    below = 0.3 - float(whole["position_m_low"])
    assert math.hypot(0.03, 1.96 * error) < below < math.hypot(0.03, 4.303 * error)
    assert whole["limits_of"] == "paths and seeds"
    assert "Cells of one training run" not in tex
    part = cell(found, model="posenet2")
    assert float(part["position_m"]) == pytest.approx(0.25)
    assert (part["n_seeds"], part["failed"]) == ("3", "125")
    assert r"0.30 $\pm$ 0.10 m, 10.00 $\pm$ 0.00$^\circ$" in tex
    assert "125 of 375 predictions failed, 2 of 3 runs have a score." in tex


OUR_OWN = ("table6_label_errors", "table7_images_shown")


@pytest.fixture(scope="module")
def design():
    return shipped_design()


@pytest.mark.parametrize(("table", "count"), ROWS.items())
def test_every_cell_of_the_design_has_one_published_counterpart(design, table, count):
    wanted = {key_of(row, m) for row in design if row.table == table for m in MODELS}
    published = set(published_cells(table))
    assert published <= wanted
    ours = {key[3] for key in wanted - published}
    assert ours <= {"kinect-fusion"} or table in OUR_OWN
    assert len(wanted) == count


@pytest.mark.parametrize(
    ("table", "position_m", "orientation_deg"),
    # Sums over all cells, computed from the table source of the paper, not from our files.
    [
        ("table2_ground_truth", 5.72, 226.70),
        ("table3_inconsistencies", 17.23, 885.30),
        ("table4_size", 10.63, 476.28),
        ("table5_from_scratch", 4.06, 181.55),
    ],
)
def test_published_totals(table, position_m, orientation_deg):
    cells = published_cells(table).values()
    assert sum(c.position_m for c in cells) == pytest.approx(position_m, abs=1e-6)
    assert sum(c.orientation_deg for c in cells) == pytest.approx(orientation_deg, abs=1e-6)


def test_published_changes_the_text_and_the_misprinted_row():
    cells = published_cells("table5_from_scratch").values()
    changes = [(c.position_change_percent, c.orientation_change_percent) for c in cells]
    assert changes[0] == (44.8, 100.1)
    assert changes[-1] == (-25, -1.96)
    assert sum(map(sum, changes)) == pytest.approx(1339.34)
    cells = published_cells(TABLE4)
    first = [c for k, c in cells.items() if k[1:3] == ("sanctuary", "6k")]
    assert round(mean(c.position_m for c in first), 2) == 0.70
    assert round(mean(c.orientation_deg for c in first), 1) == 34.8
    volumes_m3 = read_frame(FOLDER / "table1_meshes.csv", {"volume_m3": NUMBER}).volume_m3
    assert [round(volume / 6.37) for volume in volumes_m3] == [14, 29]
    noise = {"labels": "noise", "noise_m": 0.1, "block": "both"}
    row = experiment("table3_inconsistencies", noise_deg=5, **noise)
    found = {m: published_cells(row.table)[key_of(row, m)] for m in MODELS}
    assert {c.printed_row for c in found.values()} == {"0.10 m, 0°"}
    assert all("run as 0.10 m, 5°" in c.row_note for c in found.values())
    assert (found["posenet2"].orientation_deg, found["posenet2"].flag) == (0.75, "misprint")
    flags = Counter(c.flag for table in ROWS for c in published_cells(table).values())
    assert flags == {"none": 135, "misprint": 1, "suspect": 4}
