"""What training costs against how wrong localizers are: a panel for every scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synfeal.report.figures.pareto import pareto_front
from synfeal.report.figures.sources import Results, Row
from synfeal.report.figures.style import MODEL_STYLES, Style
from synfeal.report.layouts import TITLES, scene_title


def draw(results: Results) -> Figure | None:
    """The figure; nothing when the table has no rows of trainings."""
    rows = [row for row in results.table("speed_vs_error") if row["stage"] == "training"]
    return figure_of(rows) if rows else None


def figure_of(rows: Sequence[Row]) -> Figure:
    """The figure of the rows of ``speed_vs_error.csv`` whose stage is ``training``."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = Figure(figsize=(1.0 + 3.4 * len(scenes), 3.6), layout="constrained")
    panels = figure.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    for axes, scene in zip(panels, scenes, strict=True):
        draw_panel(axes, [row for row in rows if row["scene"] == scene])
        axes.set(title=scene_title(scene), xlabel="images per second of processor time")
    # Set once for all: a limit set by the first panel would cut off marks of the next.
    panels[0].set_ylim(0, 1.1 * max(float(row["error"]) for row in rows))
    panels[0].set_ylabel("median position error (m)")
    handles, labels = max(
        (axes.get_legend_handles_labels() for axes in panels), key=lambda found: len(found[1])
    )
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def draw_panel(axes: Axes, rows: Sequence[Row]) -> None:
    """A mark for every localizer of one scene, filled on the Pareto front."""
    speed = np.array([float(row["items_per_s"]) for row in rows])
    error_m = np.array([float(row["error"]) for row in rows])
    styles = {TITLES[model]: style for model, style in MODEL_STYLES.items()}
    for x, y, row, on_front in zip(
        speed, error_m, rows, pareto_front(1.0 / speed, error_m), strict=True
    ):
        style: Style = styles[row["variant"]] | {"linestyle": "", "markersize": 8}
        style["markerfacecolor"] = style["color"] if on_front else "none"
        axes.plot(x, y, label=row["variant"], **style)
    axes.set_xlim(0, 1.15 * speed.max())
    axes.grid(color="0.94")
    axes.set_axisbelow(True)
