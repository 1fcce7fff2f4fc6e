"""Error of re-estimated labels along the sequence, and which batches needed assistance."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from synfeal.report.figures.sources import (
    SPLITS,
    LabelledSet,
    LabelledSplit,
    Results,
    counted,
    read_labelled_set,
)
from synfeal.report.figures.style import METHOD_STYLES, Style, add_legend
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


def draw(results: Results) -> Figure | None:
    """Errors and a strip of batches below each other, training and test side by side."""
    found = read_labelled_set(results)
    return None if found is None else figure_of(found)


def figure_of(data: LabelledSet) -> Figure:
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
