"""``synfeal compare`` on small result trees whose errors are known."""

import re

import numpy as np
import pytest
from PIL import Image

from baselines.training.score import score_run
from reproduction.compare.run import OUTPUTS, remarks_of
from reproduction.compare.trees import compare_trees, groups_of, one_yardstick, summary_of
from reproduction.statistics.limits import MEASURES
from synfeal.cli import main
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.records.files import read_json, write_json
from synfeal.records.tables import read_records
from tests.support.collected import refused

N = 40
BETTER, SAME, FAILED = MODELS = ("posenet", "poselstm", "hourglass")
LABELS_M = {"synfeal": 0.0, "sfm": -2.0}  # where the labels lie along x
RUN = "runs/room/6k/synfeal/pretrained/posenet/seed0"
ERROR_M = np.random.default_rng(0).uniform(1, 2, N)


def poses(x_m):
    position_m, index = np.zeros((N, 3)), np.arange(N)
    position_m[:, 0] = x_m
    return PoseTable(index, index // 4, position_m, np.tile([1.0, 0, 0, 0], (N, 1)))


def write_tree(root, error_m, seeds=1):
    """True poses at the origin, SfM labels 2 m to the left, predictions ``error_m`` to the right.

    So errors are ``error_m`` against the true poses, and 2 m more against SfM's labels.
    """
    truth = root / "plans/room/test.csv"
    write_pose_table(truth, poses(0.0))
    for labels, x_m in LABELS_M.items():
        carried = root / f"labels/room/6k/{labels}/test.csv"
        write_pose_table(carried, poses(x_m))
        for model, values in error_m.items():
            for seed in range(seeds):
                out = root / f"runs/room/6k/{labels}/pretrained/{model}/seed{seed}"
                write_pose_table(out / "predictions.csv", poses(values + 0.01 * seed))
                files = (out / "predictions.csv", carried, truth, carried)
                score_run(*files, out / "errors.csv", out / "metrics.json", {})
    return root


@pytest.fixture
def trees(tmp_path):
    """B: PoseNet 0.5 m better, PoseLSTM as before, Hourglass without a finite prediction."""
    changed = {BETTER: ERROR_M - 0.5, SAME: ERROR_M, FAILED: np.full(N, np.nan)}
    a = write_tree(tmp_path / "a", dict.fromkeys(MODELS, ERROR_M))
    return a, write_tree(tmp_path / "b", changed)


@pytest.fixture
def pair(tmp_path):
    """The same tree twice."""
    return [write_tree(tmp_path / name, {BETTER: ERROR_M}) for name in "ab"]


def by_run(comparison):
    """Rows of the table by label source, model and measure."""
    return comparison.table.set_index(["labels", "model", "measure"])


def test_known_changes_are_found_against_both_yardsticks_counted_and_averaged(trees):
    comparison = compare_trees(*trees)
    assert (comparison.table[["test_frames", "test_labels"]] == "same").all(axis=None)
    runs = [run for _, run in comparison.table.groupby(["labels", "model"], sort=False)]
    assert [one_yardstick(run) for run in runs] == [False] * 3 + [True] * 3
    found = by_run(comparison)
    median = float(np.median(ERROR_M))
    for labels, x_m in LABELS_M.items():
        for measure, extra_m in (("position_m", -x_m), ("position_m_true", 0)):
            better = found.loc[labels, BETTER, measure]
            assert better.a == pytest.approx(median + extra_m)
            assert better.difference == pytest.approx(-0.5)
            assert better.low + better.high == pytest.approx(-1.0)  # of seeds alone
            verdicts = [found.loc[labels, model, measure].verdict for model in MODELS]
            assert verdicts == ["better", "no difference seen", "worse"]
        assert found.loc[labels, SAME, "position_m"].difference == 0
    summary = summary_of(comparison.table).set_index("measure")
    position, orientation = summary.loc["position_m"], summary.loc["orientation_deg"]
    assert (position.better, position.worse, position.unseen) == (2, 2, 2)
    assert (position.lower, position.higher, position.p_sign) == (2, 2, 1.0)
    assert (orientation.lower, orientation.higher) == (0, 2)
    assert orientation.p_sign == pytest.approx(0.5)  # two of two heads or two of two tails
    groups = groups_of(comparison.table).set_index(["grouping", "name"])
    found = {g: n for g, n in groups.n_runs.items() if g[0] != "model"}
    assert found == {("scene", "room"): 6, ("labels", "synfeal"): 3, ("labels", "sfm"): 3}
    shares = [-50 / median, -50 / (median + 2)]
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
    assert set(comparison.runs.verdict) == {"no difference seen"}
    assert "in 2 the test frames differ" in remarks_of(comparison)[1]
    (pair[0] / "plans/room/test.csv").unlink()
    assert not (comparison.runs.test_frames == "same").any()
    assert "paired in 0 of 2 runs" in remarks_of(comparison)[1]


def test_other_labels_are_said_and_frames_still_paired(pair):
    write_pose_table(pair[1] / "labels/room/6k/sfm/test.csv", poses(-3.0))
    comparison = compare_trees(*pair)
    assert comparison.runs.test_labels.tolist() == ["differ", "same"]
    assert (comparison.runs.test_frames == "same").all()
    assert "Runs with other test labels in B: 1;" in "".join(remarks_of(comparison))


def test_seeds_are_averaged_and_runs_of_one_tree_only_counted(tmp_path):
    a = write_tree(tmp_path / "a", dict.fromkeys((BETTER, SAME), ERROR_M), seeds=3)
    b = write_tree(tmp_path / "b", dict.fromkeys((BETTER, FAILED, "posenet2"), ERROR_M))
    comparison = compare_trees(a, b)
    assert (len(comparison.runs), comparison.only) == (2, (2, 4))
    found = by_run(comparison).loc["sfm", BETTER, "position_m_true"]
    assert (found.n_seeds_a, found.n_seeds_b) == (3, 1)
    assert found.difference == pytest.approx(-0.01)
    assert found.sd_a == pytest.approx(0.01)


def test_provenance_that_differs_is_printed(pair, capsys):
    for root, rate in zip(pair, (0.1, 0.2), strict=True):
        value = {"config": {"training": {"rate": rate, "kept": 1}}, f"only_{root.name}": "x"}
        value["files"] = {"summary.md": root.name}  # an outcome, no cause
        write_json(root / "provenance.json", value)
    assert main(["compare", *map(str, pair)]) == 0
    printed = capsys.readouterr().out
    rows = [line.split() for line in printed.splitlines()[-3:]]
    assert rows[0] == ["config.training.rate", "0.1", "0.2"]
    assert rows[1:] == [["only_a", '"x"', "(none)"], ["only_b", "(none)", '"x"']]


def test_files_and_columns_agree_and_are_written_again_alike(trees, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["compare", *map(str, trees), "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == sorted(OUTPUTS)
    first = {name: (out / name).read_bytes() for name in OUTPUTS}
    rows = [row for _, row in read_records(out / "compare.csv")]
    assert len(rows) == 6 * len(MEASURES)
    failed = next(r for r in rows if (r["model"], r["labels"]) == (FAILED, "sfm"))
    assert (failed["b"], failed["verdict"], failed["failed_b"]) == ("inf", "worse", str(N))
    failures = re.findall(rb"\| +failed \|", first["compare.md"])
    assert len(failures) == 3 * 2  # one yardstick of synfeal, two of sfm, two errors
    with Image.open(out / "compare.png") as picture:
        assert picture.width == 1650
    capsys.readouterr()
    assert main(["compare", *map(str, trees), "--out", str(out)]) == 0
    assert first == {name: (out / name).read_bytes() for name in OUTPUTS}
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
    other = write_tree(tmp_path / "other", {SAME: np.ones(N)})
    for arguments, words in (
        ((*pair, "--out", out), "notes.txt"),
        ((*pair, "--out", out / "notes.txt"), "is a file"),
        ((pair[0] / "runs", pair[1]), "not a results tree"),
        ((pair[0], other), "no run in common"),
    ):
        assert words in refused(capsys, "compare", *arguments)
    assert [path.name for path in out.iterdir()] == ["notes.txt"]


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
    assert message in refused(capsys, "compare", *pair, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_scores_of_other_errors_and_seeds_of_other_frames_are_refused(pair, capsys, tmp_path):
    path = pair[1] / RUN / "metrics.json"
    write_json(path, read_json(path) | {"orientation_deg_true": 1.5})
    assert "orientation_deg_true is 1.5" in refused(capsys, "compare", *pair)
    a = write_tree(tmp_path / "a", {BETTER: ERROR_M}, seeds=2)
    path = a / RUN / "predictions.csv"
    write_pose_table(path, read_pose_table(path).first(N - 1))
    assert "other frames" in refused(capsys, "compare", a, a)
