"""Which share of the test frames is localized how well, at the largest size of each scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synfeal.config import MODELS, Experiment
from synfeal.errors import InputError
from synfeal.evaluation.metrics import cumulative, joint_error
from synfeal.report.figures.sources import Array, Results, counted
from synfeal.report.figures.style import MODEL_STYLES, add_legend, set_log
from synfeal.report.layouts import TITLES, scene_title
from synfeal.report.stats import read_errors

MEASURES = {
    "position_m_true": "position error against the true poses (m)",
    "orientation_deg_true": "orientation error against the true poses (°)",
}
JOINT = "both"
AXES = {**MEASURES, JOINT: "both errors against the true poses: at most x cm and x°"}
MARKED_AT = (0.1, 0.3, 0.5, 0.7, 0.9)


@dataclass(frozen=True)
class SceneErrors:
    """Errors at the largest size of a scene."""

    title: str  # scene, size and frames
    # By localizer and measure, the errors (N,) of all test frames of all repetitions; infinite
    # where a prediction failed.
    errors: dict[str, dict[str, Array]]


def draw(results: Results) -> Figure | None:
    """Scenes across, measures down; nothing when the design has no rows of Table 4."""
    rows = results.design.rows_of("table4_size")
    if not rows:
        return None
    largest = {scene: results.sizes(scene)[-1] for scene in dict.fromkeys(r.scene for r in rows)}
    rows = [row for row in rows if row.size == largest[row.scene]]
    return figure_of([scene_errors(results, row) for row in rows])


def scene_errors(results: Results, row: Experiment) -> SceneErrors:
    """The errors of the five localizers on one data set."""
    errors: dict[str, dict[str, Array]] = {}
    for model in MODELS:
        parts = []
        for run in results.design.runs_of(row, model):
            path = results.root / "runs" / run.directory / "errors.csv"
            parts.append(read_errors(path))
            if parts[-1].empty:
                raise InputError(f"{path}: needs rows; score that run again")
        values = pd.concat(parts)
        errors[model] = {measure: values[measure].to_numpy() for measure in MEASURES}
        errors[model][JOINT] = joint_error(errors[model], "_true")
    counts = [len(results.labels(row.scene, row.size, "synfeal", s)) for s in ("train", "test")]
    return SceneErrors(f"{scene_title(row.scene)}, {row.size}\n{counted(*counts)}", errors)


def figure_of(scenes: list[SceneErrors]) -> Figure:
    """The figure of some scenes."""
    figure = Figure(figsize=(1.2 + 4.0 * len(scenes), 10.0), layout="constrained")
    panels = figure.subplots(len(AXES), len(scenes), squeeze=False, sharey=True, sharex="row")
    for column, scene in enumerate(scenes):
        panels[0, column].set_title(scene.title)
        for axes, (measure, label) in zip(panels[:, column], AXES.items(), strict=True):
            draw_curves(axes, {model: found[measure] for model, found in scene.errors.items()})
            axes.set_xlabel(label)
    for axes in panels[:, 0]:
        axes.set_ylabel("test frames with at most this error (%)")
    add_legend(figure, panels[0, 0], 2 if len(scenes) == 1 else 5)
    return figure


def draw_curves(axes: Axes, errors: Mapping[str, Array]) -> None:
    """One curve per localizer; one whose predictions failed ends below 100 %."""
    axes.axhline(50, color="0.85", linewidth=0.8, zorder=0)
    for model, values in errors.items():
        error, percent = cumulative(values)
        marked = [int(share * (len(error) - 1)) for share in MARKED_AT]
        axes.plot(
            *(error, percent),
            label=TITLES[model],
            drawstyle="steps-post",
            linewidth=1.4,
            markersize=4.5,
            markevery=marked,
            **MODEL_STYLES[model],
        )
    set_log(axes, "x")
    axes.set_ylim(0, 100)
    axes.grid(axis="x", color="0.93")
