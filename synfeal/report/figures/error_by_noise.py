"""Error against label noise: Table 3, in the paper's protocol and against the true poses."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure, SubFigure

from synfeal.report.figures.localizer_lines import add_legend, draw_localizers, start_at_zero
from synfeal.report.figures.sources import Results, Row, counted
from synfeal.report.layouts import scene_title

TABLE = "table3_inconsistencies"
BLOCKS = {
    "orientation": "orientation noise",
    "position": "position noise",
    "both": "noise in both",
}
UNITS = {"position_m": "position error (m)", "orientation_deg": "orientation error (°)"}
PROTOCOLS = {
    "": "Against the noisy labels the test set carries: the paper's protocol",
    "_true": "Against the simulator's true poses",
}


def draw(results: Results) -> Figure | None:
    """Both scores, one below the other; nothing when the design has no rows of Table 3."""
    design = results.rows_of(TABLE)
    if not design:
        return None
    rows = results.table(TABLE)
    names = dict.fromkeys(f"{scene_title(row.scene)}, {row.size}" for row in design)
    return figure_of(rows, f"{'; '.join(names)}: {counted(rows[0]['n_train'], rows[0]['n_test'])}")


def figure_of(rows: Sequence[Row], title: str) -> Figure:
    """The figure of the rows of ``table3_inconsistencies.csv``."""
    blocks = [block for block in BLOCKS if any(row["block"] == block for row in rows)]
    figure = Figure(figsize=(1.6 + 2.9 * len(blocks), 9.0), layout="constrained")
    figure.suptitle(title)
    halves = figure.subfigures(2, 1, squeeze=False, hspace=0.04)[:, 0]
    for half, (end, title) in zip(halves, PROTOCOLS.items(), strict=True):
        _draw_protocol(half, rows, blocks, end, title)
    add_legend(figure, halves[0].axes[0], 3, published=True)
    return figure


def _draw_protocol(
    half: SubFigure, rows: Sequence[Row], blocks: Sequence[str], end: str, title: str
) -> None:
    """Measures down, kinds of noise across, for one of the two scores."""
    half.suptitle(title, weight="bold", fontsize=10)
    panels = half.subplots(2, len(blocks), squeeze=False, sharey="row", sharex="col")
    for column, block in enumerate(blocks):
        chosen = [row for row in rows if row["block"] == block]
        levels = dict.fromkeys((row["noise_m"], row["noise_deg"]) for row in chosen)
        labels = [f"{metres} m\n{degrees}°" for metres, degrees in levels]
        panels[0, column].set_title(BLOCKS[block], fontsize=9)
        panels[1, column].set_xticks(range(len(labels)), labels)
        for line, measure in enumerate(UNITS):
            draw_localizers(panels[line, column], chosen, measure + end, published=not end)
    start_at_zero(panels.flat)
    for axes, label in zip(panels[:, 0], UNITS.values(), strict=True):
        axes.set_ylabel(label)
