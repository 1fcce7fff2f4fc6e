"""Claims judged with fresh seeds: which count, which verdict stands, what would decide the rest."""

import csv
import shutil
from pathlib import Path

import pandas as pd
import pytest

from reproduction.claims.rules import rules_history
from reproduction.claims.verdicts import Verdict
from reproduction.config.load import load_config
from reproduction.design.experiments import read_design
from reproduction.plan.plan import plan_text
from reproduction.report.claims_table import claims_table
from reproduction.report.fresh import (
    PLANNED_FROM,
    RUNS,
    claims_to_test,
    fresh_claims,
    is_decided,
    judged_fresh,
    planned_hours,
)
from reproduction.report.publish import PUBLISHED
from tests import CONFIG

REPOSITORY = Path(__file__).parents[2]
MINI = REPOSITORY / "results/published/mini"
STARTS = ("pretrained", "scratch")


def publish_copy(folder, name, changes=(), **common):
    """Copy the published mini under another name, with other cells in its claims.csv.

    ``changes`` are triples of claim, column and value; ``common`` holds columns of all rows.
    """
    shutil.copytree(MINI, folder / name, ignore=shutil.ignore_patterns("tables"))
    path = folder / name / "claims.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        row.update(common)
        row.update({column: value for claim, column, value in changes if claim == row["id"]})
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)


def profiles(judged):
    return {found.profile for own in judged.values() for found in own}


def test_seeds_that_were_seen_and_rules_that_were_replaced_do_not_count(tmp_path):
    publish_copy(tmp_path, "seen", seed="0")
    publish_copy(tmp_path, "replaced", seed="7", rules=rules_history()[0].tag)
    assert judged_fresh(tmp_path) == {}
    assert "No claim" in fresh_claims(tmp_path)
    publish_copy(tmp_path, "fresh", seed="7")
    assert profiles(judged_fresh(tmp_path)) == {"fresh"}


def test_claims_without_chance_are_left_out(tmp_path):
    publish_copy(tmp_path, "fresh", seed="7")
    names = {*judged_fresh(tmp_path)}
    assert names
    assert not names & {"C9", "C14", "C16"}
    assert len(claims_to_test()) == 13


def test_no_verdict_of_several_runs_is_passed_over(tmp_path):
    for seed, (profile, verdict) in enumerate(
        {
            "a": Verdict.UNDECIDED,
            "b": Verdict.HOLDS,
            "c": Verdict.NOT_TESTABLE,
            "labels": Verdict.UNDECIDED,
        }.items(),
        start=1,
    ):
        publish_copy(tmp_path, profile, [("C2", "verdict_true", str(verdict))], seed=str(seed))
    judged = judged_fresh(tmp_path)["C2"]
    # The run that is for the claim, then the others; what could not judge it is no verdict.
    assert [own.profile for own in judged] == ["labels", "a", "b"]
    assert is_decided(judged)
    told = claims_table(tmp_path / "labels").splitlines()
    (line,) = (line for line in told if line.startswith("| C2 |"))
    assert line.endswith("| **holds** (`b`; open in `labels`, `a`) |")
    text = fresh_claims(tmp_path)
    assert all(text.count(f"| `{profile}` |") for profile in ("labels", "a", "b"))
    assert "C2" not in text.split("What would decide the others")[1]


def test_runs_that_contradict_each_other_leave_a_claim_open(tmp_path):
    publish_copy(tmp_path, "a", [("C2", "verdict_true", str(Verdict.OPPOSITE))], seed="1")
    publish_copy(tmp_path, "labels", [("C2", "verdict_true", str(Verdict.HOLDS))], seed="2")
    judged = judged_fresh(tmp_path)["C2"]
    assert all(own.decided for own in judged)
    assert not is_decided(judged)
    told = claims_table(tmp_path / "labels")
    assert "| **runs contradict each other** (`labels`, also `a`) |" in told
    left = fresh_claims(tmp_path).split("What would decide the others")[1]
    assert "C2" in left


@pytest.mark.parametrize(
    ("other", "agree"),
    [
        (Verdict.NEGLIGIBLE, True),
        (Verdict.SMALLER, True),
        (Verdict.OPPOSITE, True),
        (Verdict.HOLDS, False),
        (Verdict.MIXED, False),
    ],
)
def test_a_verdict_below_the_published_effect_bears_out_that_it_is_smaller(tmp_path, other, agree):
    publish_copy(tmp_path, "a", [("C2", "verdict_true", str(Verdict.LESS))], seed="1")
    publish_copy(tmp_path, "labels", [("C2", "verdict_true", str(other))], seed="2")
    assert is_decided(judged_fresh(tmp_path)["C2"]) == agree


def test_two_different_verdicts_below_the_published_effect_contradict_each_other(tmp_path):
    publish_copy(tmp_path, "a", [("C2", "verdict_true", str(Verdict.NEGLIGIBLE))], seed="1")
    publish_copy(tmp_path, "labels", [("C2", "verdict_true", str(Verdict.OPPOSITE))], seed="2")
    publish_copy(tmp_path, "c", [("C2", "verdict_true", str(Verdict.LESS))], seed="3")
    assert not is_decided(judged_fresh(tmp_path)["C2"])


def test_a_page_names_run_seed_verdicts_and_what_is_open(tmp_path, monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    every = [(c.id, "verdict_true", str(Verdict.HOLDS)) for c in claims_to_test()]
    labels = [change for change in every if change[0] in RUNS[0].claims]
    others = [(c.id, "verdict_true", str(Verdict.NOT_TESTABLE)) for c in claims_to_test()]
    publish_copy(tmp_path, "labels", [*others, *labels], seed="41")
    text = fresh_claims(tmp_path)
    assert "seed 41" in text
    assert f"{len(labels)} of them decided" in text
    left = text.split("What would decide the others")[1]
    assert "C7" in left
    assert "`controls`" in left
    assert "`labels`" not in left
    publish_copy(tmp_path, "rest", every, seed="42")
    assert "What would decide" not in fresh_claims(tmp_path)


def test_what_is_trained_asks_for_more_runs_and_what_is_counted_for_more_batches(tmp_path):
    open_ones = [(name, "verdict_true", str(Verdict.UNDECIDED)) for name in ("C1", "C4")]
    changes = [*open_ones, ("C1", "seeds", "3"), ("C4", "seeds", "")]
    publish_copy(tmp_path, "labels", changes, seed="1")
    left = fresh_claims(tmp_path).split("What would decide the others")[1].splitlines()
    (runs,) = (line for line in left if "more training runs per cell of `labels`" in line)
    assert "C1" in runs
    assert "C4" not in runs
    assert f"{planned_hours('labels', 'train'):.1f} hours" in runs
    assert "- C4: more batches than `labels` has." in left


def test_a_second_run_for_an_open_claim_is_listed_until_it_is_made(tmp_path):
    changes = [("C13", "verdict_true", str(Verdict.UNDECIDED))]
    publish_copy(tmp_path, "transfer", changes, seed="1")
    assert "profile `curves`" in fresh_claims(tmp_path)
    publish_copy(tmp_path, "curves", changes, seed="2")
    assert "profile `curves`" not in fresh_claims(tmp_path)


def test_a_claim_that_stays_open_is_listed_with_its_last_run_alone(tmp_path):
    changes = [(name, "verdict_true", str(Verdict.UNDECIDED)) for name in ("C10", "C13")]
    for seed, profile in enumerate(("transfer", "curves", "scratch"), start=1):
        publish_copy(tmp_path, profile, changes, seed=str(seed))
    left = fresh_claims(tmp_path).split("What would decide the others")[1].splitlines()
    (of_scratch,) = (line for line in left if "C10" in line)
    assert "training runs per cell of `scratch`" in of_scratch
    assert "C10 would not be run again" in of_scratch
    (of_curves,) = (line for line in left if "C13" in line)
    assert "training runs per cell of `curves`" in of_curves
    assert "again under" not in of_curves


# Table that a claim is about.
TABLES = {
    "C1": "table2_ground_truth",
    "C5": "table3_inconsistencies",
    "C6": "table3_inconsistencies",
    "C7": "table4_size",
    "C10": "table5_from_scratch",
    "C13": "table7_images_shown",
}
# Data set and start of the cells that a claim is judged by. C7 and C8 compare the smallest set with
# the largest, but also report how errors rank over all four.
SIZES = ("6k", "20k", "40k", "80k")
JUDGED_BY = {
    "C5": {("large_room", "6k", "pretrained")},
    "C7": {("large_room", size, "pretrained") for size in SIZES},
    "C8": {("sanctuary", size, "pretrained") for size in (*SIZES[:3], "95k")},
    "C10": {("large_room", size, init) for size in ("6k", "20k") for init in STARTS},
    "C11": {("large_room", "80k", init) for init in STARTS},
    "C12": {("large_room", size, init) for size in SIZES for init in STARTS},
    "C13": {
        ("large_room", "6k", f"{init}{share}")
        for init in STARTS
        for share in ("-quarter", "-half", "")
    },
}


def test_each_open_claim_has_a_run_with_the_rows_it_is_judged_by():
    assert {claim for run in RUNS for claim in run.claims} == {c.id for c in claims_to_test()}
    for run in RUNS:
        config = load_config(CONFIG / "config.yaml", CONFIG / f"{run.profile}.yaml")
        design = read_design(config)
        assert {TABLES[claim] for claim in run.claims if claim in TABLES} <= {*design.tables}
        cells = {(made.scene, made.size, made.init) for made in design.runs}
        for claim in run.claims:
            assert JUDGED_BY.get(claim, set()) <= cells, (run.profile, claim)


def test_hours_are_those_of_a_plan_from_the_published_runs(tmp_path):
    plan_text("labels", PLANNED_FROM, [2], tmp_path / "plan.csv")
    costs = pd.read_csv(tmp_path / "plan.csv").set_index("name").cpu_s
    assert planned_hours("labels") == pytest.approx(costs["total"] / 3600, rel=1e-3)
    assert planned_hours("labels", "train") == pytest.approx(costs["train"] / 3600, rel=1e-3)


def test_published_runs_are_read_where_pages_are_made(monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    assert fresh_claims(PUBLISHED)
