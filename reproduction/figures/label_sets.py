"""Re-estimated labels of a data set: errors along the sequence, and camera paths from above."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from reproduction.figures.scenes import draw_plan, read_plan
from reproduction.figures.sources import SPLITS, Array, Results, counted
from reproduction.figures.style import METHOD_STYLES, TRUTH, Style, add_legend
from reproduction.tables.assistance import batch_records
from reproduction.tables.layouts import SOURCES, scene_title
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import pose_error


@dataclass(frozen=True)
class LabelledSplit:
    """One split with the labels of one method."""

    labels: PoseTable  # the poses the method found, chained and assisted
    truth: PoseTable  # the true poses of the same frames
    # Records of assistance in the order of their frames ``start`` to ``stop`` (exclusive); each
    # begins with the last frame of the one before.
    batches: Sequence[Mapping[str, Any]]

    @property
    def errors(self) -> tuple[Array, Array]:
        """Position error in metres (N,) and orientation error in degrees (N,)."""
        position, angle = pose_error(self.labels.world_from_cam, self.truth.world_from_cam)
        return position, np.degrees(angle)


@dataclass(frozen=True)
class LabelledSet:
    """A data set with the labels of all methods: by split, then by method."""

    title: str  # its scene and size
    scene: str
    splits: dict[str, dict[str, LabelledSplit]]

    @property
    def n_frames(self) -> list[int]:
        """Frames of each split."""
        return [len(next(iter(methods.values())).labels) for methods in self.splits.values()]


def read_labelled_set(results: Results) -> LabelledSet | None:
    """Read the first data set of the design that is labelled by estimation; None without one."""
    sets = results.design.estimated
    if not sets:
        return None
    scene, size, _ = sets[0]
    methods = [method for *data_set, method in sets if data_set == [scene, size]]
    splits = {
        split: {
            method: LabelledSplit(
                results.labels(scene, size, method, split),
                results.labels(scene, size, "synfeal", split),
                batch_records(results.root, scene, size, method, split),
            )
            for method in methods
        }
        for split in SPLITS
    }
    return LabelledSet(f"{scene_title(scene)}, {size}", scene, splits)


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
    """Draw errors of labels above a strip of batches, training and test side by side.

    Returns:
        The figure; None where the design has no estimated labels.
    """
    data = read_labelled_set(results)
    if data is None:
        return None
    counts, n_methods = data.n_frames, len(data.splits["train"])
    figure = Figure(figsize=(11.0, 5.6 + 0.25 * n_methods), layout="constrained")
    figure.suptitle(f"{data.title}: {counted(*counts)}")
    panels = figure.subplots(
        3,
        2,
        sharex="col",
        sharey="row",
        width_ratios=[max(count, 0.3 * sum(counts)) for count in counts],
        height_ratios=[3, 3, STRIP * n_methods],
    )
    for column, (split, methods) in enumerate(data.splits.items()):
        panels[0, column].set_title(split)
        _draw_errors(panels[0, column], panels[1, column], methods)
        _draw_batches(panels[2, column], methods)
        panels[2, column].set_xlabel("frame")
        for axes in panels[:, column]:
            # Where batches meet: all methods are cut at the same frames.
            for batch in next(iter(methods.values())).batches[1:]:
                axes.axvline(batch["start"], color="0.82", linewidth=0.7, zorder=0)
            axes.set_xlim(0, counts[column] - 1)
    for axes, label in zip(panels[:2, 0], UNITS, strict=True):
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)  # both splits share the limit, once all lines are drawn
    add_legend(figure, panels[0, 0], 3, MARKED)
    return figure


def _draw_errors(position: Axes, orientation: Axes, methods: Mapping[str, LabelledSplit]) -> None:
    for axes, floor, which in ((position, FLOORS[0], 0), (orientation, FLOORS[1], 1)):
        for start, (method, part) in enumerate(methods.items()):
            # Marks on every so many frames, on others for each line.
            step = max(len(methods), len(part.labels) // MARKS)
            axes.plot(
                part.labels.frame,
                part.errors[which],
                label=SOURCES[method],
                linewidth=1.1,
                markersize=4,
                markevery=(start * step // len(methods), step),
                **METHOD_STYLES[method],
            )
        axes.set_yscale("symlog", linthresh=floor, linscale=0.4)
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(axis="y", color="0.93")


def _draw_batches(axes: Axes, methods: Mapping[str, LabelledSplit]) -> None:
    """Draw one bar per method: filled for assisted batches, crossed for lost ones."""
    for place, (method, part) in enumerate(methods.items()):
        color = METHOD_STYLES[method]["color"]
        for batch in part.batches:
            face = {"facecolor": color if batch["assisted"] else "white"}
            span = (batch["start"], batch["stop"] - 1 - batch["start"])
            axes.broken_barh(
                [span],
                (place - 0.35, 0.7),
                **(LOST if batch["lost"] else face),
                edgecolor="black",
                linewidth=0.8,
            )
    axes.set_yticks(range(len(methods)), [SOURCES[method] for method in methods])
    axes.set_ylim(len(methods) - 0.4, -0.6)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)


ACROSS = 6
PANEL_IN, LEGEND_IN = 2.4, 7.0


def draw_trajectories(results: Results) -> Figure | None:
    """Draw estimated trajectories: a panel per method, training above test.

    Returns:
        The figure; None where the design has no estimated labels.
    """
    data = read_labelled_set(results)
    if data is None:
        return None
    plan, n_methods = read_plan(results, data.scene), len(data.splits["train"])
    across = min(ACROSS, n_methods)
    down = -(-n_methods // across)
    width_m, depth_m = np.ptp(plan.bounds_m, axis=0)
    height = down * (PANEL_IN * depth_m / width_m + 0.3) + 0.3
    figure = Figure(
        figsize=(max(0.4 + PANEL_IN * across, LEGEND_IN), 1.0 + len(SPLITS) * height),
        layout="constrained",
    )
    figure.suptitle(data.title)
    halves = figure.subfigures(len(SPLITS), 1, squeeze=False)[:, 0]
    for part, (split, methods), count in zip(
        halves, data.splits.items(), data.n_frames, strict=True
    ):
        part.suptitle(f"{split}: {count:,} frames", weight="bold", fontsize=10)
        panels = part.subplots(down, across, squeeze=False).ravel()
        for axes, (method, labelled) in zip(panels, methods.items(), strict=False):
            draw_plan(axes, plan)
            draw_paths(axes, labelled, method)
        for axes in panels[n_methods:]:
            axes.set_axis_off()
    add_legend(figure, figure.axes[0], 3)  # colours as in the first panel
    return figure


def draw_paths(axes: Axes, part: LabelledSplit, method: str) -> None:
    """Draw the true path, the estimated one, where batches meet, and which of them were assisted.

    Assisted batches are drawn wide; a ring marks a last label that was replaced by the true pose.

    Args:
        axes: Axes to draw on, seen from above.
        part: The split, with the labels of one method.
        method: Name of the label method, which decides colour and title.
    """
    assisted = [batch for batch in part.batches if batch["assisted"]]
    title = f"{SOURCES[method]}\n{len(assisted)} of {len(part.batches)} batches assisted"
    axes.set_title(title, fontsize=9)
    truth, labels = part.truth.position_m[:, :2], part.labels.position_m[:, :2]
    offsets = LineCollection(list(np.stack([truth, labels], axis=1)), colors="0.4")
    offsets.set(linewidths=0.4, alpha=0.6, zorder=3, label="from true to estimated position")
    axes.add_collection(offsets)
    axes.plot(*truth.T, label="true path", zorder=2, **TRUTH)
    color = METHOD_STYLES[method]["color"]
    axes.plot(*labels.T, label="estimated path", zorder=4, color=color, linewidth=1.0)
    wide = LineCollection([labels[batch["start"] : batch["stop"]] for batch in assisted])
    wide.set(color=color, linewidth=4.0, alpha=0.3, zorder=3.5, label="assisted batch")
    axes.add_collection(wide)
    starts = [batch["start"] for batch in part.batches]
    _mark(axes, labels[starts], "first frame of a batch", 3, color)
    ends = [batch["stop"] - 1 for batch in assisted]
    _mark(axes, labels[ends], "assisted: replaced by the true pose", 6, "white")


def _mark(axes: Axes, points: Array, label: str, size: float, face: str) -> None:
    style: Style = {"marker": "o", "markersize": size, "markerfacecolor": face, "linestyle": ""}
    edge: Style = {"markeredgecolor": "black", "markeredgewidth": 0.7}
    axes.plot(*points.T, zorder=5, label=label, **style, **edge)
