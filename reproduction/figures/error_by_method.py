"""Errors by method: of all frames, by label noise, and by effects in the frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.config.learning import MODELS
from reproduction.config.robustness import MIXED
from reproduction.design.experiments import Experiment
from reproduction.figures.error_by_design import BLOCKS, NOISE, UNITS
from reproduction.figures.sources import SPLITS, Array, Results, counted
from reproduction.figures.style import (
    BLUE,
    MODEL_STYLES,
    ORANGE,
    Style,
    add_legend,
    reference_styles,
    set_log,
)
from reproduction.statistics.limits import read_errors
from reproduction.tables import references, robustness
from reproduction.tables.layouts import DOSE, TITLES, label_title, scene_title
from synfeal.config.effects import CLEAN
from synfeal.errors import InputError
from synfeal.evaluation.metrics import cumulative, joint_error

TRUE = {
    "position_m_true": "position error against the true poses (m)",
    "orientation_deg_true": "orientation error against the true poses (°)",
}
JOINT = "both"
AXES = {**TRUE, JOINT: "both errors against the true poses: at most x cm and x°"}
MARKED_AT = (0.1, 0.3, 0.5, 0.7, 0.9)


def draw_cumulative_error(results: Results) -> Figure | None:
    """Draw cumulative errors on the data sets of Table 4: scenes across, measures down.

    Returns:
        The figure; None where the design has no rows of Table 4.
    """
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
    """Read a localizer's errors (N,) by measure, of all test frames of all repetitions.

    They are infinite where a prediction failed.
    """
    parts = []
    for run in results.design.runs_of(row, model):
        path = results.root / "runs" / run.directory / "errors.csv"
        parts.append(read_errors(path))
        if parts[-1].empty:
            raise InputError(path, "needs rows; score that run again")
    values = pd.concat(parts)
    errors = {measure: values[measure].to_numpy() for measure in TRUE}
    return errors | {JOINT: joint_error(errors, "_true")}


def _draw_curves(axes: Axes, errors: Mapping[str, Array]) -> None:
    """Draw a curve per localizer; one whose predictions failed ends below 100 %."""
    axes.axhline(50, color="0.85", linewidth=0.8, zorder=0)
    for model, values in errors.items():
        error, percent = cumulative(values)
        marked = [int(share * (len(error) - 1)) for share in MARKED_AT]
        axes.plot(
            error,
            percent,
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


LABELS = "table2_ground_truth"
PARTS = {**BLOCKS, "": "labels from images"}


def draw_references_by_noise(results: Results) -> Figure | None:
    """Draw errors of all methods over the noise and the source of the labels.

    Returns:
        The figure; None without rows of Table 3, or without structure-based poses on them.
    """
    rows = results.design.rows_of(NOISE)
    if not rows:
        return None
    table = references.read_references(results.root / "tables" / f"{references.NAME}.csv")
    first = rows[0]
    table = table[(table.scene == first.scene) & (table["size"] == first.size)]
    rows += results.design.rows_of(LABELS)
    figure = references_by_noise(
        table, [r for r in rows if (r.scene, r.size) == (first.scene, first.size)]
    )
    if results.design.noise_dose == "code":
        figure.supxlabel(DOSE, fontsize=8)
    return figure


def references_by_noise(table: pd.DataFrame, rows: Sequence[Experiment]) -> Figure:
    """Draw one data set size: rows of ``references.csv``, and the label sets to show."""
    blocks = [block for block in PARTS if any(row.block == block for row in rows)]
    figure = Figure(figsize=(1.6 + 2.9 * len(blocks), 6.8), layout="constrained")
    finding = references.crossing_finding(table)
    if finding:
        figure.suptitle(finding, wrap=True, fontsize=10)
    panels = figure.subplots(2, len(blocks), squeeze=False, sharey="row", sharex="col")
    for column, block in enumerate(blocks):
        labels = _ordered(dict.fromkeys(r.label_id for r in rows if r.block == block), table)
        panels[0, column].set_title(PARTS[block], fontsize=9)
        names = [label_title(name).removeprefix("noise ") for name in labels]
        names = [name.replace(", ", "\n").replace(" w/ ", "\n") for name in names]
        panels[1, column].set_xticks(range(len(labels)), names, rotation=30 if not block else 0)
        for axes, measure in zip(panels[:, column], UNITS, strict=True):
            _draw_methods(axes, table, labels, f"{measure}_true", joined=bool(block))
    for axes, title in zip(panels[:, 0], UNITS.values(), strict=True):
        axes.set_ylabel(title)
    add_legend(figure, panels[0, 0], 4)
    return figure


def _ordered(labels: Sequence[str] | dict[str, None], table: pd.DataFrame) -> list[str]:
    """Order noise as the design does, label sources by the error of structure built on them."""
    names = list(labels)
    if any("-p" in name for name in names):  # injected
        return names
    structure = table[table.method == references.STRUCTURE].set_index("labels")["position_m_true"]
    return sorted(names, key=lambda name: float(structure.fillna(np.inf).get(name, np.inf)))


def _draw_methods(
    axes: Axes, table: pd.DataFrame, labels: list[str], measure: str, joined: bool
) -> None:
    """Draw marks per method, joined where labels are levels: localizers in colour, others grey."""
    titles = references.titles_in(table)
    others = [name for name in titles if name not in MODELS]
    styles = {**reference_styles(others), **MODEL_STYLES}
    for name in (*others, *(m for m in MODELS if m in titles)):
        values = table[table.method == name].set_index("labels")[measure].reindex(labels)
        axes.plot(
            range(len(labels)),
            values.to_numpy(dtype=float),
            label=titles[name],
            linewidth=1.4,
            markersize=4.5,
            **(styles[name] if joined else {**styles[name], "linestyle": "none"}),
        )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(axis="y", color="0.92", which="both")


STYLES: dict[str, Style] = {
    CLEAN: {"color": BLUE, "marker": "o", "markerfacecolor": "white"},
    MIXED: {"color": ORANGE, "marker": "D"},
}
OFFSET = 0.17  # between marks on one line, in lines


def draw_robustness(results: Results) -> Figure | None:
    """Draw errors by effect of camera and light: measures down, methods across.

    There is a line for each of the effects, ideal frames first.

    Returns:
        The figure; None where the robustness table is not made.
    """
    path = results.root / "tables" / f"{robustness.NAME}.csv"
    if not path.exists():
        return None
    table = robustness.read_robustness(path)
    effects, methods = list(table.effects.unique()), list(table.method.unique())
    size = (1.9 + 1.55 * len(methods), 1.4 + 0.4 * len(effects))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(2, len(methods), squeeze=False, sharey=True)
    for column, method in enumerate(methods):
        panels[0, column].set_title(robustness.METHODS[method].replace(", ", ",\n"), fontsize=9)
        for row, (measure, unit) in enumerate(UNITS.items()):
            axes = panels[row, column]
            if (
                column and method != references.STRUCTURE
            ):  # which is off by a hundredth of the others
                axes.sharex(panels[row, 0])
            rows = table[table.method == method]
            for trained_on, style in STYLES.items():
                own = rows[rows.trained_on == trained_on].set_index("effects").reindex(effects)
                _draw_errors(axes, own, measure, style, robustness.BLOCKS[trained_on])
            set_log(axes, "x")
            axes.grid(axis="x", color="0.92")
            axes.set_xlabel(unit)
    for axes in panels.flat:
        for place in range(1, len(effects), 2):
            axes.axhspan(place - 0.5, place + 0.5, color="0.96", zorder=0)
    panels[0, 0].set_yticks(
        range(len(effects)), [robustness.effects_title(name) for name in effects]
    )
    panels[0, 0].set_ylim(len(effects) - 0.5, -0.5)
    add_legend(figure, panels[0, 0], 2)
    return figure


def _draw_errors(axes: Axes, rows: pd.DataFrame, measure: str, style: Style, label: str) -> None:
    """Draw medians with 95 % limits, and a line where ideal frames are."""
    if rows[measure].isna().all():
        return
    place = np.arange(len(rows)) + (OFFSET if style is STYLES[MIXED] else -OFFSET)
    value, low, high = (rows[f"{measure}{end}"].to_numpy(float) for end in ("", "_low", "_high"))
    axes.hlines(place, low, high, color=style["color"], linewidth=1.0, alpha=0.5)
    axes.plot(value, place, label=label, linestyle="", markersize=4.5, **style)
    axes.axvline(value[0], color=style["color"], linewidth=0.8, linestyle=":", zorder=1)
