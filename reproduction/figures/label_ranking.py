"""Agreement of rankings by labels with those by the truth, by threshold and label set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from reproduction.design.experiments import Experiment
from reproduction.design.ranking import ranked_sets
from reproduction.figures.error_by_design import BLOCKS
from reproduction.figures.sources import Results
from reproduction.figures.style import METHOD_STYLES
from reproduction.tables.label_ranking import (
    MEDIANS,
    NAME,
    THRESHOLDS,
    TITLES,
    TRAINED_ON,
    read_label_ranking,
)
from reproduction.tables.layouts import label_title, scene_title

# Panels of a half: what its label sets have in common.
IMAGES, KINDS = "labels from images", "kinds of error of {:g} m"
ACROSS = 3
# Places of the scores: thresholds side by side, medians apart.
PLACES = {name: place + (name in MEDIANS) * 0.5 for place, name in enumerate(TITLES)}
WIDTH = 0.3  # that the lines of a panel are set apart by, so that limits can be told apart


def draw_label_ranking(results: Results) -> Figure | None:
    """Draw panels of label sets, by what methods learn from; none where all labels are exact."""
    if not ranked_sets(results.design):
        return None
    table = read_label_ranking(results.root / "tables" / f"{NAME}.csv")
    return label_ranking(table, results.design.rows)


def label_ranking(table: pd.DataFrame, rows: Sequence[Experiment]) -> Figure:
    """Draw rows of ``label_ranking.csv`` of the first data set size."""
    first = table.iloc[0]
    table = table[(table.scene == first.scene) & (table["size"] == first["size"])]
    panels = panels_of(table, rows)
    down = -(-len(panels) // ACROSS)
    across = -(-len(panels) // down)
    origins = [origin for origin in TRAINED_ON if (table.trained_on == origin).any()]
    figure = Figure(figsize=(0.6 + 3.4 * across, len(origins) * (0.4 + 3.1 * down)))
    figure.set_layout_engine("constrained")
    figure.suptitle(f"{scene_title(str(first.scene))}, {first['size']}")
    halves = figure.subfigures(len(origins), 1, squeeze=False, hspace=0.03)[:, 0]
    lowest = min(table.tau_low.min(), 0.0)
    for half, origin in zip(halves, origins, strict=True):
        own = table[table.trained_on == origin]
        _draw_half(half, own, panels, down, across)
        half.suptitle(
            f"methods trained on {TRAINED_ON[origin]}: {own.methods.iloc[0]} ranked",
            weight="bold",
            fontsize=10,
        )
        for axes in half.axes:
            axes.set(xlim=(-0.6, max(PLACES.values()) + 0.6), ylim=(lowest - 0.05, 1.05))
    return figure


def panels_of(table: pd.DataFrame, rows: Sequence[Experiment]) -> dict[str, list[str]]:
    """Group label sets of a table: from images, noise by its block, kinds of errors by size."""
    known, panels = set(table.labels), dict[str, list[str]]()
    for row in rows:
        title = _panel(row)
        if title and row.label_id in known and row.label_id not in panels.get(title, ()):
            panels.setdefault(title, []).append(row.label_id)
    return panels


def _panel(row: Experiment) -> str:
    if row.estimated:
        return IMAGES
    if row.table == "table6_label_errors":
        return KINDS.format(row.noise_m)
    return BLOCKS.get(row.block, "")


def _draw_half(
    half: SubFigure,
    table: pd.DataFrame,
    panels: Mapping[str, Sequence[str]],
    down: int,
    across: int,
) -> None:
    axes = half.subplots(down, across, squeeze=False, sharex=True, sharey=True)
    for panel, (title, labels) in zip(axes.flat, panels.items(), strict=False):
        panel.set_title(title, fontsize=9)
        _draw_panel(panel, table, labels)
    for panel in axes.flat[len(panels) :]:
        panel.set_axis_off()
    for panel in axes[:, 0]:
        panel.set_ylabel("Kendall's tau-b with the\nranking by the truth")


def _draw_panel(axes: Axes, table: pd.DataFrame, labels: Sequence[str]) -> None:
    """Draw a line per label set over the thresholds, its medians beside; bars are 95 % limits."""
    aside = np.linspace(-WIDTH, WIDTH, len(labels)) if len(labels) > 1 else [0.0]
    alike = "noise " if all(name.startswith("noise-") for name in labels) else ""
    for name, offset, style in zip(labels, aside, [*METHOD_STYLES.values()] * 2, strict=False):
        own = table[table.labels == name].set_index("score").reindex([*TITLES])
        for scores, line in ((THRESHOLDS, style), (MEDIANS, style | {"linestyle": "none"})):
            part = own.loc[[*scores]]
            reach = [part.tau - part.tau_low, part.tau_high - part.tau]
            axes.errorbar(
                [PLACES[score] + offset for score in scores],
                part.tau,
                yerr=np.clip(np.nan_to_num(np.array(reach, dtype=float)), 0, None),
                label=label_title(name).removeprefix(alike) if scores is THRESHOLDS else None,
                linewidth=1.2,
                markersize=4,
                elinewidth=0.8,
                **line,
            )
    axes.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    names = [TITLES[name].partition(",")[0] for name in THRESHOLDS]
    names = [name.removesuffix(" cm") for name in names] + ["m", "°"]
    axes.set_xticks([*PLACES.values()], names)
    axes.tick_params(axis="x", labelbottom=True)
    axes.set_xlabel("share within x cm and x°                     median   ", fontsize=8)
    axes.grid(axis="y", color="0.92")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=2, fontsize=7.5)
