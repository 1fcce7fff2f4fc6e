"""Claims on results where the truth is known: the paper's own numbers, and constructed ones."""

import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from baselines.config.learning import MODELS
from reproduction.claims import untrained
from reproduction.claims.judging import JUDGES
from reproduction.claims.rules import frozen_rules
from reproduction.claims.table import claims_markdown, verdict_counts, write_claims
from reproduction.claims.verdicts import GROUPS, Verdict, published_claims
from synfeal.dataset.pose_table import write_pose_table
from synfeal.errors import InputError
from synfeal.records.tables import read_records
from tests.support import claims_results as made
from tests.support.claims_results import (
    AXES,
    assisted,
    collected_at,
    curves,
    first_paths,
    lend,
    put,
)
from tests.support.report_results import design_of, experiment, fill_assistance

HOLDS, SMALLER, MIXED, NEGLIGIBLE, LESS, OPPOSITE, REFUTED, UNDECIDED, *_ = Verdict
NOT_LEARNT, UNTESTED, BY_CONSTRUCTION = [*Verdict][-3:]


@pytest.fixture(autouse=True)
def _tracker_that_reaches_metres(monkeypatch):
    """Frames of these results lie metres apart, and single runs vary no further."""
    monkeypatch.setattr(untrained, "FARTHEST_M", np.inf)
    lend(monkeypatch, 0.0)


@pytest.fixture(scope="module")
def paper(tmp_path_factory):
    return made.papers_results(tmp_path_factory.mktemp("paper"))


@pytest.fixture
def results(paper, tmp_path):
    """A copy of them, to change: links, as every writer replaces its file."""
    shutil.copytree(paper.root, tmp_path, dirs_exist_ok=True, copy_function=os.link)
    return replace(paper, root=tmp_path)


def verdicts(row):
    return row["verdict_labels"], row["verdict_true"]


# By claim, on the paper's own numbers: the verdict of both scores, and what is measured.
OF_THE_PAPER = {
    "C1": (HOLDS, "lowest in 10 of 10 columns; sign tests: SfM 10 of 10 lower (p = 0.00195)"),
    "C2": (HOLDS, "p -54.8 %, o -59.6 %"),  # 0.14 / 0.31, 6.70 / 16.57
    # In position labels gain 54.8 % and the model 51.7 %: 0.14 / 0.29. In orientation the model
    # gains 6.70 / 8.02, which is -16.5 % and not the printed -32 %.
    "C3": (MIXED, "labels p -54.8 %, o -59.6 %; model p -51.7 %, o -16.5 %"),
    "C4": (HOLDS, "SfM 3 of 34"),
    "C5": (HOLDS, ""),
    "C6": (HOLDS, "p +64.1 %, o +78.7 % (over clean p +178.6 %, o +370.1 %)"),
    # Kendall's tau by hand. PoseNet: 0.29 0.25 0.25 0.20 has one tie, 8.02 7.05 5.73 4.01 none;
    # PoseNet2ResNet's orientation: 9.74 8.54 7.22 8.02 has one pair the other way, (1 - 5) / 6.
    "C7": (HOLDS, "p -49.6 %, o -34.6 %", "PoseNet -0.91/-1.00", "PoseNet2ResNet -1.00/-0.67"),
    "C8": (HOLDS, "p -71.9 %, o -74.9 %"),
    "C9": (UNTESTED, "p 0.70 m RMS, o 34.82°"),
    "C10": (MIXED, "20 of 20 worse from scratch"),  # from 7.05 to 7.34 degrees is 4.1 %
    "C11": (HOLDS, "3 of 5 (PoseLSTM, PoseNet2ResNet, PoseNet2)"),
    "C12": (HOLDS, "lowest orientation: PoseNet, transfer learning, 80k, p 0.20 m RMS, o 4.01°"),
    "C13": (HOLDS, "+54 % images"),  # mean change of Table 5 at 6k, as errors fall with 1 / images
    "C14": (HOLDS, "Large Room 5.1 frames/s"),  # harmonic mean of 5.0 and 5.2
    "C15": (HOLDS, ""),
    "C16": (BY_CONSTRUCTION, "Large Room 14.03, Sanctuary 28.76"),
}


def test_the_papers_own_numbers_have_the_verdicts_and_statistics_they_should(paper, tmp_path):
    for name in ("a.csv", "b.csv"):
        write_claims(design_of(paper.design), paper.root, 12, tmp_path / name)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    rows = {row["id"]: row for _, row in read_records(tmp_path / "a.csv")}
    assert list(rows) == list(OF_THE_PAPER) == list(JUDGES) == [c.id for c in published_claims()]
    for claim, (verdict, *measured) in OF_THE_PAPER.items():
        assert verdicts(rows[claim]) == (verdict, verdict), claim
        assert all(text in rows[claim]["measured_labels"] for text in measured), claim
        assert rows[claim]["measured_true"] == rows[claim]["measured_labels"]
    files = {claim: [*filter(None, row["evidence"].split(";"))] for claim, row in rows.items()}
    assert all((paper.root / file).is_file() for named in files.values() for file in named)
    own = ("kinect-fusion/assistance.json", "synfeal/train.csv", "synfeal/test.csv")
    assert files["C15"] == [f"labels/large_room/6k/{name}" for name in own]
    # 20 cells on two test sets, with their true labels and three of others; 40 cells, 4 data sets.
    assert (len(files["C1"]), len(files["C12"])) == (48, 48)
    assert {row["rules"] for row in rows.values()} == {frozen_rules().tag}
    assert {row["seed"] for row in rows.values()} == {"12"}
    assert (rows["C1"]["seeds"], rows["C16"]["seeds"]) == ("1", "")
    assert "as in the published runs" in rows["C1"]["limits_of"]
    # Labels are 4 cm off; Table 2 prints 0.14 m and 6.70 degrees for PoseNet2.
    dose = "SfM 4.0 cm/0.0°; of localizers trained on exact labels 24 cm/6.7°"
    assert rows["C2"]["dose"].endswith(dose)
    # Of the published -35 % three quarters are -26 %, of -55 % -41 %; "few" of 3 and 6 in 34.
    assert {rows[i]["sensitivity_true"] for i in ("C2", "C5", "C7")} == {"none"}
    assert rows["C4"]["sensitivity_true"] == "few: a quarter: undecided"
    counts = verdict_counts(list(rows.values()), "true")
    assert [sum(counts[group].values()) for group in GROUPS] == [7, 7, 2]
    assert counts["set-up"] == {HOLDS: 1, BY_CONSTRUCTION: 1}
    lines = claims_markdown(list(rows.values())).splitlines()
    assert {line.count("|") for line in lines if line.startswith("|")} == {8}
    (line,) = [line for line in lines if line.startswith("| C7 |")]
    assert "| p -50 %, o -35 % | p -49.6 %, o -34.6 % | **holds** | the same | **holds** |" in line
    assert any(line.startswith("- C3: The printed o -32 %") for line in lines)


SFM, TORO = {"labels": "sfm"}, {"labels": "rgbd-toro"}
CLEAN = {"labels": "synfeal", "size": "6k"}
NOISIEST = {"labels": "noise", "noise_m": 0.3, "noise_deg": 20}
SCRATCH = {"size": "80k", "init": "scratch"}
INF, NAN = np.inf, np.nan
# Changes of the paper's results; by claim one verdict or that of either score, and parts of
# " | reason | measured | limits | ".
# fmt: off
CHANGES = [
    # Against its labels SfM is the worst, against the true poses the best.
    ([put(SFM, MODELS, 0.9, 50.0, true=(0.01, 0.1))],
     {"C1": ([HOLDS, MIXED], "true: opposite: SfM position, SfM orientation; holds: RGB-D"),
      "C2": ([HOLDS, OPPOSITE],)}),
    # One refuted comparison of thirty is enough: 0.20 m with simulator labels. Better from scratch
    # means in both errors: with transfer learning 0.09 m, 4.30 degrees.
    ([put(TORO, ["hourglass"], 0.18, 14.33), put(SCRATCH, ["hourglass"], 0.05, 5.73)],
     {"C1": ([MIXED], "; single ones opposite: Hourglass with RGB-D SLAM w/ TORO position",
             "lowest in 9 of 10 columns", "TORO 9 of 10 lower (p = 0.0215)"),
      "C11": ([HOLDS], " | 3 of 5 (PoseLSTM")}),
    # Better on seven paths of twelve, however many frames these have; 0.15 m, 4.47 degrees.
    ([put(CLEAN, ["posenet2"], first_paths(7, 0.14, 0.4), first_paths(7, 6.70, 20.0)),
      put(SCRATCH, ["poselstm"], 0.14, 4.50)],
     {"C2": ([UNDECIDED], " | p -54.8 %, o -59.6 % | "),
      "C11": ([OPPOSITE], " | 2 of 5 (PoseNet2ResNet, PoseNet2) | ")}),
    # -30 % for -55 % in one of both errors.
    ([put(SFM, ["posenet2"], 0.20, 20.0)],
     {"C2": ([MIXED], f" | position: {SMALLER}, orientation: holds | ")}),
    # Labels that change nothing.
    ([put(keys, ["posenet2"], 0.143, 6.60) for keys in (SFM, NOISIEST)],
     {"C2": ([NEGLIGIBLE],), "C6": ([NEGLIGIBLE],)}),
    # Failed runs lose; of failed paths the median is that of the rest, made worse by them.
    ([put(CLEAN, ["posenet"], NAN, NAN), *(put(k, ["posenet2"], INF, INF) for k in (SFM, CLEAN))],
     {"C1": ([NOT_LEARNT], "PoseNet, 6k: position error inf %"),
      "C2": ([NOT_LEARNT], " | p unknown, o unknown | ")}),
    ([put(CLEAN, ["posenet"], first_paths(5, INF, 0.1 / AXES), first_paths(5, INF, 1.0))],
     {"C1": ([NOT_LEARNT], "in 10 of 10")}),
    # Learning curves from scratch that need so many times the images; of 17 batches so many
    # assisted; and every part of a collection has to reach the rate, and the rooms to agree.
    ([curves(1.6), assisted(g2o=0, kinect=16), collected_at(9.0, 7.0)],
     {"C13": ([HOLDS], " | +60 % images"), "C4": ([HOLDS], "SfM 0 of 17"),
      "C15": ([HOLDS], " | 16 of 17 batches assisted | "),
      "C14": ([HOLDS], "7.0 to 9.0", "on Abacus 9, 2 usable cores")}),
    ([curves(1.2), assisted(g2o=3, kinect=8), collected_at(4.9, 5.1)],
     {"C13": ([SMALLER], " | +20 % images"), "C4": ([UNDECIDED],), "C15": ([UNDECIDED],),
      "C14": ([MIXED], "4.9 to 5.1")}),
    ([curves(1.0), assisted(g2o=15, kinect=1), collected_at(4.0, 4.5)],
     {"C13": ([NEGLIGIBLE], " | +0 % images"), "C4": ([OPPOSITE],), "C15": ([OPPOSITE],),
      "C14": ([MIXED], "4.0 to 4.5")}),
    ([curves(0.8), put({"scene": "sanctuary", "size": "6k"}, MODELS, 0.4, 20.0)],
     {"C13": ([OPPOSITE], " | -20 % images"), "C9": ([UNTESTED],)}),
    ([curves(1.6, falls=-0.1)], {"C13": ([UNDECIDED],)}),
]
# fmt: on


@pytest.mark.parametrize(("changes", "expected"), CHANGES)
def test_a_change_of_the_results_has_the_verdicts_it_should(results, changes, expected):
    for change in changes:
        change(results)
    rows = results.rows()
    for claim, (scores, *texts) in expected.items():
        assert verdicts(rows[claim]) == (scores[0], scores[-1]), claim
        said = (rows[claim][key] for key in ("reason", "measured_labels", "interval_labels"))
        text = " | ".join(["", *said, ""])
        assert all(part in text for part in texts), text


def test_batches_of_further_scenes_stand_beside_few_and_count_for_kinectfusion(results):
    results.more_scenes = ("sanctuary",)
    fill_assistance(results.root, {"sfm": 4, "kinect-fusion": 8}, batches=(17, 0))
    others = {"sfm": 1, "rgbd-toro": 0, "rgbd-g2o": 0, "kinect-fusion": 1}
    fill_assistance(results.root, others, batches=(17, 0), scene="sanctuary")
    rows = results.rows()
    assert "SfM 4 of 17 (not judged: Sanctuary 1 of 17)" in rows["C4"]["measured_labels"]
    # Clopper-Pearson of 4 in 17 at 90 %, as tabulated; of 9 in 34 at 95 %.
    assert "SfM 8 to 46 %" in rows["C4"]["interval_labels"]
    assert verdicts(rows["C15"]) == (OPPOSITE, OPPOSITE)
    assert rows["C15"]["interval_labels"] == "13 to 44 %"
    assert "labels/sanctuary/6k/kinect-fusion/assistance.json" in rows["C15"]["evidence"]


def test_a_newer_model_that_is_worse_does_not_make_labels_matter_more(results):
    """PoseNet2 gains 20 % from better labels, and is 20 % worse than PoseNet."""
    put(SFM, ["posenet2"], 0.25, 12.5)(results)
    put(CLEAN, ["posenet2"], 0.20, 10.0)(results)
    put(CLEAN, ["posenet"], 0.1667, 8.333)(results)
    row = results.rows()["C3"]
    assert "opposite: newer model, position, newer model, orientation" in row["reason"]
    assert verdicts(row) == (MIXED, MIXED)


def test_single_runs_are_judged_as_uncertainly_as_published_ones_vary(results, monkeypatch):
    """Two thirds of a published fall of 55 % are 36.7 %: a fall of 45 % holds unless runs vary.

    With 16 degrees of freedom t is 2.12, so that a ratio of two runs of 20 % each has limits of
    about 0.55 times or over 2.12 root 2 times 20 %, far beyond.
    """
    put(SFM, ["posenet2"], 0.14 / 0.55, 6.70 / 0.4)(results)
    assert results.rows()["C2"]["verdict_true"] == HOLDS
    lend(monkeypatch, 0.01)
    assert results.rows()["C2"]["verdict_true"] == HOLDS
    lend(monkeypatch, 0.2)
    assert results.rows()["C2"]["verdict_true"] == UNDECIDED


def test_what_cannot_be_judged_says_why_and_the_rest_is_judged(results, tmp_path, monkeypatch):
    kept = tuple(r for r in results.design if r.size != "80k" and r.labels != "sfm")
    rows = made.Results(results.root, design=kept).rows()
    untested = [claim for claim, row in rows.items() if row["verdict_labels"] == UNTESTED]
    assert untested == ["C1", "C2", "C3", "C4", "C7", "C9", "C11", "C12"]
    assert rows["C7"]["reason"] == "this profile has no row large_room 80k synfeal pretrained"
    assert rows["C7"]["evidence"] == rows["C7"]["measured_labels"] == ""
    other = experiment("table4_size", scene="workshop")
    found = made.Results(tmp_path / "workshop", design=(other,)).rows().values()
    assert all(row["verdict_true"] == UNTESTED and row["reason"] for row in found)
    monkeypatch.setattr(untrained, "FARTHEST_M", 0.04)
    row = results.rows()["C15"]
    assert (row["verdict_true"], "cm apart" in row["reason"]) == (UNTESTED, True)
    rows = made.papers_results(tmp_path / "short", n_paths=9).rows()
    assert verdicts(rows["C1"]) == (UNDECIDED, UNDECIDED)
    assert rows["C1"]["reason"].startswith("a test set has 9 paths, fewer than 10")
    assert rows["C16"]["verdict_labels"] == BY_CONSTRUCTION  # no localizer, no paths


ERRORS = "runs/large_room/6k/sfm/pretrained/posenet2/seed0/errors.csv"
MISSING = (
    *(ERRORS, "runs/large_room/6k/synfeal/scratch-half/posenet/seed0/common_errors.csv"),
    *("labels/large_room/6k/synfeal/train.csv", "labels/large_room/6k/rgbd-toro/assistance.json"),
    *("scenes/sanctuary/properties.json", "scenes/large_room/collection_speed.json"),
)


@pytest.mark.parametrize(
    ("name", "damage", "message"),
    [
        *((name, None, "missing") for name in MISSING),
        (ERRORS, lambda text: text[: text.rindex("\n", 0, -1) + 1], "its frames are not those of"),
    ],
)
def test_a_result_that_cannot_be_read_is_an_error_and_no_verdict(results, name, damage, message):
    path = results.root / name
    text = path.read_text()
    path.unlink()  # it is a link
    if damage is not None:
        path.write_text(damage(text))
    with pytest.raises(InputError, match=message) as refusal:
        results.rows()
    assert str(path) in str(refusal.value)


def test_a_claim_is_judged_on_the_common_test_set_unless_it_is_about_labels(tmp_path):
    """Six long paths at 6k, the first of the eighteen at 80k; errors tell which were read."""
    results = made.papers_results(tmp_path, n_paths=18)
    small = results.table.first(18)
    for path in tmp_path.glob("labels/*/6k/synfeal/test.csv"):
        write_pose_table(path, small)
    runs = tmp_path / "runs"
    for path in (*runs.glob("*/6k/*/*/*/*/errors.csv"), *runs.rglob("common_errors.csv")):
        header, *lines = path.read_text().splitlines(keepends=True)
        kept = lines[::3] if path.name.startswith("common") else lines[: len(small)]
        path.write_text("".join([header, *kept]))
    rows = results.rows()
    expected = dict.fromkeys(("C1", "C2", "C3", "C5", "C6"), "6")
    expected |= dict.fromkeys(("C7", "C8", "C9", "C10", "C11", "C12"), "18")
    assert {claim: rows[claim]["test_paths_labels"] for claim in expected} == expected
    assert {rows[claim]["test_paths_true"] for claim in expected} == {"18"}
    assert rows["C2"]["verdict_labels"] == UNDECIDED  # six paths decide nothing
    assert rows["C2"]["verdict_true"] == rows["C7"]["verdict_labels"] == HOLDS


def test_nothing_learnt_at_chance_level_is_a_verdict_on_labels_or_models(tmp_path):
    """Tables 2 and 3 as 300 frames gave them: every localizer about as good as the mean pose."""
    found = made.chance_results(tmp_path).rows()
    ids = ("C1", "C2", "C3", "C5", "C6")
    assert {verdicts(found[i]) for i in ids} == {(NOT_LEARNT, NOT_LEARNT)}
    assert "of the mean pose's" in found["C2"]["reason"]
