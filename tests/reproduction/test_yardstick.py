"""Errors against noisy labels, from errors against the truth: closed forms and simulation."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from reproduction.tables.cells import read_cells
from reproduction.tables.layouts import DOSE
from reproduction.tables.write import sheet_of, write_table
from reproduction.tables.yardstick import COLUMNS, against_noisy_labels
from tests.support.report_results import (
    design_of,
    experiment,
    fill,
    read,
    table_files,
    write_errors,
)

INF = math.inf
CODES = {"noise_dose": "code"}


def test_closed_forms():
    errors = np.full(5, 0.4), np.full(5, 10.0)
    # Without noise nothing changes; without errors the noise is all there is.
    assert against_noisy_labels(*errors, 0.0, 0.0) == pytest.approx((0.4, 10.0))
    assert against_noisy_labels(np.zeros(5), np.zeros(5), 0.3, 20.0) == pytest.approx((0.3, 20.0))
    # Of one size of error the median direction is at right angles: Pythagoras, and on the sphere
    # cos(half) = cos(5 deg) cos(10 deg).
    position_m, degrees = against_noisy_labels(*errors, 0.3, 20.0)
    assert position_m == pytest.approx(0.5, abs=1e-3)
    half = math.degrees(math.acos(math.cos(math.radians(5)) * math.cos(math.radians(10))))
    assert degrees == pytest.approx(2 * half, abs=0.05)


def test_a_simulation_with_directions_and_rotations_agrees():
    rng = np.random.default_rng(0)
    n = 20_000
    errors_m, errors_deg = rng.lognormal(-1, 0.6, n), rng.lognormal(2.3, 0.6, n)

    def directions():
        drawn = rng.normal(size=(n, 3))
        return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)

    moved = errors_m[:, None] * directions() + 0.3 * directions()
    turns = [
        Rotation.from_rotvec(np.radians(angle)[:, None] * directions())
        for angle in (errors_deg, np.full(n, 20.0))
    ]
    expected = (
        np.median(np.linalg.norm(moved, axis=1)),
        np.degrees(np.median((turns[0] * turns[1]).magnitude())),
    )
    found = against_noisy_labels(errors_m, errors_deg, 0.3, 20.0)
    assert found == pytest.approx(expected, rel=0.015)  # three standard errors of the medians


def test_failed_frames_stay_failed():
    errors = np.array([0.1, INF, INF])
    assert against_noisy_labels(errors, errors, 0.3, 20.0) == (INF, INF)


def test_table_3_shows_it_beside_the_scores(tmp_path):
    levels = ((0.0, 0.0, "synfeal"), (0.3, 20.0, "noise"))
    rows = [
        experiment("table3_inconsistencies", block="both", labels=labels, noise_m=m, noise_deg=d)
        for m, d, labels in levels
    ]
    fill(tmp_path, rows)
    write_table(
        "table3_inconsistencies", design_of(rows), tmp_path, *table_files(tmp_path, "table3")
    )
    assert read(table_files(tmp_path, "table3")[0])[5][COLUMNS[0]] == ""  # no errors are stored
    for model in ("posenet", "poselstm"):
        write_errors(tmp_path, rows[0], model, np.tile([9.0, 9.0, 0.4, 10.0], (7, 1)))
    write_table(
        "table3_inconsistencies", design_of(rows), tmp_path, *table_files(tmp_path, "table3")
    )
    written = read(table_files(tmp_path, "table3")[0])
    assert [float(row[COLUMNS[0]]) for row in written[5:7]] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert {row[COLUMNS[0]] for row in (*written[:5], *written[7:])} == {""}
    sheet = sheet_of(
        "table3_inconsistencies", read_cells("table3_inconsistencies", design_of(rows), tmp_path)
    )
    (line,) = [line for line in sheet.lines if line.kind == "yardstick"]
    assert [value.text for value in line.cells[2]] == ["0.50 m", "22.34°"]


def test_at_the_codes_dose_the_noise_is_longer_by_the_root_of_three_and_tables_say_so(tmp_path):
    levels = ((0.0, 0.0, "synfeal"), (0.3, 20.0, "noise"))
    rows = [
        experiment("table3_inconsistencies", block="both", labels=labels, noise_m=m, noise_deg=d)
        for m, d, labels in levels
    ]
    fill(tmp_path, rows)
    write_errors(tmp_path, rows[0], "posenet", np.tile([9.0, 9.0, 0.4, 10.0], (7, 1)))
    text, code = design_of(rows), design_of(rows).model_copy(update=CODES)
    files = table_files(tmp_path, "table3")
    for design, moved_m, remarked in ((text, 0.3, False), (code, 0.3 * math.sqrt(3), True)):
        write_table("table3_inconsistencies", design, tmp_path, *files)
        written = read(files[0])
        assert {row["noise_m"] for row in written[5:]} == {"0.3"}  # the row of print
        assert [float(row["moved_m"]) for row in written] == pytest.approx(
            [0.0] * 5 + [moved_m] * 5
        )
        # Pythagoras, for the median direction is at right angles.
        alone = math.hypot(0.4, moved_m)
        assert float(written[5][COLUMNS[0]]) == pytest.approx(alone, abs=2e-3)
        assert float(written[5][COLUMNS[1]]) == pytest.approx(22.34, abs=0.05)  # whatever the dose
        cells = read_cells("table3_inconsistencies", design, tmp_path)
        assert (DOSE in sheet_of("table3_inconsistencies", cells).remarks) == remarked
        assert ("times the metres that a row names" in files[1].read_text()) == remarked
