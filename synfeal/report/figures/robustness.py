"""Error by effect and strength, trained on ideal frames and with effects mixed in, by method."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.references.robustness import STRUCTURE
from synfeal.config.effects import CLEAN, MIXED
from synfeal.report.figures.sources import Results
from synfeal.report.figures.style import BLUE, ORANGE, Style, add_legend, set_log
from synfeal.report.robustness import BLOCKS, METHODS, NAME, effects_title, read_robustness

UNITS = {"position_m": "position error (m)", "orientation_deg": "orientation error (°)"}
STYLES: dict[str, Style] = {
    CLEAN: {"color": BLUE, "marker": "o", "markerfacecolor": "white"},
    MIXED: {"color": ORANGE, "marker": "D"},
}
OFFSET = 0.17  # of the marks of a line, in lines


def draw(results: Results) -> Figure | None:
    """Nothing where the robustness table is not made."""
    path = results.root / "tables" / f"{NAME}.csv"
    return figure_of(read_robustness(path)) if path.exists() else None


def figure_of(table: pd.DataFrame) -> Figure:
    """Measures down, methods across; a line for each of the effects, ideal frames first."""
    effects, methods = list(table.effects.unique()), list(table.method.unique())
    size = (1.9 + 1.55 * len(methods), 1.4 + 0.4 * len(effects))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(2, len(methods), squeeze=False, sharey=True)
    for column, method in enumerate(methods):
        panels[0, column].set_title(METHODS[method].replace(", ", ",\n"), fontsize=9)
        for row, (measure, unit) in enumerate(UNITS.items()):
            axes = panels[row, column]
            if column and method != STRUCTURE:  # which is off by a hundredth of the others
                axes.sharex(panels[row, 0])
            rows = table[table.method == method]
            for trained_on, style in STYLES.items():
                own = rows[rows.trained_on == trained_on].set_index("effects").reindex(effects)
                _draw_errors(axes, own, measure, style, BLOCKS[trained_on])
            set_log(axes, "x")
            axes.grid(axis="x", color="0.92")
            axes.set_xlabel(unit)
    for axes in panels.flat:
        for place in range(1, len(effects), 2):
            axes.axhspan(place - 0.5, place + 0.5, color="0.96", zorder=0)
    panels[0, 0].set_yticks(range(len(effects)), [effects_title(name) for name in effects])
    panels[0, 0].set_ylim(len(effects) - 0.5, -0.5)
    add_legend(figure, panels[0, 0], 2)
    return figure


def _draw_errors(axes: Axes, rows: pd.DataFrame, measure: str, style: Style, label: str) -> None:
    """Medians with 95 % limits, and where ideal frames are as a line to compare with."""
    if rows[measure].isna().all():
        return
    place = np.arange(len(rows)) + (OFFSET if style is STYLES[MIXED] else -OFFSET)
    value, low, high = (rows[f"{measure}{end}"].to_numpy(float) for end in ("", "_low", "_high"))
    axes.hlines(place, low, high, color=style["color"], linewidth=1.0, alpha=0.5)
    axes.plot(value, place, label=label, linestyle="", markersize=4.5, **style)
    axes.axvline(value[0], color=style["color"], linewidth=0.8, linestyle=":", zorder=1)
