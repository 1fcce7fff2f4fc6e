"""The table of hard cases: ours keeps its promises, and the table would say so if it did not."""

import math
import xml.etree.ElementTree as ET
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from reproduction.hard_cases import estimates, exact, scenes
from reproduction.hard_cases import table as hard_table
from reproduction.report.html.tables import side_html
from reproduction.statistics import limits as stats
from reproduction.tables.columns import side_sheet
from reproduction.tables.sheet import sheet_latex
from synfeal.records.tables import read_frame
from tests.support.report_results import write_rows

ALL = {(family.name, name): family for family in hard_table.CASES for name in family.cases}
FAMILIES = list(dict.fromkeys(family.name for family in hard_table.CASES))


@pytest.fixture(scope="module", autouse=True)
def all_rows():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exact, "N_TIMINGS", 1)
        yield hard_table.rows_of(hard_table.CASES)


def test_every_case_keeps_its_bound_and_pages_mark_what_exceeds_it(all_rows, tmp_path):
    assert [(row["case"], row["our_error"]) for row in all_rows if not row["ok"]] == []
    assert len(ALL) == len(all_rows) >= 45
    write_rows(tmp_path / "table.csv", hard_table.SCHEMA, all_rows)
    table = hard_table.side_table(read_frame(tmp_path / "table.csv", hard_table.SCHEMA))
    lines = ET.fromstring(side_html(table)).findall(".//tbody/tr")
    for row, line in zip(all_rows, lines, strict=True):
        assert ("✗" in "".join(line[2].itertext())) == (row["naive_error"] > row["bound"])
        assert "✗" not in "".join(line[3].itertext())
    text = sheet_latex(side_sheet(table))
    for row in all_rows:
        if row["quantity"] == exact.REFUSAL:
            formulas = f"$\\times$ answered ({row['naive']}) & refused ({row['ours']}) &"
            assert formulas.replace("_", r"\_") in text
    assert {c for c in text if ord(c) > 127} <= {"µ", "ö"}  # those LaTeX knows


@pytest.mark.parametrize("family", FAMILIES)
def test_each_family_shows_what_goes_wrong(family, all_rows):
    rows = [row for row in all_rows if row["family"] == family]
    assert any(row["naive_error"] > row["bound"] for row in rows)


def test_a_broken_function_is_not_ok(monkeypatch):
    monkeypatch.setattr(stats, "share_limits", estimates.wald)
    assert hard_table.row_of(ALL["shares", "0 of 20"], "0 of 20")["ok"] == 0


@pytest.mark.parametrize(
    ("answer", "truth", "error"),
    [
        ([1.0, np.nan], [1, 2], np.inf),
        ([1.0, np.inf], [1, 2], np.inf),
        (exact.REFUSED, exact.REFUSED, 0),
        (exact.REFUSED, 1, np.inf),
        (1.0, exact.REFUSED, np.inf),
        ([1.0, 0.5], [1 + Fraction(1, 10**40), Fraction(1, 2)], 1e-40),
        (0.1, Fraction(1, 10), 5.55e-18),  # of the double itself
    ],
)
def test_an_error_is_that_of_the_doubles(answer, truth, error):
    trial = exact.Trial(lambda: answer, lambda: answer, truth)
    assert exact.examine(trial)["our_error"] == pytest.approx(error, rel=1e-3)


def test_truths_agree_with_scipy_and_closed_forms():
    quat, other = exact.quat_of(1.1, (1, 2, -2)), exact.quat_of(0.7, (3, 1, 1))
    expected = Rotation.from_rotvec(1.1 * np.array([1, 2, -2]) / 3)
    second = Rotation.from_quat(exact.rounded(other), scalar_first=True)
    found = exact.rounded(exact.matrix_of(quat))
    np.testing.assert_allclose(found, expected.as_matrix(), atol=1e-15)
    product = exact.quat_product(exact.inverse(quat), other)
    between = (expected.inv() * second).magnitude()
    assert float(exact.angle_of_quat(product)) == pytest.approx(between, abs=1e-14)
    assert float(exact.angle_of_matrix(exact.matrix_of(product))) == pytest.approx(between)
    half = exact.rounded(exact.quat_to_power([-v for v in quat], 0.5))
    slerp = Slerp([0, 1], Rotation.concatenate([Rotation.identity(), expected]))
    np.testing.assert_allclose(half, slerp(0.5).as_quat(scalar_first=True), atol=1e-15)
    matrix = expected.as_matrix() + 0.05 * np.random.default_rng(1).normal(size=(3, 3))
    u, _, vt = np.linalg.svd(matrix)
    nearest = exact.rounded(exact.nearest_rotation(exact.exact(matrix)))
    np.testing.assert_allclose(nearest, u @ vt, atol=1e-14)
    low, high = estimates.share(0, 20).truth
    assert (float(low), float(high)) == (0, pytest.approx(1 - 0.025 ** (1 / 20), rel=1e-14))
    assert float(estimates.median_of([0.5, 0.25, 4.0, 1.0]).truth) == 0.75
    slanted = [float(v) for v in scenes.depth_of_plane(2.0, 0.4).truth]
    x = (np.arange(16) + 0.5 - 8) / (8 / np.tan(np.radians(30)))
    np.testing.assert_allclose(slanted[:16], 2 / (1 - 0.4 * x), rtol=1e-14)
    rows = scenes.wall(0.0, 1e-3)
    assert rows.error(np.full(100, 3.0), rows.truth) < 1e-15  # three metres along unit rays
    assert rows.error(np.full(100, 3.1), rows.truth) == pytest.approx(1e-5, rel=1e-6)
    assert math.isinf(rows.error(np.full(100, np.inf), rows.truth))


def test_the_table_has_the_same_errors_every_time(tmp_path, monkeypatch):
    some = [f for f in hard_table.CASES if f.name in ("orientation error", "depth", "shares")]
    monkeypatch.setattr(hard_table, "CASES", some)
    texts = []
    for name in ("once.csv", "twice.csv"):
        hard_table.write_hard_cases(tmp_path / name)
        lines = (tmp_path / name).read_text().splitlines()
        assert lines[0] == ",".join(hard_table.SCHEMA)
        texts.append([line.rsplit(",", 2)[0] for line in lines])
    assert texts[0] == texts[1]
    assert len(texts[0]) == sum(len(family.cases) for family in some) + 1
