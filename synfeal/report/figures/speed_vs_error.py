"""What speed costs: the variants a stage could choose among, the best of them, and the choice."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.groundtruth.methods import METHODS
from synfeal.report.figures.pareto import pareto_front
from synfeal.report.figures.sources import Array, Results
from synfeal.report.figures.style import METHOD_STYLES, MODEL_STYLES, SCENE_STYLES, Style
from synfeal.report.layouts import TITLES, scene_title

# The style of what has a name of its own, by title.
NAMED = {method.title: METHOD_STYLES[name] for name, method in METHODS.items()}
NAMED |= {TITLES[model]: style for model, style in MODEL_STYLES.items()}


@dataclass(frozen=True)
class Stage:
    """How the variants of a stage are shown.

    Attributes:
        title: heading.
        speed: horizontal axis.
        per: items per unit of the horizontal axis.
        error: vertical axis.
        factor: from the table's unit of error to the axis's.
        linear_below: errors below this are drawn on a linear scale, so that 0 can be shown.
        named: variants differ in more than a number; each has a mark and a name of its own.
    """

    title: str
    speed: str
    per: float
    error: str
    factor: float
    linear_below: float
    named: bool = False


STAGES = {
    "collision": Stage(
        title="Face counts of the collision mesh",
        speed="million rays per second",
        per=1e6,
        error="decisions that differ from the full mesh (%)",
        factor=100.0,
        linear_below=0.01,
    ),
    "labels": Stage(
        title="Methods that estimate labels",
        speed="frames per second of processor time",
        per=1.0,
        error="median position error of the labels (cm)",
        factor=100.0,
        linear_below=1.0,
        named=True,
    ),
}


def draw(results: Results, stage: str) -> Figure | None:
    """One line per scene; nothing when the table has no rows of the stage."""
    rows = results.speeds(stage)
    return figure_of(rows, STAGES[stage]) if len(rows) else None


def figure_of(rows: pd.DataFrame, stage: Stage) -> Figure:
    """The figure of one stage's rows of ``speed_vs_error.csv``."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.subplots()
    for (_, scene), style in zip(rows.groupby("scene", sort=False), cycle(SCENE_STYLES)):
        draw_scene(axes, scene, stage, style)
    axes.set_title(stage.title)
    axes.set_yscale("symlog", linthresh=stage.linear_below)
    axes.set_ylim(bottom=-0.2 * stage.linear_below)  # marks at 0 are seen whole
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlabel(stage.speed)
    axes.set_ylabel(stage.error)
    _add_grid(axes)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3 if stage.named else 1)
    return figure


def draw_scene(axes: Axes, rows: pd.DataFrame, stage: Stage, style: Style) -> None:
    """All variants small and open, those on the Pareto front filled and joined, the choice ringed.

    ``rows`` are the variants of one scene, of which at most one is chosen.
    """
    speed, error = (rows["items_per_s"] / stage.per).to_numpy(), rows["error"].to_numpy()
    error = error * stage.factor
    if stage.named:
        _draw_named(axes, speed, error, rows["variant"])
        return
    front = pareto_front(1.0 / speed, error)
    order = np.argsort(speed[front], kind="stable")
    colour = style["color"]
    open_marks = {"marker": style["marker"], "markerfacecolor": "none", "markeredgecolor": colour}
    axes.plot(speed[~front], error[~front], linestyle="", markersize=4, alpha=0.6, **open_marks)
    scene = scene_title(rows["scene"].iloc[0])
    axes.plot(
        *(speed[front][order], error[front][order]),
        label=f"{scene}: Pareto front (open: dominated)",
        linewidth=1.2,
        markersize=5,
        **style,
    )
    full = rows["faces"].iloc[0]
    ring: Style = {"marker": "o", "markerfacecolor": "none", "markersize": 13, "linestyle": ""}
    for place in np.flatnonzero(rows["chosen"] == 1).tolist():
        label = f"{scene}: used, {rows['faces'].iloc[place]:,.0f} of {full:,.0f} faces"
        axes.plot(speed[place], error[place], label=label, markeredgecolor=colour, **ring)


def draw_training(results: Results) -> Figure | None:
    """A panel for every scene; nothing when the table has no rows of training runs."""
    rows = results.speeds("training")
    return training_figure(rows) if len(rows) else None


def training_figure(rows: pd.DataFrame) -> Figure:
    """The figure of the rows of ``speed_vs_error.csv`` whose stage is ``training``."""
    scenes = dict(list(rows.groupby("scene", sort=False)))
    figure = Figure(figsize=(1.0 + 3.4 * len(scenes), 3.6), layout="constrained")
    panels = figure.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    for axes, (scene, part) in zip(panels, scenes.items(), strict=True):
        speed = part["items_per_s"].to_numpy()
        _draw_named(axes, speed, part["error"].to_numpy(), part["variant"])
        axes.set_xlim(0, 1.15 * speed.max())
        _add_grid(axes)
        axes.set(title=scene_title(str(scene)), xlabel="images per second of processor time")
    # Set once for all: a limit set by the first panel would cut off marks of the next.
    panels[0].set_ylim(0, 1.1 * rows["error"].max())
    panels[0].set_ylabel("median position error (m)")
    handles, labels = max(
        (axes.get_legend_handles_labels() for axes in panels), key=lambda found: len(found[1])
    )
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _draw_named(axes: Axes, speed: Array, error: Array, titles: pd.Series[Any]) -> None:
    """A mark for each title, in the style it has in all figures; filled on the Pareto front."""
    front = pareto_front(1.0 / speed, error)
    for x, y, title, on_front in zip(speed, error, titles, front, strict=True):
        style: Style = NAMED[title] | {"linestyle": "", "markersize": 8}
        face = style["color"] if on_front else "none"
        axes.plot(x, y, label=title, **style, markerfacecolor=face, markeredgecolor=style["color"])


def _add_grid(axes: Axes) -> None:
    axes.grid(color="0.94")
    axes.set_axisbelow(True)
