"""Error against label noise (Table 3), data set size (Table 4) and images shown (Table 7)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import pandas as pd
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from baselines.groundtruth.methods import SIMULATOR
from synfeal.config.experiments import split_init
from synfeal.report.figures.localizer_lines import (
    add_legend,
    draw_localizers,
    draw_references,
    start_at_zero,
)
from synfeal.report.figures.sources import Results, counted
from synfeal.report.layouts import STARTS, scene_title
from synfeal.report.references import NAME, read_references

NOISE, SIZE, IMAGES = "table3_inconsistencies", "table4_size", "table7_images_shown"
BLOCKS = {
    "orientation": "orientation noise",
    "position": "position noise",
    "both": "noise in both",
}
LEVEL = ["noise_m", "noise_deg"]
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
    table = read_references(results.root / "tables" / f"{NAME}.csv")
    data_sets = {(row.scene, row.size, row.label_id) for row in design}
    keys = zip(table["scene"], table["size"], table["labels"], strict=True)
    references = table[[key in data_sets for key in keys]]
    return by_noise(rows, references, f"{'; '.join(names)}: {frames}")


def by_noise(rows: pd.DataFrame, references: pd.DataFrame, title: str) -> Figure:
    """The figure of ``table3_inconsistencies.csv``, and of ``references.csv`` on its data sets."""
    blocks = {block: rows[rows["block"] == block] for block in BLOCKS}
    blocks = {block: chosen for block, chosen in blocks.items() if len(chosen)}
    figure = Figure(figsize=(1.6 + 2.9 * len(blocks), 9.0), layout="constrained")
    figure.suptitle(title)
    halves = figure.subfigures(2, 1, squeeze=False, hspace=0.04)[:, 0]
    for half, (end, title) in zip(halves, PROTOCOLS.items(), strict=True):
        half.suptitle(title, weight="bold", fontsize=10)
        units = {f"{measure}{end}": unit for measure, unit in UNITS.items()}
        panels = _draw_panels(half, blocks, units, published=not end)
        _draw_references(panels, blocks, units, references, LEVEL)
        for column, (block, chosen) in enumerate(blocks.items()):
            levels = chosen[LEVEL].drop_duplicates().to_numpy()
            labels = [f"{metres:g} m\n{degrees:g}°" for metres, degrees in levels]
            panels[0, column].set_title(BLOCKS[block], fontsize=9)
            panels[1, column].set_xticks(range(len(labels)), labels)
    add_legend(figure, halves[0].axes[0], 3, published=True)
    return figure


def draw_by_size(results: Results) -> Figure | None:
    """Measures down, scenes across; nothing when the design has no rows of Table 4."""
    if not results.rows_of(SIZE):
        return None
    references = read_references(results.root / "tables" / f"{NAME}.csv")
    return by_size(results.table(SIZE), references[references["labels"] == SIMULATOR])


def by_size(rows: pd.DataFrame, references: pd.DataFrame) -> Figure:
    """The figure of the rows of ``table4_size.csv``, and of ``references.csv`` on true labels."""
    scenes = {str(scene): chosen for scene, chosen in rows.groupby("scene", sort=False)}
    figure = Figure(figsize=(1.4 + 3.9 * len(scenes), 6.6), layout="constrained")
    panels = _draw_panels(figure, scenes, TRUE_UNITS, published=True)
    _draw_references(panels, scenes, TRUE_UNITS, references, ["scene", "size"])
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


def draw_by_images(results: Results) -> Figure | None:
    """Measures down, starts across; nothing when the design has no rows of Table 7."""
    return by_images(results.table(IMAGES)) if results.rows_of(IMAGES) else None


def by_images(rows: pd.DataFrame) -> Figure:
    """The figure of the rows of ``table7_images_shown.csv``."""
    start = rows["init"].map(lambda init: split_init(init)[0])
    parts = {STARTS[name]: chosen for name, chosen in rows.groupby(start, sort=False)}
    figure = Figure(figsize=(1.4 + 3.2 * len(parts), 6.6), layout="constrained")
    names = dict.fromkeys(f"{scene_title(str(row.scene))}, {row.size}" for row in rows.itertuples())
    figure.suptitle("; ".join(names))
    panels = _draw_panels(figure, parts, TRUE_UNITS, published=False)
    for column, (title, chosen) in enumerate(parts.items()):
        shares = [split_init(init)[1] or "all" for init in chosen["init"].unique()]
        panels[1, column].set_xticks(range(len(shares)), shares)
        panels[1, column].set_xlabel("of the images shown")
        panels[0, column].set_title(title)
    add_legend(figure, panels[0, 0], 3, published=False)
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


def _draw_references(
    panels: NDArray,  # type: ignore[type-arg]
    parts: Mapping[str, pd.DataFrame],
    measures: Iterable[str],
    references: pd.DataFrame,
    keys: list[str],
) -> None:
    """Lines of ``references`` into panels; data sets are told apart by the columns ``keys``."""
    for column, rows in enumerate(parts.values()):
        places = rows[keys].drop_duplicates()
        same = [references.merge(places.iloc[[place]], on=keys) for place in range(len(places))]
        for axes, measure in zip(panels[:, column], measures, strict=True):
            draw_references(axes, same, measure)
