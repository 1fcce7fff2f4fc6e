"""The answer in one figure: what each change does to the errors, here and in print."""

from __future__ import annotations

import hashlib
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from synfeal.files import atomic_path
from synfeal.report.figures.style import BLUE, RC, VERMILION, Style
from synfeal.report.findings import HERE, MEASURES, PAPER, mean_factor

STYLES: dict[str, Style] = {
    PAPER: {"color": VERMILION, "marker": "D", "label": "in the paper"},
    HERE: {"color": BLUE, "marker": "o", "label": "here"},
}
TITLES = dict(zip(MEASURES, ("position", "orientation"), strict=True))
ASIDE = {PAPER: -0.17, HERE: 0.17}  # of the distance between two changes
TICKS = {0.2: "÷ 5", 0.5: "÷ 2", 1.0: "same", 2.0: "× 2", 5.0: "× 5"}
DPI = 150
SOURCE = "Source"  # of the picture: what it was drawn from


def write_findings_figure(found: pd.DataFrame, out_png: Path) -> None:
    """Draw the factors of :func:`synfeal.report.findings.effects`."""
    with matplotlib.rc_context(rc=RC), atomic_path(out_png) as temporary:
        metadata = {"Software": None, SOURCE: _digest(found)}
        findings_figure(found).savefig(temporary, dpi=DPI, metadata=metadata)


def is_drawn_from(png: Path, found: pd.DataFrame) -> bool:
    """Whether a picture there is shows these factors."""
    if not png.is_file():
        return False
    with Image.open(png) as picture:
        return picture.info.get(SOURCE) == _digest(found)


def findings_figure(found: pd.DataFrame) -> Figure:
    """One line per change, one panel per measure."""
    changes = list(found.change.unique())
    figure = Figure(figsize=(8.2, 0.9 + 0.38 * len(changes)), layout="constrained")
    panels = figure.subplots(1, len(MEASURES), sharex=True, sharey=True)
    for axes, measure in zip(panels, MEASURES, strict=True):
        for source, style in STYLES.items():
            _draw(axes, found[found.measure == measure], changes, source, style)
        _finish(axes, TITLES[measure])
    panels[0].set_yticks(range(len(changes)), changes)
    panels[0].invert_yaxis()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def _draw(axes: Axes, found: pd.DataFrame, changes: list[str], source: str, style: Style) -> None:
    for place, change in enumerate(changes):
        factors = found.factor[(found.change == change) & (found.source == source)]
        y = place + ASIDE[source]
        small = {key: style[key] for key in ("color", "marker")}
        axes.plot(factors, np.full(len(factors), y), ls="", ms=3, alpha=0.45, mew=0, **small)
        mean = mean_factor(found, change, str(found.measure.iloc[0]), source)
        label = style["label"] if place == 0 else None
        axes.plot(mean, y, ls="", ms=7, mec="white", mew=0.6, **small, label=label)


def _finish(axes: Axes, title: str) -> None:
    axes.axvline(1, color="0.3", linewidth=0.8, zorder=0)
    axes.set_xscale("log")
    axes.set_xticks(list(TICKS), list(TICKS.values()))
    axes.minorticks_off()
    axes.grid(axis="x", color="0.92")
    axes.set_axisbelow(True)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(f"median {title} error")


def _digest(found: pd.DataFrame) -> str:
    return hashlib.sha256(found.to_csv(index=False, float_format="%.6g").encode()).hexdigest()
