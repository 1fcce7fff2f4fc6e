"""The table of all rows, and the picture of errors against time."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.rgbd_settings.settings import CHOSEN, settings
from synfeal.files import atomic_path
from synfeal.report.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RC, VERMILION

Row = dict[str, Any]
_TEXT = ("scene", "setting", "method", "start", "sensor")


def append_row(path: Path, row: Row) -> None:
    """Add a line; the first one brings the head of the table."""
    is_new = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(row), lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow({key: _short(value) for key, value in row.items()})


def read_rows(path: Path) -> list[Row]:
    """All rows; none when there is no table."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return [
            {key: value if key in _TEXT else float(value) for key, value in row.items()}
            for row in csv.DictReader(file)
        ]


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Position error against processor time: a panel for each batch."""
    places = sorted({(row["scene"], row["start_frame"]) for row in rows})
    n_columns = min(2, len(places))
    n_lines = -(-len(places) // n_columns)
    with mpl.rc_context(RC), atomic_path(path) as temporary:
        figure = Figure(figsize=(3.6 * n_columns + 2.2, 2.9 * n_lines), layout="constrained")
        panels = figure.subplots(n_lines, n_columns, squeeze=False).ravel()
        for axes, (scene, start) in zip(panels, places, strict=False):
            _panel(axes, [r for r in rows if (r["scene"], r["start_frame"]) == (scene, start)])
            axes.set_title(f"{scene}, from frame {start:.0f}", loc="left")
        for axes in panels[len(places) :]:
            axes.set_axis_off()
        shown = [name for name in settings() if any(row["setting"] == name for row in rows)]
        styles = [Line2D([], [], label=name, **_style(name)) for name in shown]
        figure.legend(handles=styles, loc="outside right center")
        figure.savefig(temporary, dpi=130)


def _panel(axes: Axes, rows: Sequence[Row]) -> None:
    """A marker for each setting at its median error; a line reaches to the largest."""
    for row in rows:
        style = _style(row["setting"])
        error_mm = 1000 * np.array([row["g2o_median_m"], row["g2o_max_m"]])
        axes.plot([row["seconds"]] * 2, error_mm, color=style["color"], linewidth=0.8)
        axes.plot(row["seconds"], error_mm[0], **style)
    axes.set(
        yscale="log", xlabel="CPU seconds per batch", ylabel="position error, mm\n(median to max)"
    )
    axes.set_xlim(0, 1.1 * max(row["seconds"] for row in rows))
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(color="0.92")


def _style(name: str) -> dict[str, Any]:
    """Colour and marker of a setting; the chosen one is a star."""
    if name == CHOSEN:
        return {"color": VERMILION, "marker": "*", "markersize": 13, "linestyle": "", "zorder": 3}
    index = list(settings()).index(name) - 1
    colors = (BLACK, BLUE, GREEN, PURPLE, ORANGE)
    marker = "os"[index // 5 % 2] if index < 10 else "^"
    return {"color": colors[index % 5], "marker": marker, "markersize": 5.5, "linestyle": ""}


def _short(value: Any) -> Any:
    return f"{value:.5g}" if isinstance(value, float) else value
