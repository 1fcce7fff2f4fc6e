"""Error against label noise (Table 3) and against data set size (Table 4)."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from synfeal.report.figures.localizer_lines import add_legend, draw_localizers, start_at_zero
from synfeal.report.figures.sources import Results, counted
from synfeal.report.layouts import scene_title

NOISE, SIZE = "table3_inconsistencies", "table4_size"
BLOCKS = {
    "orientation": "orientation noise",
    "position": "position noise",
    "both": "noise in both",
}
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
    """Both scores, one below the other; nothing when the design has no rows of Table 3."""
    design = results.rows_of(NOISE)
    if not design:
        return None
    rows = results.table(NOISE)
    names = dict.fromkeys(f"{scene_title(row.scene)}, {row.size}" for row in design)
    frames = counted(rows["n_train"].iloc[0], rows["n_test"].iloc[0])
    return by_noise(rows, f"{'; '.join(names)}: {frames}")


def by_noise(rows: pd.DataFrame, title: str) -> Figure:
    """The figure of the rows of ``table3_inconsistencies.csv``."""
    blocks = {block: rows[rows["block"] == block] for block in BLOCKS}
    blocks = {block: chosen for block, chosen in blocks.items() if len(chosen)}
    figure = Figure(figsize=(1.6 + 2.9 * len(blocks), 9.0), layout="constrained")
    figure.suptitle(title)
    halves = figure.subfigures(2, 1, squeeze=False, hspace=0.04)[:, 0]
    for half, (end, title) in zip(halves, PROTOCOLS.items(), strict=True):
        half.suptitle(title, weight="bold", fontsize=10)
        units = {f"{measure}{end}": unit for measure, unit in UNITS.items()}
        panels = _draw_panels(half, blocks, units, published=not end)
        for column, (block, chosen) in enumerate(blocks.items()):
            levels = chosen[["noise_m", "noise_deg"]].drop_duplicates()
            labels = [f"{metres:g} m\n{degrees:g}°" for metres, degrees in levels.to_numpy()]
            panels[0, column].set_title(BLOCKS[block], fontsize=9)
            panels[1, column].set_xticks(range(len(labels)), labels)
    add_legend(figure, halves[0].axes[0], 3, published=True)
    return figure


def draw_by_size(results: Results) -> Figure | None:
    """Measures down, scenes across; nothing when the design has no rows of Table 4."""
    return by_size(results.table(SIZE)) if results.rows_of(SIZE) else None


def by_size(rows: pd.DataFrame) -> Figure:
    """The figure of the rows of ``table4_size.csv``."""
    scenes = {str(scene): chosen for scene, chosen in rows.groupby("scene", sort=False)}
    figure = Figure(figsize=(1.4 + 3.9 * len(scenes), 6.6), layout="constrained")
    panels = _draw_panels(figure, scenes, TRUE_UNITS, published=True)
    for column, (scene, chosen) in enumerate(scenes.items()):
        sizes = chosen.drop_duplicates("size")
        labels = [f"{row.size}\n{row.n_train:,} frames" for row in sizes.itertuples()]
        panels[1, column].set_xticks(range(len(labels)), labels)
        panels[1, column].set_xlabel(
            "data set as the paper calls it, and training frames used here"
        )
        panels[0, column].set_title(scene_title(scene))
    add_legend(figure, panels[0, 0], 3, published=True)
    return figure


def _draw_panels(
    figure: Figure | SubFigure,
    parts: Mapping[str, pd.DataFrame],
    units: Mapping[str, str],
    published: bool,
) -> NDArray:  # type: ignore[type-arg]
    """Measures down, parts of a table across; the axes (2, N)."""
    panels = figure.subplots(2, len(parts), squeeze=False, sharey="row", sharex="col")
    for column, rows in enumerate(parts.values()):
        for axes, measure in zip(panels[:, column], units, strict=True):
            draw_localizers(axes, rows, measure, published)
    start_at_zero(panels.flat)
    for axes, label in zip(panels[:, 0], units.values(), strict=True):
        axes.set_ylabel(label)
    return panels
