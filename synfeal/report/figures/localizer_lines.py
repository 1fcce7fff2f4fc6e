"""Lines of localizers with 95 % limits, of the paper in light grey, of references in dark grey."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from synfeal.config import MODELS
from synfeal.report.figures.sources import Array
from synfeal.report.figures.style import MODEL_STYLES, PUBLISHED, reference_styles
from synfeal.report.layouts import TITLES
from synfeal.report.references import STRUCTURE, titles_in

PAPER = {
    "published (light grey; positions × √3,\nsince print has RMS over the axes)": Line2D(
        [], [], linestyle="-", **PUBLISHED
    )
}
# Localizers stand side by side so that their limits can be told apart; in widths of a place.
ASIDE = dict(zip(MODELS, np.linspace(-0.16, 0.16, len(MODELS)), strict=True))


def draw_localizers(axes: Axes, rows: pd.DataFrame, measure: str, published: bool) -> None:
    """One line per localizer over the places 0, 1, ... of its rows of a table, with 95 % limits.

    ``measure`` is the column of the error; with ``published`` the paper's values are drawn, too.
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


def published_values(rows: pd.DataFrame, measure: str) -> Array:
    """The paper's values (N,) in the unit of ours, left out where they are misprints.

    Its positions are RMS over the axes: distances over the root of three.
    """
    values = rows[f"published_{measure}"]
    if measure == "orientation_deg":
        return values.mask(rows["published_flag"] == "misprint").to_numpy()
    return math.sqrt(3) * values.to_numpy()


# Nothing learnt, a training pose copied, and geometry.
SHOWN = ("constant", "nearest-vlad", STRUCTURE)


def draw_references(axes: Axes, data_sets: Sequence[pd.DataFrame], measure: str) -> None:
    """Grey lines over the places 0, 1, ... on axes whose limits stand; they do not change them.

    ``data_sets`` are rows of ``references.csv``, of the data set at each place. A line that lies
    above the axes is said in words.
    """
    titles = titles_in(pd.concat(data_sets))
    styles = reference_styles(name for name in titles if name not in MODELS)
    above = []
    for name in SHOWN:
        if name not in titles:
            continue
        found = [rows.loc[rows.method == name, measure] for rows in data_sets]
        values = np.array([float(v.iloc[0]) if len(v) else np.nan for v in found])
        look = styles[name] | {"color": "0.35", "linewidth": 1.0, "markersize": 5}
        places = range(len(values))
        axes.plot(places, values, label=titles[name], scalex=False, scaley=False, **look)
        if np.nanmin(values, initial=np.inf) > axes.get_ylim()[1]:
            form = "{:.2f} m" if measure.startswith("position_m") else "{:.0f}°"
            ends = [form.format(end) for end in (np.nanmin(values), np.nanmax(values))]
            above.append(f"↑ {titles[name]}: {' – '.join(dict.fromkeys(ends))}")
    behind = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0}
    place = {"transform": axes.transAxes, "va": "top", "bbox": behind}
    axes.text(0.02, 0.99, "\n".join(above), None, fontsize=7, color="0.35", **place)
