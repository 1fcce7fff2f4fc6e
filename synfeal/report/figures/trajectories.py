"""Estimated camera paths over the true ones, from above."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from synfeal.report.figures.label_sets import LabelledSplit, read_labelled_set
from synfeal.report.figures.plan_view import draw_plan, draw_scale_bar, read_plan
from synfeal.report.figures.sources import SPLITS, Results, counted
from synfeal.report.figures.style import METHOD_STYLES, TRUTH
from synfeal.report.layouts import SOURCES, scene_title


def draw(results: Results) -> Figure | None:
    """Methods across, training and test below each other."""
    data = read_labelled_set(results)
    if data is None:
        return None
    plan = read_plan(results, data.scene)
    counts = [len(next(iter(data.methods.values()))[split].labels) for split in SPLITS]
    shape = np.ptp(plan.bounds_m, axis=0)
    size = (0.4 + 3.5 * len(data.methods), 1.1 + 2 * (3.3 * shape[1] / shape[0] + 0.3))
    figure = Figure(figsize=size, layout="constrained")
    figure.suptitle(f"{scene_title(data.scene)}, {data.size}: {counted(*counts)}")
    panels = figure.subplots(2, len(data.methods), squeeze=False)
    for column, (method, parts) in enumerate(data.methods.items()):
        for axes, split in zip(panels[:, column], SPLITS, strict=True):
            draw_plan(axes, plan)
            draw_scale_bar(axes, plan)
            draw_paths(axes, parts[split], method)
            axes.set_title(f"{SOURCES[method]}, {split}", fontsize=9)
    _add_legend(figure, panels[0])
    return figure


def draw_paths(axes: Axes, part: LabelledSplit, method: str) -> None:
    """The true path, the estimated one, and where assistance put a label on the true pose."""
    truth, labels = part.truth.position_m[:, :2], part.labels.position_m[:, :2]
    offsets = LineCollection(list(np.stack([truth, labels], axis=1)), colors="0.4")
    offsets.set(linewidths=0.5, zorder=3, label="from true to estimated position")
    axes.add_collection(offsets)
    axes.plot(*truth.T, label="true path", zorder=2, **TRUTH)
    style = METHOD_STYLES[method] | {"marker": "", "linewidth": 1.1}
    axes.plot(*labels.T, label=SOURCES[method], zorder=4, **style)
    ends = [batch.stop - 1 for batch in part.batches if batch.assisted]
    axes.plot(
        *labels[ends].T,
        linestyle="",
        marker="o",
        markersize=5,
        markerfacecolor="white",
        markeredgecolor="black",
        zorder=5,
        label="assisted: replaced by the true pose",
    )


def _add_legend(figure: Figure, panels: list[Axes]) -> None:
    """One entry per kind of line; the ring stands for those of all methods."""
    entries: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=3)
