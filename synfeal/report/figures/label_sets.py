"""Re-estimated labels of a data set: errors along the sequence, and camera paths from above."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch

from synfeal.report.figures.scenes import Plan, draw_plan, draw_scale_bar, read_plan
from synfeal.report.figures.sources import (
    SPLITS,
    Array,
    LabelledSet,
    LabelledSplit,
    Results,
    counted,
    read_labelled_set,
)
from synfeal.report.figures.style import METHOD_STYLES, TRUTH, Style, add_legend
from synfeal.report.layouts import SOURCES, scene_title

UNITS = ("position error\nof the label (m)", "orientation error\nof the label (°)")
MARKS = 24  # along a line, the lines one after another: optimisers often coincide
FLOORS = (0.01, 0.1)  # below these the axes are linear, so that an error of 0 can be shown
STRIP = 0.3  # height of a method's bar, where a panel of errors has 3
LOST: Style = {"facecolor": "white", "hatch": "xxxx"}
MARKED = {
    "assisted batch: last pose replaced": Patch(facecolor="0.4", edgecolor="0.4"),
    "lost batch: no motion found, assisted": Patch(edgecolor="0.4", **LOST),
    "batch without assistance": Patch(facecolor="white", edgecolor="0.4"),
}


def draw_label_error(results: Results) -> Figure | None:
    """Errors and a strip of batches below each other, training and test side by side."""
    found = read_labelled_set(results)
    return None if found is None else label_error_figure(found)


def label_error_figure(data: LabelledSet) -> Figure:
    """The figure of one data set; axes by row: position, orientation, batches."""
    splits = {s: {m: parts[s] for m, parts in data.methods.items()} for s in SPLITS}
    counts = [len(next(iter(methods.values())).labels) for methods in splits.values()]
    figure = Figure(figsize=(11.0, 5.6 + 0.25 * len(data.methods)), layout="constrained")
    figure.suptitle(f"{scene_title(data.scene)}, {data.size}: {counted(*counts)}")
    panels = figure.subplots(
        *(3, 2),
        sharex="col",
        sharey="row",
        width_ratios=[max(count, 0.3 * sum(counts)) for count in counts],
        height_ratios=[3, 3, STRIP * len(data.methods)],
    )
    for column, (split, methods) in enumerate(splits.items()):
        panels[0, column].set_title(split)
        _draw_errors(panels[0, column], panels[1, column], methods)
        _draw_batches(panels[2, column], methods)
        panels[2, column].set_xlabel("frame")
        for axes in panels[:, column]:
            _draw_borders(axes, next(iter(methods.values())))
    for axes, label in zip(panels[:2, 0], UNITS, strict=True):
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)  # of both splits, once all lines are drawn
    add_legend(figure, panels[0, 0], 3, MARKED)
    return figure


def _draw_errors(position: Axes, orientation: Axes, methods: Mapping[str, LabelledSplit]) -> None:
    for axes, floor, which in ((position, FLOORS[0], 0), (orientation, FLOORS[1], 1)):
        for start, (method, part) in enumerate(methods.items()):
            axes.plot(
                *(part.labels.frame, part.errors[which]),
                label=SOURCES[method],
                linewidth=1.1,
                markersize=4,
                markevery=_marked(len(part.labels), start, len(methods)),
                **METHOD_STYLES[method],
            )
        axes.set_yscale("symlog", linthresh=floor, linscale=0.4)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(axis="y", color="0.93")


def _marked(n_frames: int, place: int, n_lines: int) -> tuple[int, int]:
    """First marked frame of a line and the step to the next, so that no two lines share one."""
    step = max(n_lines, n_frames // MARKS)
    return place * step // n_lines, step


def _draw_batches(axes: Axes, methods: Mapping[str, LabelledSplit]) -> None:
    """One bar per method: a filled stretch is an assisted batch, a crossed one a lost batch."""
    for place, (method, part) in enumerate(methods.items()):
        colour = METHOD_STYLES[method]["color"]
        for batch in part.batches:
            face = {"facecolor": colour if batch["assisted"] else "white"}
            span = (batch["start"], batch["stop"] - 1 - batch["start"])
            axes.broken_barh(
                *([span], (place - 0.35, 0.7)),
                **(LOST if batch["lost"] else face),
                edgecolor="black",
                linewidth=0.8,
            )
    axes.set_yticks(range(len(methods)), [SOURCES[method] for method in methods])
    axes.set_ylim(len(methods) - 0.4, -0.6)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _draw_borders(axes: Axes, part: LabelledSplit) -> None:
    """Where batches meet; all methods are cut at the same frames."""
    for frame in sorted({batch["start"] for batch in part.batches} - {0}):
        axes.axvline(frame, color="0.82", linewidth=0.7, zorder=0)
    axes.set_xlim(0, len(part.labels) - 1)


ACROSS = 6
PANEL_IN, LEGEND_IN = 2.4, 7.0


def draw_trajectories(results: Results) -> Figure | None:
    """A panel per method, training above test."""
    data = read_labelled_set(results)
    return None if data is None else trajectories_figure(data, read_plan(results, data.scene))


def trajectories_figure(data: LabelledSet, plan: Plan) -> Figure:
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
