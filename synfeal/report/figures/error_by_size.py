"""Error against data set size: Table 4."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from synfeal.report.figures.localizer_lines import add_legend, draw_localizers, start_at_zero
from synfeal.report.figures.sources import Results, Row
from synfeal.report.layouts import scene_title

TABLE = "table4_size"
MEASURES = {
    "position_m_true": "position error against\nthe true poses (m)",
    "orientation_deg_true": "orientation error against\nthe true poses (°)",
}


def draw(results: Results) -> Figure | None:
    """Measures down, scenes across; nothing when the design has no rows of Table 4."""
    return figure_of(results.table(TABLE)) if results.rows_of(TABLE) else None


def figure_of(rows: Sequence[Row]) -> Figure:
    """The figure of the rows of ``table4_size.csv``."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = Figure(figsize=(1.4 + 3.9 * len(scenes), 6.6), layout="constrained")
    panels = figure.subplots(2, len(scenes), squeeze=False, sharey="row", sharex="col")
    for column, scene in enumerate(scenes):
        chosen = [row for row in rows if row["scene"] == scene]
        for line, measure in enumerate(MEASURES):
            draw_localizers(panels[line, column], chosen, measure, published=True)
        frames = {row["size"]: f"{float(row['n_train']):,.0f} frames" for row in chosen}
        labels = [f"{size}\n{count}" for size, count in frames.items()]
        panels[1, column].set_xticks(range(len(labels)), labels)
        panels[1, column].set_xlabel(
            "data set as the paper calls it, and training frames used here"
        )
        panels[0, column].set_title(scene_title(scene))
    start_at_zero(panels.flat)
    for axes, label in zip(panels[:, 0], MEASURES.values(), strict=True):
        axes.set_ylabel(label)
    add_legend(figure, panels[0, 0], 3, published=True)
    return figure
