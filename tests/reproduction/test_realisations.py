"""Label sets of several runs side by side: recomputed from the published tables by other code."""

import csv
import re
import shutil

import pandas as pd
import pytest

from reproduction.report.published_claims import published_runs
from reproduction.report.realisations import realisations, realisations_table
from tests import ROOT

PUBLISHED = ROOT / "results/published"


def claim(root):
    with (root / "claims.csv").open(newline="") as file:
        return next(row for row in csv.DictReader(file) if row["id"] == "C2")


def numbers(text):
    return [float(n) for n in re.findall(r"[+-]?\d+(?:\.\d+)?", text.replace("−", "-"))]


def test_every_run_on_the_papers_frames_is_told_and_no_other():
    told = {own.profile: own for own in realisations(PUBLISHED)}
    for root in published_runs(PUBLISHED):
        row = claim(root)
        judged = bool(row["interval_true"])
        assert (root.name in told) == (judged and root.name != "mini"), root.name
    assert {"labels", "night"} <= {*told}
    assert (told["night"].seed, told["labels"].seed) == ("0", "1")


def test_numbers_are_those_of_tables_and_claims():
    for line in realisations_table(PUBLISHED).splitlines()[2:]:
        name = line.split("`")[1]
        _, run, labels, n_runs, position, orientation, _ = (
            part.strip() for part in line.split("|")
        )
        errors = pd.read_csv(PUBLISHED / name / "tables/label_error.csv")
        (row,) = errors.query(
            "scene == 'large_room' and method == 'sfm' and split == 'train'"
            " and assistance == 'after'"
        ).itertuples()
        shown_cm = numbers(labels.replace("SfM", ""))
        assert shown_cm == [round(100 * m, 1) for m in (row.position_m_median, row.position_m_rmse)]
        cells = pd.read_csv(PUBLISHED / name / "tables/table2_ground_truth.csv")
        (cell,) = cells.query("labels == 'sfm' and model == 'posenet2'").itertuples()
        assert int(n_runs) == cell.n_seeds
        (p, o), ends = (
            numbers(claim(PUBLISHED / name)["measured_true"])[:2],
            numbers(claim(PUBLISHED / name)["interval_true"]),
        )
        # Halves of a percent may be rounded either way.
        expected = [p, *ends[:2], o, *ends[2:]]
        assert numbers(f"{position} {orientation}") == pytest.approx(expected, abs=0.501)
        assert run.startswith(f"`{name}`")


def test_a_run_of_other_frames_is_left_out(tmp_path):
    root = tmp_path / "labels"
    shutil.copytree(PUBLISHED / "labels", root)
    assert len(realisations(tmp_path)) == 1
    path = root / "tables/label_error.csv"
    errors = pd.read_csv(path)
    errors["frames"] //= 4
    errors.to_csv(path, index=False)
    assert realisations(tmp_path) == []
    assert realisations_table(tmp_path) == "No such run has been published yet."
