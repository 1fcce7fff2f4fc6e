"""What speed costs: the variants a stage could choose among, the best of them, and the choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.groundtruth.methods import METHODS
from synfeal.report.figures.pareto import pareto_front
from synfeal.report.figures.sources import Results, Row
from synfeal.report.figures.style import METHOD_STYLES, SCENE_STYLES, Style
from synfeal.report.layouts import scene_title

TABLE = "speed_vs_error"


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
    rows = [row for row in results.table(TABLE) if row["stage"] == stage]
    return figure_of(rows, STAGES[stage]) if rows else None


def figure_of(rows: Sequence[Row], stage: Stage) -> Figure:
    """The figure of one stage's rows of ``speed_vs_error.csv``."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    axes = figure.subplots()
    for scene, style in zip(dict.fromkeys(r["scene"] for r in rows), cycle(SCENE_STYLES)):
        draw_scene(axes, [row for row in rows if row["scene"] == scene], stage, style)
    axes.set_title(stage.title)
    axes.set_yscale("symlog", linthresh=stage.linear_below)
    axes.set_ylim(bottom=-0.2 * stage.linear_below)  # marks at 0 are seen whole
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlabel(stage.speed)
    axes.set_ylabel(stage.error)
    axes.grid(color="0.94")
    axes.set_axisbelow(True)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3 if stage.named else 1)
    return figure


def draw_scene(axes: Axes, rows: Sequence[Row], stage: Stage, style: Style) -> None:
    """All variants small and open, those on the Pareto front filled and joined, the choice ringed.

    Args:
        axes: where to draw.
        rows: the variants of one scene, of which at most one is chosen.
        stage: axes and their units.
        style: colour, marker and dashes of the scene.
    """
    speed = np.array([float(row["items_per_s"]) / stage.per for row in rows])
    error = np.array([float(row["error"]) * stage.factor for row in rows])
    front = pareto_front(1.0 / speed, error)
    if stage.named:
        for place, row in enumerate(rows):
            _named_mark(axes, speed[place], error[place], row["variant"], bool(front[place]))
        return
    order = np.argsort(speed[front], kind="stable")
    colour = style["color"]
    open_marks = {"marker": style["marker"], "markerfacecolor": "none", "markeredgecolor": colour}
    axes.plot(speed[~front], error[~front], linestyle="", markersize=4, alpha=0.6, **open_marks)
    axes.plot(
        *(speed[front][order], error[front][order]),
        label=f"{scene_title(rows[0]['scene'])}: Pareto front (open: dominated)",
        linewidth=1.2,
        markersize=5,
        **style,
    )
    for place, row in enumerate(rows):
        if row["chosen"] == "1":
            _ring(axes, speed[place], error[place], _used(row, rows[0]), colour)


def _named_mark(axes: Axes, speed: float, error: float, title: str, on_front: bool) -> None:
    """The mark of a method, in the style it has in all figures; filled on the Pareto front."""
    (name,) = (name for name, method in METHODS.items() if method.title == title)
    style: Style = METHOD_STYLES[name] | {"linestyle": "", "markersize": 8}
    face = style["color"] if on_front else "none"
    edge: Style = {"markerfacecolor": face, "markeredgecolor": style["color"]}
    axes.plot(speed, error, label=title, **style, **edge)


def _used(row: Row, full: Row) -> str:
    faces = f"{int(row['faces']):,} of {int(full['faces']):,} faces"
    return f"{scene_title(row['scene'])}: used, {faces}"


def _ring(axes: Axes, speed: float, error: float, label: str, colour: str) -> None:
    ring: Style = {
        "marker": "o",
        "markerfacecolor": "none",
        "markeredgecolor": colour,
        "markersize": 13,
    }
    axes.plot(speed, error, label=label, linestyle="", **ring)
