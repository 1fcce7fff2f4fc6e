"""Rankings by labels against rankings by the truth, made by hand or known in closed form."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import kendalltau

from baselines.config.learning import MODELS
from baselines.config.references import ReferencesConfig
from reproduction.design.ranking import ranked_sets, rankings
from reproduction.figures.label_ranking import label_ranking
from reproduction.report.html.tables import side_html
from reproduction.statistics.ranking import agreement, pair_orders, sure_order, tau_b
from reproduction.tables.columns import side_sheet
from reproduction.tables.label_ranking import (
    THRESHOLDS,
    TITLES,
    read_label_ranking,
    rightly_from,
    sample_of,
    side_layout,
)
from reproduction.tables.side import write_side_table
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.errors import InputError
from synfeal.evaluation.metrics import draws
from tests.support.report_results import design_of, experiment, run_folder

IMAGES = ReferencesConfig(groups=("images",))
ALONE = ReferencesConfig(groups=())
N_PATHS, FRAMES_OF_PATH = 12, 5
OFFSET_M = 0.30  # of all labels, along x


def tau(scores, true_scores):
    pairs = (pair_orders(np.array([row], dtype=float)) for row in (scores, true_scores))
    return tau_b(*pairs)[0]


@pytest.mark.parametrize(
    ("scores", "true_scores", "expected"),
    [
        ((1, 2, 3, 4), (10, 20, 30, 40), 1),
        ((4, 3, 2, 1), (10, 20, 30, 40), -1),
        ((1, 2, 4, 3), (10, 20, 30, 40), (5 - 1) / 6),
        ((1, 1, 2), (1, 2, 3), 2 / np.sqrt(2 * 3)),
        ((0, np.inf, np.inf), (1, 2, 3), 2 / np.sqrt(2 * 3)),
        ((0, 0, 0), (1, 2, 3), 0),
        ((1, 2, 3), (0, 0, 0), np.nan),
    ],
)
def test_tau_of_rankings_made_by_hand(scores, true_scores, expected):
    assert tau(scores, true_scores) == pytest.approx(expected, nan_ok=True)


def test_tau_is_scipys_with_and_without_ties():
    rng = np.random.default_rng(3)
    for levels in (3, 6, 1000):
        scores, true_scores = rng.integers(0, levels, (2, 200, 9)).astype(float)
        expected = [kendalltau(*rows).statistic for rows in zip(scores, true_scores, strict=True)]
        found = tau_b(pair_orders(scores), pair_orders(true_scores))
        assert found == pytest.approx(np.array(expected), abs=1e-12, nan_ok=True)


def test_pairs_are_counted_and_only_sure_ones_are_reversed():
    """Three methods; the truth always orders 1 < 2 < 3.

    Labels always order 1 above 2, tie 2 and 3 as observed, and in every other resample put 3 first.
    """
    truth = np.tile([1.0, 2.0, 3.0], (1001, 1))
    labels = np.tile([2.0, 1.0, 1.0], (1001, 1))
    labels[2::2, 2] = 3.0
    found = agreement(labels, truth)
    assert (found.pairs, found.swapped, found.tied) == (3, 2, 1)
    assert found.reversed == 1  # 1 and 3 are swapped in half of the resamples alone
    assert found.tau == pytest.approx(-2 / np.sqrt(2 * 3))
    assert (found.tau_low, found.tau_high) == pytest.approx((-2 / np.sqrt(6), 1 / 3))


def test_pairs_are_those_of_earlier_with_later_methods():
    orders = pair_orders(np.array([[3.0, 1.0, 1.0], [0.0, np.inf, np.inf]]))
    np.testing.assert_array_equal(orders, [[1, 1, 0], [-1, -1, 0]])


@pytest.mark.parametrize(("agreeing", "sure"), [(39, 1), (38, 0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_order_is_sure_up_to_one_resample_in_forty(agreeing, sure, sign):
    """One in forty is what 95 % leave out at each end; what was observed is no resample."""
    orders = np.zeros((41, 1), np.int8)
    orders[1 : 1 + agreeing] = sign
    assert sure_order(orders).tolist() == [sign * sure]


@pytest.mark.parametrize("unsure", [None, "labels", "truth"])
def test_a_pair_is_reversed_where_both_rankings_are_sure(unsure):
    """A fifth of the resamples order the two methods the other way, by one of the rankings."""
    rankings = {
        "labels": np.tile([2.0, 1.0], (1001, 1)),
        "truth": np.tile([1.0, 2.0], (1001, 1)),
    }
    if unsure is not None:
        rankings[unsure][1:201] = rankings[unsure][1:201, ::-1]
    found = agreement(rankings["labels"], rankings["truth"])
    assert (found.swapped, found.reversed) == (1, int(unsure is None))


def test_every_pair_is_counted_as_by_hand():
    rng = np.random.default_rng(4)
    labels, truth = (
        np.round(np.sort(rng.uniform(0, 6, 8)) + rng.normal(scale=0.6, size=(201, 8)))
        for _ in range(2)
    )
    labels[:, :4] = labels[:, 3::-1]  # some are the other way round
    counts = dict.fromkeys(("pairs", "swapped", "tied", "reversed"), 0)
    for i, j in combinations(range(8), 2):
        given, true = (np.sign(scores[:, i] - scores[:, j]) for scores in (labels, truth))
        counts["pairs"] += true[0] != 0
        counts["swapped"] += given[0] * true[0] < 0
        counts["tied"] += given[0] == 0 and true[0] != 0
        counts["reversed"] += any(
            np.count_nonzero(given[1:] == sign) >= 195
            and np.count_nonzero(true[1:] == -sign) >= 195
            for sign in (1, -1)
        )
    found = agreement(labels, truth)
    assert counts == {name: getattr(found, name) for name in counts}
    assert all(0 < count < 28 for count in counts.values())


def test_what_is_not_to_be_ranked_in_a_resample_could_be_anything():
    truth = np.tile([1.0, 2.0], (1001, 1))
    truth[1:101] = 0.0
    found = agreement(truth, truth)
    assert (found.tau, found.tau_low, found.tau_high) == (1, -1, 1)


def test_equal_shares_are_equal_however_many_runs_there_are():
    place, counts = draws(np.repeat(np.arange(N_PATHS), FRAMES_OF_PATH))
    rng = np.random.default_rng(0)
    errors_m = rng.permutation(np.linspace(0, 0.2, len(place)))
    run = {"position_m": errors_m, "orientation_deg": np.zeros(len(place))}
    once, thrice = (sample_of([run] * n, "within_10cm_10deg", place, counts) for n in (1, 3))
    assert np.array_equal(once, thrice)
    assert once[0] == (errors_m < 0.1).mean()
    assert sample_of([run], "position_m", place, counts)[0] == np.median(errors_m)
    other = run | {"position_m": errors_m + 1}
    assert sample_of([run, other], "position_m", place, counts)[0] == pytest.approx(
        np.median(errors_m) + 0.5
    )


def test_oracles_are_not_ranked_and_all_label_sets_rank_the_same_methods():
    rows = [
        experiment("table2_ground_truth"),
        experiment("table2_ground_truth", labels="sfm"),
        experiment("table6_label_errors", labels="bend", noise_m=0.3, noise_deg=20),
        experiment("table4_size", size="20k"),
    ]
    found = {
        (r.data_set[2], r.trained_on): [*r.folders]
        for r in rankings(design_of(rows), ReferencesConfig())
    }
    assert {*found} == {(s, t) for s in ("sfm", "bend-p0.3-r20") for t in ("labels", "exact")}
    assert found["sfm", "labels"] == found["bend-p0.3-r20", "labels"]
    # Bundle-adjusted maps answer for Tables 2 and 3 alone, scene coordinates for exact labels.
    assert not {"structure-adjusted", "scene-coordinates"} & {*found["sfm", "labels"]}
    assert {"structure-adjusted", "scene-coordinates"} < {*found["sfm", "exact"]}
    assert all({*MODELS} < {*methods} for methods in found.values())
    assert all("nearest-pose" not in methods for methods in found.values())
    assert ranked_sets(design_of([row for row in rows if row.labels == "synfeal"])) == []


def truth():
    count = N_PATHS * FRAMES_OF_PATH
    position_m = np.column_stack([np.zeros(count), np.arange(count), np.ones(count)])
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    return PoseTable(np.arange(count), np.arange(count) // FRAMES_OF_PATH, position_m, upright)


def along_x(offset_m):
    table = truth()
    moved = table.position_m + np.array([offset_m, 0.0, 0.0])
    return PoseTable(table.frame, table.path, moved, table.quat_wxyz)


ROWS = [
    experiment("table2_ground_truth"),
    experiment("table6_label_errors", labels="offset", noise_m=OFFSET_M),
]
OFF_M = dict(zip(MODELS, (0.015, 0.03, 0.07, 0.2, 0.28), strict=True))


@pytest.fixture
def root(tmp_path):
    """Labels 30 cm off along x; five localizers off the truth by 1.5 to 28 cm the same way.

    Those that learn from the labels are off by another 30 cm.
    """
    folder = tmp_path / "labels" / "large_room" / "6k"
    write_pose_table(folder / "synfeal" / "test.csv", truth())
    write_pose_table(folder / "offset-p0.3-r0" / "test.csv", along_x(OFFSET_M))
    for row in ROWS:
        for model, off_m in OFF_M.items():
            wrong_m = off_m + (OFFSET_M if row.noise_m else 0.0)
            path = run_folder(tmp_path, row, model) / "predictions.csv"
            write_pose_table(path, along_x(wrong_m))
    return tmp_path


def written(root):
    files = [root / "tables" / f"label_ranking.{end}" for end in ("csv", "tex")]
    settings = {"references": ALONE.model_dump(mode="json")}
    write_side_table("label_ranking", design_of(ROWS), settings, root, *files)
    return read_label_ranking(files[0])


def test_predictions_of_known_errors_are_ranked_by_both_yardsticks(root):
    """From exact labels, the labels turn the ranking round; from the labels, both agree.

    Off the labels, methods from exact labels are 28.5, 27, 23, 10 and 2 cm.
    """
    table = written(root).set_index(["trained_on", "score"])
    assert len(table) == 2 * len(TITLES)
    exact, same = table.loc["exact"], table.loc["labels"]
    assert exact.loc["position_m", ["tau", "tau_low", "tau_high"]].tolist() == [-1, -1, -1]
    assert exact.loc["position_m", ["pairs", "swapped", "reversed"]].tolist() == [10, 10, 10]
    assert same.loc["position_m", "tau"] == 1
    # No pair differs in its angles, so the truth ranks nothing.
    assert np.isnan(exact.loc["orientation_deg", "tau"])
    # Within 5 cm of the truth are the first two, of the labels the last one alone.
    shares = np.array([[0, 0, 0, 0, 1], [1, 1, 0, 0, 0]])
    expected = kendalltau(*shares).statistic
    assert exact.loc["within_5cm_5deg", "tau"] == pytest.approx(expected)
    assert exact.loc["within_5cm_5deg", "tied"] == 2 * 3 - 2
    # Within 50 cm of the truth are all, whatever they learn from, but the two that are off most.
    assert np.isnan(exact.loc["within_50cm_50deg", "tau"])
    assert same.loc["within_50cm_50deg", "tau"] == 0  # of the labels all five
    assert set(table.methods) == {5}
    assert set(table.paths) == {N_PATHS}
    assert set(table.ranked) == {" ".join(MODELS)}


def test_predictions_of_other_frames_are_refused(root):
    path = run_folder(root, ROWS[0], MODELS[0]) / "predictions.csv"
    write_pose_table(path, along_x(0.1).at(slice(0, 10)))
    with pytest.raises(InputError, match=r"predictions\.csv: its frames are not those"):
        written(root)


@pytest.mark.parametrize(
    ("tau_low", "expected"),
    [
        ((0.9, 0.4, 0.5, 0.6, 0.9, 0.9), "5 cm, 5°"),
        ((0.9, 0.5, 0.5, 0.6, 0.9, 0.9), "1 cm, 1°"),
        ((0.9, 0.5, 0.5, 0.6, 0.9, 0.4), "–"),
        ((None, None, 0.5, 0.6, 0.9, 0.9), "5 cm, 5°"),
    ],
)
def test_labels_rank_rightly_from_the_threshold_where_they_stay_right(tau_low, expected):
    rows = [
        {
            "score": score,
            "tau": None if low is None else 1.0,
            "tau_low": -1.0 if low is None else low,
        }
        for score, low in zip(THRESHOLDS, tau_low, strict=True)
    ]
    assert rightly_from(pd.DataFrame(rows).astype({"tau": float})) == expected


def test_table_and_figure_show_every_label_set(root):
    table = written(root)
    sheet = side_sheet(side_layout(table))
    texts = [[cell[0].text for cell in line.cells] for line in sheet.lines]
    first, second = (dict(zip(sheet.headings, line, strict=True)) for line in texts)
    assert first["Trained on"] == "these labels"
    assert (first["Rightly, from"], second["Rightly, from"]) == ("–", "–")
    assert first["Median, m"] == "1.00 (1.00 to 1.00)"
    assert second["Median, m"] == "-1.00 (-1.00 to -1.00)"
    assert second["Median, °"] == "–"
    assert "Kendall" in side_html(side_layout(table))
    upper, lower = label_ranking(table, ROWS).axes
    for axes, median in ((upper, 1), (lower, -1)):
        (line, medians, *_) = [bar.lines[0] for bar in axes.containers]
        assert len(line.get_ydata()) == len(THRESHOLDS)
        assert medians.get_ydata()[0] == median
        assert axes.get_legend().get_texts()[0].get_text() == "offset 0.3 m, 0°"
