"""Label errors of different shapes, compared on results whose changes are known."""

import numpy as np
import pandas as pd
import pytest

from baselines.config.learning import MODELS
from reproduction.claims.label_shapes import shape_changes_table, side_layout
from reproduction.design.files import Files
from reproduction.design.jobs import jobs_of_run
from reproduction.design.shapes import shape_rows
from reproduction.design.side_tables import made_side_tables, needs_of
from reproduction.tables.columns import side_sheet
from reproduction.tables.side import write_side_table
from tests.reproduction.test_design_files import files_of
from tests.support.claims_results import FRAMES_OF_PATH, N_PATHS, Results, lend, rows_where
from tests.support.report_results import design_of, experiment

TABLE = "table6_label_errors"
FACTORS = {"synfeal": 1.0, "noise": 1.1, "offset": 1.4, "bend": 1.7}
LARGEST = {"noise_m": 0.3, "noise_deg": 20}


def rows():
    wrong = [
        experiment(TABLE, labels=labels, noise_m=metres, noise_deg=degrees)
        for metres, degrees in ((0.1, 5), (0.3, 20))
        for labels in ("noise", "offset", "bend")
    ]
    return (experiment(TABLE), *wrong, experiment(TABLE, labels="scale", noise_m=0.9))


@pytest.fixture
def results(tmp_path):
    """Errors of paths differ up to tenfold, those of labels by one factor on every frame."""
    made = Results(tmp_path, design=rows())
    hard = np.geomspace(1.0, 10.0, N_PATHS).repeat(FRAMES_OF_PATH)[:, None]
    for row in made.design:
        small = row.noise_m == 0.1
        factor = 1.0 if small else FACTORS.get(row.labels, 9.0)
        for place, model in enumerate(MODELS, start=1):
            made.write(row, model, hard * np.array([0.02, 1.0]) * place * factor)
    return made


def changes(results):
    table = shape_changes_table(design_of(results.design), results.root)
    return table.set_index(["change", "error"])


def test_on_the_same_frames_one_factor_leaves_no_doubt_however_paths_differ(results, monkeypatch):
    lend(monkeypatch, 0.0)
    expected = {"noise": 10, "offset": 40, "bend": 70}
    expected |= {"offset more than noise": 30, "bend more than noise": 60}
    expected |= {"bend more than offset": 30}
    found = changes(results)
    assert [*dict.fromkeys(found.index.get_level_values(0))] == [*expected]
    for name, percent in expected.items():
        for error in ("position", "orientation"):
            assert found.loc[name, error].to_list() == pytest.approx(3 * [percent], abs=1e-6)


def test_single_runs_vary_as_much_as_they_borrow(results, monkeypatch):
    """Five localizers, each in two independent runs: sd of their mean change, to first order."""
    lend(monkeypatch, 0.02)
    value, low, high = changes(results).loc["noise", "position"]
    sd = 100 * 1.1 * 0.02 * np.sqrt(2 / 5)
    # A wide bound: Student's t has 16 degrees of freedom or more.
    assert value == pytest.approx(10)
    assert 1.9 * sd < high - value < 2.4 * sd
    assert 1.9 * sd < value - low < 2.4 * sd


def test_what_harms_some_paths_alone_widens_the_limits(results, monkeypatch):
    lend(monkeypatch, 0.0)
    row = rows_where(results, labels="bend", **LARGEST)[0]
    errors = np.full((N_PATHS * FRAMES_OF_PATH, 2), [0.2, 10.0])
    exact = rows_where(results, labels="synfeal")[0]
    doubled = errors * np.where(np.arange(N_PATHS).repeat(FRAMES_OF_PATH) < 7, 2, 1)[:, None]
    for model in MODELS:
        results.write(exact, model, errors)
        results.write(row, model, doubled)
    value, low, high = changes(results).loc["bend", "orientation"]
    assert (value, low, high) == pytest.approx((100, 0, 100))  # a majority of paths, or not


def test_the_largest_errors_in_all_shapes_are_compared():
    both = shape_rows(rows())
    assert {r.noise_m for r in both.by_shape.values()} == {0.3}
    assert {*both.by_shape} == {"noise", "offset", "bend"}
    without = [row for row in rows() if (row.labels, row.noise_m) != ("bend", 0.3)]
    assert {r.noise_m for r in shape_rows(without).by_shape.values()} == {0.1}
    for lacking in ("offset", "synfeal"):
        assert shape_rows(row for row in rows() if row.labels != lacking) is None
    assert shape_rows([]) is None


def test_the_table_is_made_where_the_design_has_the_rows():
    def files(design):
        return files_of(*(row.model_dump(exclude_defaults=True) for row in design))

    made, lacking = files(rows()), files(rows()[:2])
    assert isinstance(made, Files)
    assert {"side": "shape_changes"} in jobs_of_run(made)["side_table"]
    errors = [file for file in needs_of(made, "shape_changes") if file.endswith("errors.csv")]
    assert len(errors) == len(rows()) * len(MODELS)
    assert "shape_changes" not in made_side_tables(lacking)


def test_the_files_show_every_row(results, monkeypatch, tmp_path):
    lend(monkeypatch, 0.0)
    out = tmp_path / "tables" / "shape_changes"
    design = design_of(results.design)
    files = (out.with_suffix(".csv"), out.with_suffix(".tex"))
    write_side_table("shape_changes", design, {}, results.root, *files)
    table = pd.read_csv(out.with_suffix(".csv"))
    assert len(table) == 2 * (3 + 3)
    assert table.percent[0] == pytest.approx(10)
    assert "noise: every frame has its own error" in out.with_suffix(".tex").read_text()
    fewer = table.assign(percent=-2.4, percent_low=float("nan"), percent_high=float("nan"))
    lines = side_sheet(side_layout(fewer)).lines
    assert [value.text for value in lines[0].cells[1]] == ["−2 %"]
