"""Figures of tables: what is drawn is what is given."""

import numpy as np
import pandas as pd
import pytest

from baselines.config.learning import MODELS
from reproduction.figures import speed_vs_error
from reproduction.figures.error_by_design import (
    ASIDE,
    LEVEL,
    SHOWN,
    by_images,
    by_noise,
    by_size,
    published_values,
)
from reproduction.figures.sources import Results
from reproduction.figures.speed_vs_error import pareto_front
from reproduction.figures.style import PUBLISHED
from reproduction.tables.layouts import TITLES
from synfeal.evaluation.metrics import cumulative
from tests.support.report_results import ROWS, design_of

MODEL_OF = {title: model for model, title in TITLES.items()}


@pytest.fixture(scope="module")
def tables(results):
    return {name: Results(results, design_of(())).table(name) for name in ROWS}


def drawn(axes):
    """By localizer: places, values, and the limits of each value."""
    found = {}
    for container in axes.containers:
        line, _, (bars,) = container.lines
        segments = [s if len(s) else np.full((2, 2), np.nan) for s in bars.get_segments()]
        limits = np.array(segments)[:, :, 1]
        found[MODEL_OF[container.get_label()]] = (line.get_xdata(), line.get_ydata(), limits)
    return found


def published(axes):
    grey = PUBLISHED["color"]
    lines = [line for line in axes.lines if line.get_color() == grey and len(line.get_xdata())]
    return [line.get_ydata() for line in lines]


def reference_rows(keys):
    """Rows of ``references.csv``: the k-th method is off by k hundredths and n thousandths at the
    n-th data set, but the mean pose, which is off by 100 at all of them; in degrees ten times so.
    """
    rows = []
    for n, key in enumerate(keys):
        for k, method in enumerate(SHOWN):
            error = 100.0 if method == "constant" else 0.01 * k + 0.001 * n
            scores = {"position_m": error, "orientation_deg": 10 * error}
            scores |= {f"{name}_true": value for name, value in scores.items()}
            rows.append({**key, **scores, "method": method, "title": f"title of {method}"})
    return pd.DataFrame(rows)


def check_references(axes, places, degrees):
    """The lines of the methods, and what is said of the one that is above everything."""
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    for k, method in enumerate(SHOWN):
        expected = [100.0 if method == "constant" else 0.01 * k + 0.001 * n for n in places]
        factor = 10 if degrees else 1
        np.testing.assert_allclose(lines[f"title of {method}"], factor * np.array(expected))
    (text,) = axes.texts
    assert text.get_text() == f"↑ title of constant: {'1000°' if degrees else '100.00 m'}"
    assert axes.get_ylim()[1] < 100


def column(rows, name, **keys):
    return rows.loc[(rows[list(keys)] == pd.Series(keys)).all(axis=1), name].tolist()


def check_panel(axes, rows, measure, **keys):
    """Places, values and limits of all localizers; nothing lies outside the axes."""
    lines = drawn(axes)
    assert list(lines) == list(MODELS)
    for model, (places, values, limits) in lines.items():
        keys["model"] = model
        expected = column(rows, measure, **keys)
        np.testing.assert_allclose(values, expected)
        np.testing.assert_allclose(limits[:, 0], column(rows, f"{measure}_low", **keys))
        np.testing.assert_allclose(limits[:, 1], column(rows, f"{measure}_high", **keys))
        np.testing.assert_allclose(places, np.arange(len(expected)) + ASIDE[model])
        assert axes.get_ylim()[0] == 0
        assert axes.get_ylim()[1] >= limits.max()


def test_error_by_size_draws_the_true_errors_their_limits_and_the_published_ones(tables):
    """Published positions are distances over the root of three; the figure's are distances."""
    rows = tables["table4_size"]
    sets = list(rows.groupby(["scene", "size"], sort=False).groups)
    figure = by_size(rows, reference_rows([{"scene": scene, "size": size} for scene, size in sets]))
    panels = np.reshape(figure.axes, (2, 2))
    for line, measure in enumerate(("position_m_true", "orientation_deg_true")):
        for place, scene in enumerate(("large_room", "sanctuary")):
            axes = panels[line, place]
            check_panel(axes, rows, measure, scene=scene)
            name = f"published_{measure.removesuffix('_true')}"
            expected = [column(rows, name, scene=scene, model=model) for model in MODELS]
            factor = 3**0.5 if measure == "position_m_true" else 1
            np.testing.assert_allclose(published(axes), factor * np.array(expected))
            own = [n for n, (name, _) in enumerate(sets) if name == scene]
            check_references(axes, own, degrees=line == 1)
    titles = " ".join(text.get_text() for text in figure.legends[0].get_texts())
    assert "× √3" in titles
    assert "title of structure-depth" in titles
    labels = [label.get_text() for label in panels[1, 1].get_xticklabels()]
    assert labels[0] == "6k\n300 frames"
    assert labels[-1] == "95k\n4,750 frames"


def test_error_by_images_draws_each_start_over_the_shares_of_the_images(tables):
    rows = tables["table7_images_shown"]
    panels = np.reshape(by_images(rows).axes, (2, 2))
    for place, start in enumerate(("pretrained", "scratch")):
        own = rows[rows["init"].str.startswith(start)].assign(start=start)
        for line, measure in enumerate(("position_m_true", "orientation_deg_true")):
            check_panel(panels[line, place], own, measure, start=start)
        labels = [label.get_text() for label in panels[1, place].get_xticklabels()]
        assert labels == ["quarter", "half", "all"]


def test_error_by_noise_draws_both_scores_and_the_published_only_beside_the_papers(tables):
    rows = tables["table3_inconsistencies"]
    levels = {b: part[LEVEL].drop_duplicates() for b, part in rows.groupby("block")}
    sets = pd.concat(levels.values()).drop_duplicates().to_dict("records")
    figure = by_noise(rows, reference_rows(sets), "title")
    halves = [np.reshape(half.axes, (2, 3)) for half in figure.subfigs]
    for end, panels in zip(("", "_true"), halves, strict=True):
        for line, measure in enumerate(("position_m", "orientation_deg")):
            for place, block in enumerate(("orientation", "position", "both")):
                check_panel(panels[line, place], rows, measure + end, block=block)
                own = [sets.index(level) for level in levels[block].to_dict("records")]
                check_references(panels[line, place], own, degrees=line == 1)
                assert len(published(panels[line, place])) == (0 if end else 5)
    assert "paper's protocol" in figure.subfigs[0].get_suptitle()
    assert "true poses" in figure.subfigs[1].get_suptitle()


def test_a_misprint_and_a_failed_run_leave_a_gap_and_the_cumulative_share_is_a_count(tables):
    rows = tables["table3_inconsistencies"]
    none = reference_rows([{"scene": "", "size": "", "noise_m": -1.0, "noise_deg": -1.0}])
    figure = by_noise(rows, none, "title")
    both = np.reshape(figure.subfigs[0].axes, (2, 3))[1, 2]
    assert np.isnan(published(both)[MODELS.index("posenet2")][1])
    flagged = pd.DataFrame({"published_flag": ["misprint", ""], "published_orientation_deg": 1.0})
    assert np.isnan(published_values(flagged, "orientation_deg")).tolist() == [True, False]
    failed = tables["table4_size"].copy()
    measures = [f"position_m_true{end}" for end in ("", "_low", "_high")]
    failed.loc[failed.index[0], measures] = np.nan
    _, values, _ = drawn(by_size(failed, none).axes[0])["posenet"]
    assert np.isnan(values).tolist() == [True, False, False, False]
    errors = np.random.default_rng(3).gamma(2.0, size=41)
    errors[[4, 7]] = np.inf
    ordered, percent = cumulative(errors)
    assert len(ordered) == 39
    for error, share in zip(ordered, percent, strict=True):
        assert share == pytest.approx(100 * np.mean(errors <= error))
    assert percent[-1] == pytest.approx(100 * 39 / 41)
    # The median is where the curve passes a half.
    assert ordered[np.searchsorted(percent, 50)] == pytest.approx(np.median(errors))


def dominated(one, all_of_them):
    return any(
        a[0] <= one[0] and a[1] <= one[1] and (a[0] < one[0] or a[1] < one[1]) for a in all_of_them
    )


@pytest.mark.parametrize("seed", range(40))
def test_the_pareto_front_is_what_nothing_dominates(seed):
    rng = np.random.default_rng(seed)
    # Few distinct values: ties and equal variants are common.
    variants = rng.integers(0, 5, (rng.integers(1, 14), 2)).astype(float)
    expected = [not dominated(one, variants) for one in variants]
    assert pareto_front(*variants.T).tolist() == expected


def test_speed_vs_error_joins_the_front_rings_the_choice_and_fills_the_best():
    measured = ((1e6, 0.0, 0), (1.5e6, 0.004, 0), (1.2e6, 0.005, 1), (3e6, 0.2, 0))
    rows = pd.DataFrame(measured, columns=["items_per_s", "error", "chosen"])
    rows = rows.assign(scene="large_room", faces=[1000, 990, 980, 970])
    (axes,) = speed_vs_error.collision_figure(rows).axes
    open_marks, front, ring = axes.lines
    np.testing.assert_allclose(open_marks.get_xydata(), [[1.2, 0.5]])
    np.testing.assert_allclose(front.get_xydata(), [[1.0, 0.0], [1.5, 0.4], [3.0, 20.0]])
    np.testing.assert_allclose(ring.get_xydata(), [[1.2, 0.5]])
    assert ring.get_label() == "Large Room: used, 980 of 1,000 faces"
    measured = (("PoseNet", 500, 0.5), ("Hourglass", 200, 0.6), ("PoseNet2", 400, 0.4))
    rows = pd.DataFrame(measured, columns=["variant", "items_per_s", "error"])
    (axes,) = speed_vs_error.training_figure(rows.assign(scene="sanctuary")).axes
    assert axes.get_title() == "Sanctuary"
    drawn = {line.get_label(): line for line in axes.lines}
    for name, speed, error in measured:
        np.testing.assert_array_equal(drawn[name].get_xydata(), [[speed, error]])
    hollow = {name for name, line in drawn.items() if line.get_markerfacecolor() == "none"}
    assert hollow == {"Hourglass"}
