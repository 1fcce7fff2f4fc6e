"""Every cell of Tables 2 to 5 against the printed one, in one figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baselines.config.learning import MODELS
from reproduction.figures.style import MODEL_STYLES, Style, set_log
from reproduction.report.paper_cells import ratios
from reproduction.report.stamped import digest, stamped_png
from reproduction.tables.layouts import TITLES
from synfeal.records.tables import rows_of

AXES = {"position": "position error, m", "orientation": "orientation error, °"}


def cells_digest(cells: pd.DataFrame) -> str:
    """Hash the cells that the figure shows."""
    return digest(
        [
            f"{row.table}|{row.row}|{row.model}|{row.quantity}|{row.printed:.6g}|{row.ours:.6g}"
            f"|{row.replications}"
            for row in rows_of(cells)
        ]
    )


def paper_picture(cells: pd.DataFrame) -> bytes:
    """Draw the figure as PNG.

    Args:
        cells: As :func:`reproduction.report.paper_cells.paper_cells` returns them.
    """
    return stamped_png(lambda: paper_figure(cells), cells_digest(cells))


def paper_figure(cells: pd.DataFrame) -> Figure:
    """Draw one axis per error: printed across, ours upwards, a mark per cell.

    Where some cells are pooled over replications, those of a single run are hollow.
    """
    figure = Figure(figsize=(9.0, 4.9), layout="constrained")
    all_axes = figure.subplots(1, len(AXES))
    for axes, (quantity, label) in zip(all_axes, AXES.items(), strict=True):
        _draw(axes, cells[cells.quantity == quantity], label)
    times = [ratios(cells, quantity) for quantity in AXES]
    handles, models = all_axes[0].get_legend_handles_labels()
    figure.legend(
        handles,
        [_title(model, times) for model in models],
        loc="outside lower center",
        ncols=len(models),
        handlelength=1.0,
        title="Ours over print, position and orientation, geometric mean over Table 4",
    )
    return figure


def _title(model: str, times: Sequence[Mapping[str, float]]) -> str:
    """Name a network, with both ratios where the run has a Table 4."""
    found = [f"× {of_error[model]:.2f}" for of_error in times if model in of_error]
    return f"{TITLES[model]}\n{', '.join(found)}"


def _draw(axes: Axes, cells: pd.DataFrame, label: str) -> None:
    for model in MODELS:
        own = cells[cells.model == model]
        pooled = own.replications == cells.replications.max()
        style = {key: MODEL_STYLES[model][key] for key in ("color", "marker")}
        full: Style = {"linestyle": "", "ms": 5, "mec": "white", "mew": 0.4}
        axes.plot(own.printed[pooled], own.ours[pooled], label=model, **full, **style)
        hollow: Style = {"linestyle": "", "ms": 4, "mfc": "none", "mew": 0.8}
        axes.plot(own.printed[~pooled], own.ours[~pooled], **hollow, **style)
    ends = [
        0.8 * cells[["printed", "ours"]].min().min(),
        1.25 * cells[["printed", "ours"]].max().max(),
    ]
    axes.plot(ends, ends, color="0.6", lw=0.9, zorder=0)
    axes.set(xlim=ends, ylim=ends, aspect="equal")
    set_log(axes, "x", "y")
    axes.set_xlabel(f"printed {label}")
    axes.set_ylabel(f"our {label}")
    axes.text(0.03, 0.97, "worse than printed", transform=axes.transAxes, va="top", color="0.45")
    axes.text(0.97, 0.03, "better", transform=axes.transAxes, ha="right", color="0.45")
