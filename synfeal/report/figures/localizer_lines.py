"""Panels with one line per localizer, 95 % limits, and the published line in light grey."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from synfeal.config import MODELS
from synfeal.report.figures.sources import Array
from synfeal.report.figures.style import MODEL_STYLES, PUBLISHED
from synfeal.report.layouts import TITLES

PUBLISHED_TITLE = "published (light grey; positions × √3,\nsince print has RMS over the axes)"
# Localizers stand side by side so that their limits can be told apart; in widths of a place.
ASIDE = dict(zip(MODELS, np.linspace(-0.16, 0.16, len(MODELS)), strict=True))


def draw_localizers(axes: Axes, rows: pd.DataFrame, measure: str, published: bool) -> None:
    """One line per localizer over the places 0, 1, ... of its rows.

    Args:
        axes: where to draw.
        rows: rows of a table, for each localizer in the order of the places.
        measure: column of the error; its limits are the columns ``_low`` and ``_high``.
        published: also draw the paper's values of that error.
    """
    for model in MODELS:
        chosen = rows[rows["model"] == model]
        places = np.arange(len(chosen)) + ASIDE[model]
        style = MODEL_STYLES[model]
        if published:
            paper = published_values(chosen, measure.removesuffix("_true"))
            axes.plot(places, paper, **{**style, **PUBLISHED})
        values = chosen[measure].to_numpy()
        # Limits enclose a median.
        reach = [values - chosen[f"{measure}_low"], chosen[f"{measure}_high"] - values]
        axes.errorbar(
            places,
            values,
            yerr=np.nan_to_num(np.clip(np.stack(reach), 0, None)),
            label=TITLES[model],
            linewidth=1.5,
            markersize=4.5,
            elinewidth=0.9,
            capsize=1.8,
            **style,
        )
    axes.grid(axis="y", color="0.92")
    axes.set_axisbelow(True)


def start_at_zero(panels: Iterable[Axes]) -> None:
    """Let the error axes begin at 0; only when all is drawn, for it ends their adapting to data."""
    for axes in panels:
        axes.set_ylim(bottom=0)


def published_values(rows: pd.DataFrame, measure: str) -> Array:
    """The paper's values (N,) in the unit of ours, left out where they are misprints.

    Its positions are RMS over the axes: distances over the root of three.
    """
    values = rows[f"published_{measure}"]
    if measure == "orientation_deg":
        return values.mask(rows["published_flag"] == "misprint").to_numpy()
    return math.sqrt(3) * values.to_numpy()


def add_legend(figure: Figure | SubFigure, axes: Axes, columns: int, published: bool) -> None:
    """A legend below everything: the localizers of ``axes``, and how the paper's are drawn."""
    handles, labels = axes.get_legend_handles_labels()
    if published:
        (reference,) = axes.plot([], [], linestyle="-", **PUBLISHED)
        handles, labels = [*handles, reference], [*labels, PUBLISHED_TITLE]
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)
