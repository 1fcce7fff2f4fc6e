"""Rows that were run again with fresh seeds: counted from the published tables by other code."""

import csv
import shutil

import pytest

from reproduction.report.run_anew import run_anew
from tests import ROOT

PUBLISHED = ROOT / "results/published"
# Columns that tell the rows of a table apart; floats are compared as numbers.
COLUMNS = {
    "2": ("table2_ground_truth", ("labels",)),
    "3": ("table3_inconsistencies", ("block", "noise_m", "noise_deg")),
    "4": ("table4_size", ("scene", "size")),
    "5": ("table5_from_scratch", ("scene", "size")),
    "6": ("table6_label_errors", ("labels", "noise_m", "noise_deg")),
    "7": ("table7_images_shown", ("scene", "size", "init")),
}


def read(path, keys):
    """Rows of a table, each with the numbers of training runs of its cells."""
    found = {}
    with path.open(newline="") as file:
        for line in csv.DictReader(file):
            row = tuple(float(line[key]) if "noise" in key else line[key] for key in keys)
            found.setdefault(row, []).append(int(line["n_seeds"]))
    return found


def lines(root):
    body = run_anew(root).splitlines()[2:]
    return [[part.strip() for part in line.split("|")[1:-1]] for line in body]


def test_rows_and_training_runs_are_those_of_the_published_tables():
    together = {}
    for title, run, rows, runs in lines(PUBLISHED / "night"):
        name, keys = COLUMNS[title.removeprefix("Table ")]
        asked = {*read(PUBLISHED / "night/tables" / f"{name}.csv", keys)}
        if run == "together":
            assert rows == f"{len(together.pop(title))} of {len(asked)}"
            continue
        found = read(PUBLISHED / run.strip("`") / "tables" / f"{name}.csv", keys)
        again = asked & {*found}
        assert rows == f"{len(again)} of {len(asked)}"
        counts = {count for row in again for count in found[row]}
        assert runs == " to ".join(str(n) for n in sorted({min(counts), max(counts)}))
        together.setdefault(title, set()).update(again)
    assert not together


@pytest.mark.parametrize("seen", ["night", "mini"])
def test_runs_that_were_seen_do_not_count(tmp_path, seen):
    for name in (seen, "curves"):
        shutil.copytree(PUBLISHED / name, tmp_path / name)
    shutil.copytree(PUBLISHED / "night", tmp_path / "other")  # has all rows, and seed 0
    told = lines(tmp_path / seen)
    assert {run for _, run, _, _ in told} == {"`curves`", "together"}
    (of_table_3,) = (rows for title, run, rows, _ in told if title == "Table 3")
    assert of_table_3.startswith("0 of ")
