"""What speed costs: the variants a stage could choose among, the best of them, and the choice."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.groundtruth.methods import METHODS
from synfeal.frames import rows_of
from synfeal.report.figures.pareto import pareto_front
from synfeal.report.figures.sources import Results
from synfeal.report.figures.style import (
    METHOD_STYLES,
    MODEL_STYLES,
    SCENE_STYLES,
    Style,
    add_legend,
)
from synfeal.report.layouts import TITLES, scene_title

# The style of what has a name of its own, by title.
NAMED = {method.title: METHOD_STYLES[name] for name, method in METHODS.items()}
NAMED |= {TITLES[model]: style for model, style in MODEL_STYLES.items()}
SIZE = (6.4, 4.6)
RING: Style = {"marker": "o", "markerfacecolor": "none", "markersize": 13, "linestyle": ""}


def draw_collision(results: Results) -> Figure | None:
    """Meshes for collisions, one line per scene; nothing when the table has no rows of them."""
    rows = results.speeds("collision")
    return collision_figure(rows) if len(rows) else None


def collision_figure(rows: pd.DataFrame) -> Figure:
    """The figure of the rows of ``speed_vs_error.csv`` whose stage is ``collision``."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    for (_, scene), style in zip(rows.groupby("scene", sort=False), cycle(SCENE_STYLES)):
        _draw_meshes(axes, scene, style)
    _finish(axes, "Face counts of the collision mesh", linear_below=0.01)
    axes.set_xlabel("million rays per second")
    axes.set_ylabel("decisions that differ from the full mesh (%)")
    add_legend(figure, axes, 1)
    return figure


def _draw_meshes(axes: Axes, rows: pd.DataFrame, style: Style) -> None:
    """Meshes of a scene small and open; those on the front filled and joined, the choice ringed."""
    speed, error = (rows["items_per_s"] / 1e6).to_numpy(), 100.0 * rows["error"].to_numpy()
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
    for place in np.flatnonzero(rows["chosen"] == 1).tolist():
        label = f"{scene}: used, {rows['faces'].iloc[place]:,.0f} of {full:,.0f} faces"
        axes.plot(speed[place], error[place], label=label, markeredgecolor=colour, **RING)


def draw_labels(results: Results) -> Figure | None:
    """Methods that estimate labels; nothing when the table has no rows of them."""
    rows = results.speeds("labels")
    if rows.empty:
        return None
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    for _, scene in rows.groupby("scene", sort=False):
        _draw_named(axes, scene, factor=100.0)
    _finish(axes, "Methods that estimate labels", linear_below=1.0)
    axes.set_xlabel("frames per second of processor time")
    axes.set_ylabel("median position error of the labels (cm)")
    add_legend(figure, axes, 3)
    return figure


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
        _draw_named(axes, part)
        axes.set_xlim(0, 1.15 * part["items_per_s"].max())
        axes.grid(color="0.94")
        axes.set(title=scene_title(str(scene)), xlabel="images per second of processor time")
    # Set once for all: a limit set by the first panel would cut off marks of the next.
    panels[0].set_ylim(0, 1.1 * rows["error"].max())
    panels[0].set_ylabel("median position error (m)")
    add_legend(figure, max(panels, key=lambda axes: len(axes.lines)), 3)
    return figure


def _finish(axes: Axes, title: str, linear_below: float) -> None:
    """Errors below ``linear_below`` are on a linear scale, so that 0 can be shown."""
    axes.set_title(title)
    axes.set_yscale("symlog", linthresh=linear_below)
    axes.set_ylim(bottom=-0.2 * linear_below)  # marks at 0 are seen whole
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(color="0.94")


def _draw_named(axes: Axes, rows: pd.DataFrame, factor: float = 1.0) -> None:
    """A mark for each variant, in the style it has in all figures; filled on the Pareto front."""
    front = pareto_front(1.0 / rows["items_per_s"], rows["error"])
    for row, on_front in zip(rows_of(rows), front, strict=True):
        style: Style = NAMED[row.variant] | {"linestyle": "", "markersize": 8}
        face = style["color"] if on_front else "none"
        look = style | {"markerfacecolor": face, "markeredgecolor": style["color"]}
        axes.plot(row.items_per_s, factor * row.error, label=row.variant, **look)
