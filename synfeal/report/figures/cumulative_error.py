"""Which share of the test frames is localized how well, at the largest size of each scene."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synfeal.config import MODELS, Experiment
from synfeal.errors import InputError
from synfeal.evaluation.metrics import cumulative, joint_error
from synfeal.report.figures.sources import SPLITS, Array, Results, counted
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


def draw(results: Results) -> Figure | None:
    """Scenes across, measures down; nothing when the design has no rows of Table 4."""
    rows = results.design.rows_of("table4_size")
    largest = {scene: results.sizes(scene)[-1] for scene in dict.fromkeys(r.scene for r in rows)}
    rows = [row for row in rows if row.size == largest[row.scene]]
    if not rows:
        return None
    figure = Figure(figsize=(1.2 + 4.0 * len(rows), 10.0), layout="constrained")
    panels = figure.subplots(len(AXES), len(rows), squeeze=False, sharey=True, sharex="row")
    for column, row in zip(panels.T, rows, strict=True):
        counts = [len(results.labels(row.scene, row.size, "synfeal", split)) for split in SPLITS]
        column[0].set_title(f"{scene_title(row.scene)}, {row.size}\n{counted(*counts)}")
        errors = {model: _errors(results, row, model) for model in MODELS}
        for axes, (measure, label) in zip(column, AXES.items(), strict=True):
            _draw_curves(axes, {model: found[measure] for model, found in errors.items()})
            axes.set_xlabel(label)
    for axes in panels[:, 0]:
        axes.set_ylabel("test frames with at most this error (%)")
    add_legend(figure, panels[0, 0], 2 if len(rows) == 1 else 5)
    return figure


def _errors(results: Results, row: Experiment, model: str) -> dict[str, Array]:
    """By measure, a localizer's errors (N,) of all test frames of all repetitions on a data set.

    They are infinite where a prediction failed.
    """
    parts = []
    for run in results.design.runs_of(row, model):
        path = results.root / "runs" / run.directory / "errors.csv"
        parts.append(read_errors(path))
        if parts[-1].empty:
            raise InputError(f"{path}: needs rows; score that run again")
    values = pd.concat(parts)
    errors = {measure: values[measure].to_numpy() for measure in MEASURES}
    return errors | {JOINT: joint_error(errors, "_true")}


def _draw_curves(axes: Axes, errors: Mapping[str, Array]) -> None:
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
