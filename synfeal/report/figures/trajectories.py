"""Estimated camera paths over the true ones, from above."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure

from synfeal.report.figures.plan_view import Plan, draw_plan, draw_scale_bar, read_plan
from synfeal.report.figures.sources import (
    SPLITS,
    Array,
    LabelledSet,
    LabelledSplit,
    Results,
    read_labelled_set,
)
from synfeal.report.figures.style import METHOD_STYLES, TRUTH, Style, add_legend
from synfeal.report.layouts import SOURCES, scene_title

ACROSS = 6
PANEL_IN, LEGEND_IN = 2.4, 7.0


def draw(results: Results) -> Figure | None:
    """A panel per method, training above test."""
    data = read_labelled_set(results)
    return None if data is None else figure_of(data, read_plan(results, data.scene))


def figure_of(data: LabelledSet, plan: Plan) -> Figure:
    """The figure of one data set."""
    across = min(ACROSS, len(data.methods))
    down = -(-len(data.methods) // across)
    width_m, depth_m = np.ptp(plan.bounds_m, axis=0)
    height = down * (PANEL_IN * depth_m / width_m + 0.3) + 0.3
    figure = Figure(
        figsize=(max(0.4 + PANEL_IN * across, LEGEND_IN), 1.0 + len(SPLITS) * height),
        layout="constrained",
    )
    figure.suptitle(f"{scene_title(data.scene)}, {data.size}")
    halves = figure.subfigures(len(SPLITS), 1, squeeze=False)[:, 0]
    for part, split in zip(halves, SPLITS, strict=True):
        _draw_split(part, data, plan, split, (down, across))
    add_legend(figure, figure.axes[0], 3)  # colours as in the first panel
    return figure


def _draw_split(
    part: SubFigure, data: LabelledSet, plan: Plan, split: str, shape: tuple[int, int]
) -> None:
    panels = part.subplots(*shape, squeeze=False).ravel()
    for axes, (method, parts) in zip(panels, data.methods.items(), strict=False):
        draw_plan(axes, plan)
        draw_scale_bar(axes, plan)
        draw_paths(axes, parts[split], method)
        axes.set_title(title_of(parts[split], method), fontsize=9)
    for axes in panels[len(data.methods) :]:
        axes.set_axis_off()
    frames = len(next(iter(data.methods.values()))[split].labels)
    part.suptitle(f"{split}: {frames:,} frames", weight="bold", fontsize=10)


def title_of(part: LabelledSplit, method: str) -> str:
    """The method, and how many of its batches were assisted."""
    assisted = sum(batch["assisted"] for batch in part.batches)
    return f"{SOURCES[method]}\n{assisted} of {len(part.batches)} batches assisted"


def draw_paths(axes: Axes, part: LabelledSplit, method: str) -> None:
    """The true path, the estimated one, where batches meet, and which were assisted.

    Assisted batches are drawn wide; a ring is where the last label is the true pose.
    """
    truth, labels = part.truth.position_m[:, :2], part.labels.position_m[:, :2]
    offsets = LineCollection(list(np.stack([truth, labels], axis=1)), colors="0.4")
    offsets.set(linewidths=0.4, alpha=0.6, zorder=3, label="from true to estimated position")
    axes.add_collection(offsets)
    axes.plot(*truth.T, label="true path", zorder=2, **TRUTH)
    colour = METHOD_STYLES[method]["color"]
    axes.plot(*labels.T, label="estimated path", zorder=4, color=colour, linewidth=1.0)
    assisted = [batch for batch in part.batches if batch["assisted"]]
    wide = LineCollection([labels[batch["start"] : batch["stop"]] for batch in assisted])
    wide.set(color=colour, linewidth=4.0, alpha=0.3, zorder=3.5, label="assisted batch")
    axes.add_collection(wide)
    starts = [batch["start"] for batch in part.batches]
    _mark(axes, labels[starts], "first frame of a batch", 3, colour)
    ends = [batch["stop"] - 1 for batch in assisted]
    _mark(axes, labels[ends], "assisted: replaced by the true pose", 6, "white")


def _mark(axes: Axes, points: Array, label: str, size: float, face: str) -> None:
    style: Style = {"marker": "o", "markersize": size, "markerfacecolor": face, "linestyle": ""}
    edge: Style = {"markeredgecolor": "black", "markeredgewidth": 0.7}
    axes.plot(*points.T, zorder=5, label=label, **style, **edge)
