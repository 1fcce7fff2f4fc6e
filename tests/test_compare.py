"""``synfeal compare`` on small result trees whose errors are known."""

import json
import re

import numpy as np
import pytest
from PIL import Image

from synfeal.cli import main
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.files import write_json
from synfeal.frames import read_records
from synfeal.report.compare.run import OUTPUTS, remarks_of
from synfeal.report.compare.trees import compare_trees, groups_of, one_yardstick, summary_of
from synfeal.report.stats import MEASURES
from tests.compare_trees import (
    BETTER,
    FAILED,
    LABEL_OFFSET_M,
    LABELS,
    MODELS,
    RUN,
    SAME,
    N,
    poses,
    write_tree,
)


@pytest.fixture(scope="module")
def error_m():
    return np.random.default_rng(0).uniform(1, 2, N)


@pytest.fixture
def trees(tmp_path, error_m):
    """B: PoseNet 0.5 m better, PoseLSTM as before, Hourglass without a finite prediction."""
    a = write_tree(tmp_path / "a", dict.fromkeys(MODELS, error_m))
    changed = {BETTER: error_m - 0.5, SAME: error_m, FAILED: np.full(N, np.nan)}
    return a, write_tree(tmp_path / "b", changed)


@pytest.fixture
def pair(tmp_path, error_m):
    """The same tree twice."""
    return write_tree(tmp_path / "a", {BETTER: error_m}), write_tree(
        tmp_path / "b", {BETTER: error_m}
    )


def by_run(comparison):
    """Rows of the table by label source, model and measure."""
    return comparison.table.set_index(["labels", "model", "measure"])


def refusal(capsys, *arguments):
    """What the command says when it refuses, on one line and with status 1."""
    assert main(["compare", *map(str, arguments)]) == 1
    message = capsys.readouterr().err
    assert message.startswith("error: ")
    assert message.count("\n") == 1
    return message


def test_known_changes_are_found_against_both_yardsticks_counted_and_averaged(trees, error_m):
    comparison = compare_trees(*trees)
    assert (comparison.table[["test_frames", "test_labels"]] == "same").all(axis=None)
    runs = [run for _, run in comparison.table.groupby(["labels", "model"], sort=False)]
    assert [one_yardstick(run) for run in runs] == [False] * 3 + [True] * 3
    found = by_run(comparison)
    for labels, offset_m in zip(LABELS, (0, LABEL_OFFSET_M), strict=True):
        for measure, extra_m in (("position_m", offset_m), ("position_m_true", 0)):
            better = found.loc[labels, BETTER, measure]
            assert better.a == pytest.approx(np.median(error_m) + extra_m)
            assert [better.low, better.difference, better.high] == pytest.approx([-0.5] * 3)
            verdicts = [found.loc[labels, model, measure].verdict for model in MODELS]
            assert verdicts == ["better", "no difference seen", "worse"]
        assert found.loc[labels, SAME, "position_m"].difference == 0
    summary = summary_of(compare_trees(*trees).table).set_index("measure")
    position, orientation = summary.loc["position_m"], summary.loc["orientation_deg"]
    assert (position.better, position.worse, position.unseen) == (2, 2, 2)
    assert (position.lower, position.higher, position.p_sign) == (2, 2, 1.0)
    assert (orientation.lower, orientation.higher) == (0, 2)
    assert orientation.p_sign == pytest.approx(0.5)  # two of two heads or two of two tails
    groups = groups_of(compare_trees(*trees).table).set_index(["grouping", "name"])
    assert {g: n for g, n in groups.n_runs.items() if g[0] != "model"} == {
        ("scene", "room"): 6,
        ("labels", "synfeal"): 3,
        ("labels", "sfm"): 3,
    }
    median = float(np.median(error_m))
    shares = [-50 / median, -50 / (median + LABEL_OFFSET_M)]
    better = groups.loc["model", BETTER]
    assert better["position_m"] == pytest.approx(np.mean(shares))
    assert better["position_m_true"] == pytest.approx(shares[0])
    assert groups.loc["model", FAILED]["position_m"] == np.inf
    assert (groups.loc["model", SAME][list(MEASURES)] == 0).all()


def test_other_test_paths_and_a_missing_plan_are_said_and_not_paired(pair):
    plan = pair[1] / "plans/room/test.csv"
    write_pose_table(plan, poses(0.5))
    comparison = compare_trees(*pair)
    assert set(comparison.runs.test_frames) == {"differ"}
    assert (comparison.runs.low < 0).all()
    assert (comparison.runs.high > 0).all()
    assert "in 2 the test frames differ" in remarks_of(comparison)[1]
    (pair[0] / "plans/room/test.csv").unlink()
    assert not (comparison.runs.test_frames == "same").any()
    assert "paired in 0 of 2 runs" in remarks_of(comparison)[1]


def test_other_labels_are_said_and_frames_still_paired(pair):
    write_pose_table(pair[1] / "labels/room/6k/sfm/test.csv", poses(-3.0))
    comparison = compare_trees(*pair)
    assert comparison.runs.test_labels.tolist() == ["differ", "same"]
    assert (comparison.runs.test_frames == "same").all()
    assert any(
        text.startswith("Runs with other test labels in B: 1;") for text in remarks_of(comparison)
    )


def test_several_seeds_are_averaged(tmp_path, error_m):
    a = write_tree(tmp_path / "a", {BETTER: error_m}, seeds=3)
    b = write_tree(tmp_path / "b", {BETTER: error_m}, seeds=1)
    found = by_run(compare_trees(a, b)).loc["sfm", BETTER, "position_m_true"]
    assert (found.n_seeds_a, found.n_seeds_b) == (3, 1)
    assert found.difference == pytest.approx(-0.01)
    assert found.sd_a == pytest.approx(0.01)


def test_runs_of_one_tree_only_are_counted(tmp_path, error_m):
    a = write_tree(tmp_path / "a", dict.fromkeys((BETTER, SAME), error_m))
    b = write_tree(tmp_path / "b", dict.fromkeys((BETTER, FAILED, "posenet2"), error_m))
    comparison = compare_trees(a, b)
    assert (len(comparison.runs), comparison.only) == (2, (2, 4))


def test_provenance_that_differs_is_printed(pair, capsys):
    for root, rate in zip(pair, (0.1, 0.2), strict=True):
        value = {"config": {"training": {"rate": rate, "kept": 1}}, f"only_{root.name}": "x"}
        value["files"] = {"summary.md": root.name}  # an outcome, no cause
        write_json(root / "provenance.json", value)
    assert main(["compare", *map(str, pair)]) == 0
    printed = capsys.readouterr().out
    rows = [line.split() for line in printed.splitlines()[-3:]]
    assert rows == [
        ["config.training.rate", "0.1", "0.2"],
        ["only_a", '"x"', "(none)"],
        ["only_b", "(none)", '"x"'],
    ]
    assert "Keys of provenance.json that differ: 3." in printed


def test_files_and_columns_agree_and_are_written_again_alike(trees, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["compare", *map(str, trees), "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == sorted(OUTPUTS)
    first = {name: (out / name).read_bytes() for name in OUTPUTS}
    rows = [row for _, row in read_records(out / "compare.csv")]
    assert len(rows) == 6 * len(MEASURES)
    failed = next(r for r in rows if (r["model"], r["labels"]) == (FAILED, "sfm"))
    assert (failed["b"], failed["verdict"], failed["failed_b"]) == ("inf", "worse", str(N))
    page = first["compare.md"].decode()
    failures = re.findall(r"\| +failed \|", page)
    assert len(failures) == 3 * 2  # one yardstick of synfeal, two of sfm, two errors
    with Image.open(out / "compare.png") as picture:
        assert picture.width == 1650
    assert main(["compare", *map(str, trees), "--out", str(out)]) == 0
    assert first == {name: (out / name).read_bytes() for name in OUTPUTS}
    assert "failed" in capsys.readouterr().out
    assert main(["compare", *map(str, trees)]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("data set"))
    ends = lines[start].index("position A") + len("position A")
    rows = [line for line in lines[start + 1 : start + 12] if line.startswith("   ")]
    assert rows
    assert all(line[ends - 1] != " " and line[ends] == " " for line in rows)


def test_foreign_files_are_left_alone_and_what_is_no_tree_is_refused(pair, tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    assert "notes.txt" in refusal(capsys, *pair, "--out", out)
    assert [path.name for path in out.iterdir()] == ["notes.txt"]
    assert "is a file" in refusal(capsys, *pair, "--out", out / "notes.txt")
    assert "not a results tree" in refusal(capsys, pair[0], tmp_path / "nowhere")
    assert "not a results tree" in refusal(capsys, pair[0] / "runs", pair[1])
    other = write_tree(tmp_path / "other", {SAME: np.ones(N)})
    assert "no run in common" in refusal(capsys, pair[0], other)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("errors.csv", None, "errors.csv: cannot be read"),
        ("errors.csv", "frame\n0\n", "errors.csv: header must be"),
        ("errors.csv", f"frame,{','.join(MEASURES)}\n0,1,1,1,1\n", "not those of predictions"),
        ("predictions.csv", None, "predictions.csv: cannot be read"),
        ("metrics.json", "{", "metrics.json: cannot be read as JSON"),
        ("metrics.json", "{}", "metrics.json: n_train"),
    ],
)
def test_broken_files_are_named(pair, tmp_path, capsys, name, content, message):
    path = pair[1] / RUN / name
    path.unlink()
    if content is not None:
        path.write_text(content)
    assert message in refusal(capsys, *pair, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_scores_of_other_errors_and_seeds_of_other_frames_are_refused(
    pair, capsys, tmp_path, error_m
):
    path = pair[1] / RUN / "metrics.json"
    metrics = json.loads(path.read_text())
    write_json(path, metrics | {"orientation_deg_true": 1.5})
    assert "orientation_deg_true is 1.5" in refusal(capsys, *pair)
    a = write_tree(tmp_path / "a", {BETTER: error_m}, seeds=2)
    path = a / RUN / "predictions.csv"
    write_pose_table(path, read_pose_table(path).first(N - 1))
    assert "other frames" in refusal(capsys, a, a)
