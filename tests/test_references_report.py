"""The table of references and what is made of it, from scores that are known."""

import pandas as pd
import pytest

from baselines.references.registry import REFERENCES, answered_by
from synfeal.config import MODELS, Design
from synfeal.config.models import ExternalConfig
from synfeal.errors import InputError
from synfeal.files import write_json
from synfeal.report.figures.references_by_noise import figure_of
from synfeal.report.html.side_tables import references_table as html_table
from synfeal.report.references import (
    crossing_finding,
    label_title,
    read_references,
    references_sheet,
    write_references_table,
)
from tests.report_results import experiment, metrics, write_run

TABLE3 = "table3_inconsistencies"
LEVELS = ((0, 0), (0.1, 5), (0.3, 20))
# Per level, of structure, in metres; localizers have 0.20, 0.21, ... 0.24 at every level.
STRUCTURE_M = (0.01, 0.215, 0.5)
MINE = {"mine": ExternalConfig(title="Mine", poses="{labels}.csv", labels=["synfeal"])}


def design():
    noisy = [
        experiment(
            TABLE3, block="both", labels="noise" if m else "synfeal", noise_m=m, noise_deg=deg
        )
        for m, deg in LEVELS
    ]
    return [*noisy, experiment("table2_ground_truth", labels="sfm")]


@pytest.fixture
def root(tmp_path):
    for row in design():
        place = tmp_path / "references" / "large_room" / "6k" / row.label_id
        levels = dict(zip(LEVELS, STRUCTURE_M, strict=True))
        structure_m = levels[row.noise_m, row.noise_deg]
        for name in answered_by(design(), ("large_room", "6k", row.label_id), MINE):
            score = structure_m if name == "structure-depth" else 0.9
            recalls = {"recall_5cm_5deg": 0.5, "recall_5cm_5deg_true": 1.0}
            write_json(place / name / "metrics.json", metrics("6k", score, 10 * score) | recalls)
            write_json(place / name / "facts.json", {"answer_s": 5.0, "frames": 125})
        for k, model in enumerate(MODELS):
            recalls = {"recall_5cm_5deg": 0.0, "recall_5cm_5deg_true": 0.0}
            write_run(tmp_path, row, model, metrics("6k", 0.20 + 0.01 * k, 12.0) | recalls)
    return tmp_path


@pytest.fixture
def table(root):
    out = root / "tables" / "references"
    whole = Design(rows=design(), repetitions={"default": 1})
    write_references_table(whole, MINE, root, out.with_suffix(".csv"), out.with_suffix(".tex"))
    return read_references(out.with_suffix(".csv"))


def test_the_table_has_a_row_per_data_set_and_method_and_all_are_shown(table, root):
    # Scene coordinates are learnt from the simulator's labels and the largest noise alone.
    learnt = {"synfeal", "noise-p0.3-r20"}
    assert set(table.labels[table.method == "scene-coordinates"]) == learnt
    assert len(table) == 4 * (1 + len(REFERENCES) + len(MODELS)) + 1 - 2
    row = table[(table.labels == "noise-p0.1-r5") & (table.method == "structure-depth")].iloc[0]
    assert (row.position_m, row.orientation_deg) == (0.215, 2.15)
    assert (row.within_5cm_5deg, row.within_5cm_5deg_true) == (0.5, 1.0)
    assert row.seconds_per_frame == pytest.approx(5 / 125)
    assert (row.noise_m, row.noise_deg, row.kind) == (0.1, 5, "reference")
    mine = table[table.method == "mine"].iloc[0]
    assert (mine.title, mine.kind, mine.labels) == ("Mine", "external", "synfeal")
    sheet = references_sheet(table)
    titles = [reference.title for reference in REFERENCES.values()]
    assert list(sheet.headings[2:-1]) == ["Mean training pose", *titles, "Mine"]
    (clean,) = sheet.lines.index[sheet.lines.label == "Synfeal"]  # its labels are the truth
    best = sheet.values[(sheet.values.line == clean) & (sheet.values["column"] == "Best localizer")]
    assert best.text.tolist() == ["PoseNet, 0.2 m, 12°, 0 %"]
    page = html_table(root / "tables" / "references.csv")
    assert page.count("<tr") == 1 + len(table)
    rows = [row for row in design() if row.table == TABLE3]
    (upper, lower) = figure_of(table, rows).axes
    drawn = {line.get_label(): line.get_ydata() for line in upper.lines}
    assert list(drawn[REFERENCES["structure-depth"].title]) == list(STRUCTURE_M)
    assert len(lower.lines) == len(drawn) == len(REFERENCES) + len(MODELS) + 2


def test_the_finding_counts_the_localizers_that_are_closer(table):
    """0.20 and 0.21 m are below 0.215 m; all five are below 0.5 m, none below 1 cm.

    Structure is off by 0.1, 2.15 and 5 degrees, all localizers by 12.
    """
    finding = crossing_finding(table)
    assert "structure-based poses are off by 1 cm and 0.1°, the best localizer by 20 cm" in finding
    assert "2 in position and 0 in orientation at 0.1 m and 5°, 5 in position" in finding
    assert "adjusted from labels with 0.3 m and 20°, structure-based poses are off by 90" in finding
    failed = table.copy()
    failed.loc[failed.method == "structure-depth", "orientation_deg_true"] = None
    assert "2 in position and 5 in orientation at 0.1 m and 5°" in crossing_finding(failed)
    assert crossing_finding(table[table.noise_m == 0]) == ""


def test_label_sets_are_called_by_their_noise_and_a_bad_table_is_refused(tmp_path):
    assert label_title("bend-p0.075-r0") == "bend 0.075 m, 0°"
    assert label_title("sfm") == "SfM"
    path = tmp_path / "references.csv"
    pd.DataFrame({"scene": ["a"]}).to_csv(path)
    with pytest.raises(InputError, match=r"references.csv: column .* missing"):
        read_references(path)
