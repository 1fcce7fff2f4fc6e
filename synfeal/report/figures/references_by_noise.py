"""Error against the truth over the errors of the labels: where regression and structure cross."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synfeal.config import MODELS, Experiment
from synfeal.report.figures.sources import Results
from synfeal.report.figures.style import MODEL_STYLES, add_legend, reference_styles
from synfeal.report.references import (
    NAME,
    STRUCTURE,
    crossing_finding,
    label_title,
    read_references,
    titles_in,
)

TABLE2, TABLE3 = "table2_ground_truth", "table3_inconsistencies"
BLOCKS = {
    "orientation": "orientation noise",
    "position": "position noise",
    "both": "noise in both",
    "": "labels from images",
}
UNITS = {"position_m_true": "position error (m)", "orientation_deg_true": "orientation error (°)"}


def draw(results: Results) -> Figure | None:
    """Nothing without rows of Table 3, or without structure-based poses on them."""
    rows = results.design.rows_of(TABLE3)
    if not rows:
        return None
    table = read_references(results.root / "tables" / f"{NAME}.csv")
    first = rows[0]
    table = table[(table.scene == first.scene) & (table["size"] == first.size)]
    rows += results.design.rows_of(TABLE2)
    return figure_of(table, [r for r in rows if (r.scene, r.size) == (first.scene, first.size)])


def figure_of(table: pd.DataFrame, rows: Sequence[Experiment]) -> Figure:
    """The figure of one data set size: rows of ``references.csv``, and the label sets to show."""
    blocks = [block for block in BLOCKS if any(row.block == block for row in rows)]
    figure = Figure(figsize=(1.6 + 2.9 * len(blocks), 6.8), layout="constrained")
    finding = crossing_finding(table)
    if finding:
        figure.suptitle(finding, wrap=True, fontsize=10)
    panels = figure.subplots(2, len(blocks), squeeze=False, sharey="row", sharex="col")
    for column, block in enumerate(blocks):
        labels = _ordered(dict.fromkeys(r.label_id for r in rows if r.block == block), table)
        panels[0, column].set_title(BLOCKS[block], fontsize=9)
        names = [label_title(name).removeprefix("noise ") for name in labels]
        names = [name.replace(", ", "\n").replace(" w/ ", "\n") for name in names]
        panels[1, column].set_xticks(range(len(labels)), names, rotation=30 if not block else 0)
        for axes, measure in zip(panels[:, column], UNITS, strict=True):
            _draw_methods(axes, table, labels, measure, joined=bool(block))
    for axes, title in zip(panels[:, 0], UNITS.values(), strict=True):
        axes.set_ylabel(title)
    add_legend(figure, panels[0, 0], 4)
    return figure


def _ordered(labels: Sequence[str] | dict[str, None], table: pd.DataFrame) -> list[str]:
    """Noise as the design has it; label sources by the error of structure that is built on them."""
    names = list(labels)
    if any("-p" in name for name in names):  # injected
        return names
    structure = table[table.method == STRUCTURE].set_index("labels")["position_m_true"]
    return sorted(names, key=lambda name: float(structure.fillna(np.inf).get(name, np.inf)))


def _draw_methods(
    axes: Axes, table: pd.DataFrame, labels: list[str], measure: str, joined: bool
) -> None:
    """Marks per method, joined where labels are levels: localizers in colour, others in grey."""
    titles = titles_in(table)
    references = [name for name in titles if name not in MODELS]
    styles = {**reference_styles(references), **MODEL_STYLES}
    for name in (*references, *(m for m in MODELS if m in titles)):
        values = table[table.method == name].set_index("labels")[measure].reindex(labels)
        axes.plot(
            range(len(labels)),
            values.to_numpy(dtype=float),
            label=titles[name],
            linewidth=1.4,
            markersize=4.5,
            **(styles[name] if joined else {**styles[name], "linestyle": "none"}),
        )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(axis="y", color="0.92", which="both")
