"""Where the cameras of each data set are: plans with every pose and the way it looks."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D

from synfeal.dataset.pose_table import PoseTable
from synfeal.report.figures.plan_view import Plan, draw_plan, draw_scale_bar, read_plan
from synfeal.report.figures.sources import SPLITS, Array, Results
from synfeal.report.figures.style import SPLIT_STYLES, Style
from synfeal.report.layouts import scene_title

TICK_M = 0.22
DOT = {"train": 3.0, "test": 7.0}  # square points, of small sets
SMALL_SET = 500  # frames; larger sets have thinner marks


def draw(results: Results) -> Figure | None:
    """Sizes across, scenes down."""
    scenes = {scene: results.sizes(scene) for scene in results.scenes}
    if not scenes:
        return None
    plans = {scene: read_plan(results, scene) for scene in scenes}
    columns = max(map(len, scenes.values()))
    heights = [np.ptp(plan.bounds_m[:, 1]) / np.ptp(plan.bounds_m[:, 0]) for plan in plans.values()]
    size = (0.4 + 2.9 * columns, 0.7 + sum(2.7 * height + 0.55 for height in heights))
    figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(h_pad=0.09))
    panels = figure.subplots(len(scenes), columns, squeeze=False, height_ratios=heights)
    for line, (scene, sizes) in zip(panels, scenes.items(), strict=True):
        for axes in line[len(sizes) :]:
            axes.set_axis_off()
        for axes, name in zip(line, sizes, strict=False):
            tables = {split: results.labels(scene, name, "synfeal", split) for split in SPLITS}
            _draw_set(axes, plans[scene], tables, f"{scene_title(scene)}, {name}")
    look: Style = {"linestyle": "-", "linewidth": 0.8, "markersize": 5}
    handles = [Line2D([], [], **look, **SPLIT_STYLES[split]) for split in SPLITS]
    figure.legend(handles, ["training pose", "test pose"], loc="outside lower center", ncols=2)
    return figure


def view_ticks(table: PoseTable) -> Array:
    """Segments (N, 2, 2) in world x and y: from each camera along its optical axis, from above.

    A camera that looks steeply up or down has a short tick.
    """
    start = table.position_m[:, :2]
    forward = table.world_from_cam[:, :2, 2]
    return np.stack([start, start + TICK_M * forward], axis=1)


def _draw_set(axes: Axes, plan: Plan, tables: dict[str, PoseTable], title: str) -> None:
    draw_plan(axes, plan)
    draw_scale_bar(axes, plan)
    for order, (split, table) in enumerate(tables.items(), start=2):
        style = SPLIT_STYLES[split]
        thinner = max(1.0, len(table) / SMALL_SET) ** -0.5
        ticks = LineCollection(
            list(view_ticks(table)), colors=style["color"], linewidths=0.6 * thinner
        )
        ticks.set(rasterized=True, zorder=order, alpha=0.6)
        axes.add_collection(ticks)
        axes.scatter(
            x=table.position_m[:, 0],
            y=table.position_m[:, 1],
            s=DOT[split] * thinner,
            linewidths=0,
            rasterized=True,
            zorder=order + 0.5,
            label=split,
            **style,
        )
    counts = [f"{len(tables[split]):,} {split}" for split in SPLITS]
    axes.set_title(f"{title}\n{' + '.join(counts)} frames", fontsize=9)
