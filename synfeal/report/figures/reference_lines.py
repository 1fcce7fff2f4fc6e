"""What localizers are read against, as grey lines beside theirs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from synfeal.config import MODELS
from synfeal.report.crossing import STRUCTURE
from synfeal.report.figures.style import reference_styles
from synfeal.report.references import titles_in

# Nothing learnt, a training pose copied, and geometry.
SHOWN = ("constant", "nearest-vlad", STRUCTURE)


def draw_references(axes: Axes, data_sets: Sequence[pd.DataFrame], measure: str) -> None:
    """Grey lines over the places 0, 1, ... on axes whose limits stand; they do not change them.

    Args:
        axes: where to draw; a line that lies above them is said in words.
        data_sets: rows of ``references.csv``, of the data set at each place.
        measure: column of the error.
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
