"""Error against label noise (Table 3), data set size (Table 4) and images shown (Table 7)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from baselines.config.learning import MODELS
from baselines.labels.methods import SIMULATOR
from reproduction.design.experiments import split_init
from reproduction.figures.sources import Array, Results, counted
from reproduction.figures.style import MODEL_STYLES, PUBLISHED, add_legend, reference_styles
from reproduction.tables.layouts import DOSE, STARTS, TITLES, scene_title
from reproduction.tables.references import NAME, STRUCTURE, read_references, titles_in

PAPER = {
    "published (light grey; positions × √3,\nsince print has RMS over the axes)": Line2D(
        [], [], linestyle="-", **PUBLISHED
    )
}
# Localizers stand side by side so that their limits can be told apart; in widths of a place.
ASIDE = dict(zip(MODELS, np.linspace(-0.16, 0.16, len(MODELS)), strict=True))


def draw_localizers(axes: Axes, rows: pd.DataFrame, measure: str, published: bool) -> None:
    """Draw one line per localizer over the places 0, 1, ..., with 95 % limits.

    Args:
        axes: Axes to draw on.
        rows: Rows of a table, one place after another; each localizer has one at every place.
        measure: Column of the error; its limits are in the columns that end in ``_low`` and
            ``_high``.
        published: Also draw the paper's values, in grey.
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
    """Return the paper's values (N,) in our unit; NaN where they are misprints.

    Its positions are RMS over the axes: distances over the root of three.
    """
    values = rows[f"published_{measure}"]
    if measure == "orientation_deg":
        return values.mask(rows["published_flag"] == "misprint").to_numpy()
    return math.sqrt(3) * values.to_numpy()


# Nothing learnt, a training pose copied, and geometry.
SHOWN = ("constant", "nearest-vlad", STRUCTURE)


def draw_references(axes: Axes, data_sets: Sequence[pd.DataFrame], measure: str) -> None:
    """Draw the errors of reference methods as grey lines, without changing the axes' limits.

    A method whose errors all lie above the axes is named in words.

    Args:
        axes: Axes of localizers' errors over the places 0, 1, ....
        data_sets: Rows of ``references.csv`` of the data set at each place.
        measure: Column of the error.
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


NOISE, SIZE, IMAGES = "table3_inconsistencies", "table4_size", "table7_images_shown"
BLOCKS = {
    "orientation": "orientation noise",
    "position": "position noise",
    "both": "noise in both",
}
LEVEL = ["noise_m", "noise_deg"]
DATA_SET = ["scene", "size"]
UNITS = {"position_m": "position error (m)", "orientation_deg": "orientation error (°)"}
TRUE_UNITS = {
    "position_m_true": "position error against\nthe true poses (m)",
    "orientation_deg_true": "orientation error against\nthe true poses (°)",
}
PROTOCOLS = {
    "": "Against the noisy labels the test set carries: the paper's protocol",
    "_true": "Against the simulator's true poses",
}


def draw_by_noise(results: Results) -> Figure | None:
    """Draw errors over the noise of the labels (Table 3), against labels above, the truth below.

    Returns:
        The figure; None where the design has no rows of Table 3.
    """
    design = results.design.rows_of(NOISE)
    if not design:
        return None
    rows = results.table(NOISE)
    names = dict.fromkeys(f"{scene_title(row.scene)}, {row.size}" for row in design)
    frames = counted(rows["n_train"].iloc[0], rows["n_test"].iloc[0])
    table = read_references(results.root / "tables" / f"{NAME}.csv")
    data_sets = {(row.scene, row.size, row.label_id) for row in design}
    keys = zip(table["scene"], table["size"], table["labels"], strict=True)
    references = table[[key in data_sets for key in keys]]
    title = f"{'; '.join(names)}: {frames}"
    if results.design.noise_dose == "code":
        title = f"{title}\n{DOSE}"
    return by_noise(rows, references, title)


def by_noise(rows: pd.DataFrame, references: pd.DataFrame, title: str) -> Figure:
    """Draw errors over the noise of the labels, against the labels above and the truth below.

    Args:
        rows: Rows of ``table3_inconsistencies.csv``.
        references: Rows of ``references.csv``; those on the same data sets are drawn.
        title: Title of the whole figure.
    """
    blocks = {name: rows[rows["block"] == block] for block, name in BLOCKS.items()}
    blocks = {name: chosen for name, chosen in blocks.items() if len(chosen)}
    figure = Figure(figsize=(1.6 + 2.9 * len(blocks), 9.0), layout="constrained")
    figure.suptitle(title)
    halves = figure.subfigures(2, 1, squeeze=False, hspace=0.04)[:, 0]
    for half, (end, title) in zip(halves, PROTOCOLS.items(), strict=True):
        half.suptitle(title, weight="bold", fontsize=10)
        units = {f"{measure}{end}": unit for measure, unit in UNITS.items()}
        panels = _draw_panels(half, blocks, units, _levels, published=not end)
        _draw_references(panels, blocks, units, references, LEVEL)
        for axes in panels[0]:
            axes.title.set_size(9)
    add_legend(figure, halves[0].axes[0], 3, PAPER)
    return figure


def _levels(rows: pd.DataFrame) -> list[str]:
    levels = rows[LEVEL].drop_duplicates().to_numpy()
    return [f"{metres:g} m\n{degrees:g}°" for metres, degrees in levels]


def draw_by_size(results: Results) -> Figure | None:
    """Draw errors over the size of the data set (Table 4): measures down, scenes across.

    Returns:
        The figure; None where the design has no rows of Table 4.
    """
    if not results.design.rows_of(SIZE):
        return None
    references = read_references(results.root / "tables" / f"{NAME}.csv")
    return by_size(results.table(SIZE), references[references["labels"] == SIMULATOR])


def by_size(rows: pd.DataFrame, references: pd.DataFrame) -> Figure:
    """Draw rows of ``table4_size.csv``, and of ``references.csv`` on true labels."""
    scenes = {scene_title(str(name)): chosen for name, chosen in rows.groupby("scene", sort=False)}
    figure = Figure(figsize=(1.4 + 3.9 * len(scenes), 6.6), layout="constrained")
    panels = _draw_panels(figure, scenes, TRUE_UNITS, _sizes, published=True)
    _draw_references(panels, scenes, TRUE_UNITS, references, DATA_SET)
    for axes in panels[1]:
        axes.set_xlabel("data set as the paper calls it, and training frames used here")
    add_legend(figure, panels[0, 0], 3, PAPER)
    return figure


def _sizes(rows: pd.DataFrame) -> list[str]:
    return [f"{r.size}\n{r.n_train:,} frames" for r in rows.drop_duplicates("size").itertuples()]


def draw_by_images(results: Results) -> Figure | None:
    """Draw errors over the images shown (Table 7): measures down, starts across.

    Returns:
        The figure; None where the design has no rows of Table 7.
    """
    return by_images(results.table(IMAGES)) if results.design.rows_of(IMAGES) else None


def by_images(rows: pd.DataFrame) -> Figure:
    """Draw rows of ``table7_images_shown.csv``."""
    start = rows["init"].map(lambda init: split_init(init)[0])
    parts = {STARTS[name]: chosen for name, chosen in rows.groupby(start, sort=False)}
    figure = Figure(figsize=(1.4 + 3.2 * len(parts), 6.6), layout="constrained")
    names = dict.fromkeys(f"{scene_title(str(row.scene))}, {row.size}" for row in rows.itertuples())
    figure.suptitle("; ".join(names))
    panels = _draw_panels(figure, parts, TRUE_UNITS, _shares, published=False)
    for axes in panels[1]:
        axes.set_xlabel("of the images shown")
    add_legend(figure, panels[0, 0], 3)
    return figure


def _shares(rows: pd.DataFrame) -> list[str]:
    return [split_init(init)[1] or "all" for init in rows["init"].unique()]


def _draw_panels(
    figure: Figure | SubFigure,
    parts: Mapping[str, pd.DataFrame],
    units: Mapping[str, str],
    places: Callable[[pd.DataFrame], list[str]],
    published: bool,
) -> NDArray:  # type: ignore[type-arg]
    """Draw measures down, parts of a table by title across, ``places`` below: axes (2, N)."""
    panels = figure.subplots(2, len(parts), squeeze=False, sharey="row", sharex="col")
    for column, (title, rows) in zip(panels.T, parts.items(), strict=True):
        for axes, measure in zip(column, units, strict=True):
            draw_localizers(axes, rows, measure, published)
        names = places(rows)
        column[1].set_xticks(range(len(names)), names)
        column[0].set_title(title)
    for line, unit in zip(panels, units.values(), strict=True):
        line[0].set_ylim(bottom=0)  # when all is drawn: it ends the adapting to data
        line[0].set_ylabel(unit)
    return panels


def _draw_references(
    panels: NDArray,  # type: ignore[type-arg]
    parts: Mapping[str, pd.DataFrame],
    measures: Mapping[str, str],
    references: pd.DataFrame,
    keys: Sequence[str],
) -> None:
    """Draw lines of ``references`` into panels; ``keys`` tell data sets apart."""
    for column, rows in zip(panels.T, parts.values(), strict=True):
        places = rows[[*keys]].drop_duplicates()
        same = [references.merge(places.iloc[[place]]) for place in range(len(places))]
        for axes, measure in zip(column, measures, strict=True):
            draw_references(axes, same, measure)
