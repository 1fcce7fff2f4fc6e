"""The table of all measurements and its picture."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from benchmarks.sfm_settings.measure import SETTING_KEYS
from benchmarks.sfm_settings.settings import CHOSEN, settings
from synfeal.files import atomic_path
from synfeal.report.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RC, VERMILION

Row = dict[str, Any]
DIGITS = 5
_ERRORS = {"median_m": "placed at the first true pose", "fitted_median_m": "after a similarity fit"}
COLUMNS = (
    "scene",
    "every",
    "start",
    "frames",
    "setting",
    *SETTING_KEYS,
    "registered",
    "models",
    "starts",
    "explained",
    "median_m",
    "max_m",
    "last_m",
    "median_deg",
    "max_deg",
    "last_deg",
    "fitted_median_m",
    "mapped_median_m",
    "mapped_median_deg",
    "assisted",
    "features_s",
    "matching_s",
    "mapping_s",
    "seconds",
)


def gather(directory: Path) -> list[Row]:
    """Everything measured so far, by batch in order of the settings."""
    order = list(settings())
    rows: list[Row] = []
    for batch in sorted(path for path in directory.glob("*") if path.is_dir()):
        found = [batch / f"{name}.json" for name in order]
        rows += [json.loads(path.read_text(encoding="utf-8")) for path in found if path.exists()]
    return rows


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """One line per batch and setting."""
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _short(value) for name, value in row.items()} for row in rows)


def draw(path: Path, rows: Sequence[Row]) -> None:
    """Errors against CPU seconds: a column for each scene, two lines for each kind of batch."""
    scenes = sorted({row["scene"] for row in rows})
    kinds = sorted({(row["frames"], row["every"]) for row in rows})
    lines = [(kind, error) for kind in kinds for error in _ERRORS]
    with mpl.rc_context(RC), atomic_path(path) as temporary:
        size = (3.4 * max(1, len(scenes)) + 2.4, 2.6 * max(1, len(lines)))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(max(1, len(lines)), max(1, len(scenes)), squeeze=False)
        for panel_line, (kind, error) in zip(panels, lines, strict=False):
            for axes, scene in zip(panel_line, scenes, strict=False):
                here = [row for row in rows if row["scene"] == scene]
                _panel(axes, [row for row in here if (row["frames"], row["every"]) == kind], error)
                axes.set_title(f"{scene}, {kind[0]} frames", loc="left")
            panel_line[0].set_ylabel(f"{_ERRORS[error]}\nmedian position error, mm")
        styles = [Line2D([], [], label=name, **_style(name)) for name in settings()]
        figure.legend(handles=styles, loc="outside right center")
        figure.savefig(temporary, dpi=130)


def _panel(axes: Axes, rows: Sequence[Row], error: str) -> None:
    """A marker for each setting at the means of its batches; a line spans their errors."""
    for name in settings():
        mine = [row for row in rows if row["setting"] == name and row.get(error) is not None]
        if mine:
            seconds = float(np.mean([row["seconds"] for row in mine]))
            error_mm = np.array([1000 * row[error] for row in mine])
            style = _style(name)
            span = [error_mm.min(), error_mm.max()]
            axes.plot([seconds] * 2, span, color=style["color"], linewidth=0.8)
            axes.plot(seconds, error_mm.mean(), **style)
    if not any(row.get(error) is not None for row in rows):
        axes.set_axis_off()
    axes.set(yscale="log", xlabel="CPU seconds per batch")
    axes.set_xlim(0, 1.1 * max((row["seconds"] for row in rows), default=1.0))
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(color="0.92")


def _style(name: str) -> dict[str, Any]:
    """Colour and marker of a setting; the chosen one is a star."""
    if name == CHOSEN:
        return {"color": VERMILION, "marker": "*", "markersize": 13, "linestyle": "", "zorder": 3}
    index = list(settings()).index(name)
    colors, markers = (BLACK, BLUE, GREEN, PURPLE, ORANGE), "osD^v"
    marker = markers[index % 5] if index < 6 else markers[(index + 2) % 5]
    return {"color": colors[index % 5], "marker": marker, "markersize": 5.5, "linestyle": ""}


def _short(value: Any) -> Any:
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else value
