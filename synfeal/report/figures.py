"""Figures from the tables: error against data set size, label noise, and speed."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synfeal.config import MODELS
from synfeal.errors import InputError
from synfeal.files import atomic_path
from synfeal.report.layouts import TITLES, scene_title

# Okabe and Ito's colour-blind-safe colours; markers and dashes say the same in grey.
STYLES: dict[str, dict[str, Any]] = {
    "posenet": {"color": "#000000", "marker": "o", "linestyle": "-"},
    "poselstm": {"color": "#0072B2", "marker": "s", "linestyle": "--"},
    "hourglass": {"color": "#D55E00", "marker": "^", "linestyle": "-."},
    "posenet2resnet": {"color": "#009E73", "marker": "D", "linestyle": ":"},
    "posenet2": {"color": "#CC79A7", "marker": "v", "linestyle": (0, (5, 1, 1, 1, 1, 1))},
}
PUBLISHED: dict[str, Any] = {"color": "0.78", "linewidth": 0.8, "markersize": 3, "zorder": 1}
BLOCKS = {
    "orientation": "orientation noise",
    "position": "position noise",
    "both": "noise in both",
}
MEASURES = {
    "position_m": "position error\nagainst labels (m)",
    "position_m_true": "position error\nagainst truth (m)",
    "orientation_deg": "orientation error\nagainst labels (°)",
    "orientation_deg_true": "orientation error\nagainst truth (°)",
}
Row = dict[str, str]


def write_figures(tables_dir: Path, out_dir: Path) -> None:
    """Write ``error_by_size``, ``error_by_noise`` and ``speed_vs_error_collision``: PNG and SVG.

    A figure whose table the profile does not make is not written.

    Args:
        tables_dir: where ``table4_size.csv``, ``table3_inconsistencies.csv`` and
            ``speed_vs_error.csv`` are.
        out_dir: where the figures go.

    Raises:
        InputError: none of these tables is there.
    """
    drawers = {
        "error_by_size": ("table4_size", size_figure),
        "error_by_noise": ("table3_inconsistencies", noise_figure),
        "speed_vs_error_collision": ("speed_vs_error", collision_figure),
    }
    paths = {name: tables_dir / f"{table}.csv" for name, (table, _) in drawers.items()}
    present = {name: path for name, path in paths.items() if path.exists()}
    if not present:
        tables = ", ".join(table for table, _ in drawers.values())
        raise InputError(f"{tables_dir}: holds neither of {tables}.csv")
    for name, path in present.items():
        with path.open(encoding="utf-8", newline="") as file:
            _save(drawers[name][1](list(csv.DictReader(file))), out_dir / name)


def size_figure(rows: Sequence[Row]) -> Figure:
    """Errors of Table 4 against data set size: measures down, scenes across."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    measures = ("position_m", "orientation_deg")
    figure, axes = _panels(measures, [scene_title(scene) for scene in scenes])
    for column, scene in enumerate(scenes):
        chosen = [row for row in rows if row["scene"] == scene]
        frames = {row["size"]: row["n_train"] for row in chosen}
        labels = [f"{size}\n({count})" for size, count in frames.items()]
        for line, measure in enumerate(measures):
            _draw(axes[line][column], chosen, measure, labels)
        axes[-1][column].set_xlabel("data set (training frames)")
    return _finish(figure, axes)


def noise_figure(rows: Sequence[Row]) -> Figure:
    """Errors of Table 3 against label noise: measures down, kinds of noise across."""
    blocks = [block for block in BLOCKS if any(row["block"] == block for row in rows)]
    figure, axes = _panels(tuple(MEASURES), [BLOCKS[block] for block in blocks])
    for column, block in enumerate(blocks):
        chosen = [row for row in rows if row["block"] == block]
        levels = dict.fromkeys((row["noise_m"], row["noise_deg"]) for row in chosen)
        labels = [f"{metres} m\n{degrees}°" for metres, degrees in levels]
        for line, measure in enumerate(MEASURES):
            _draw(axes[line][column], chosen, measure, labels)
    return _finish(figure, axes)


def collision_figure(rows: Sequence[Row]) -> Figure:
    """Wrong decisions against ray speed, one line per scene from the full mesh up to 100 faces."""
    chosen = [row for row in rows if row["stage"] == "collision"]
    scenes = list(dict.fromkeys(row["scene"] for row in chosen))
    figure = Figure(figsize=(5.0, 3.4), layout="constrained")
    axis = figure.subplots()
    for scene, style in zip(scenes, cycle(STYLES.values()), strict=False):
        line = [row for row in chosen if row["scene"] == scene]
        speed = [float(row["items_per_s"]) / 1e6 for row in line]
        percent = [100 * float(row["error"]) for row in line]
        (used,) = (index for index, row in enumerate(line) if row["chosen"] == "1")
        faces = f"{int(line[used]['faces']):,} of {int(line[0]['faces']):,} faces"
        label = f"{scene_title(scene)}, chosen: {faces}"
        axis.plot(speed, percent, linewidth=1.2, markersize=4, **style, label=label)
        axis.plot(speed[used], percent[used], "o", mfc="none", mec=style["color"], markersize=13)
    axis.set_yscale("symlog", linthresh=0.01)
    axis.set_ylim(bottom=0)
    axis.set_xlabel("million rays per second")
    axis.set_ylabel("decisions that differ\nfrom the full mesh (%)")
    axis.legend(fontsize=8, frameon=False)
    return figure


def _panels(measures: Sequence[str], titles: Sequence[str]) -> tuple[Figure, list[list[Axes]]]:
    """A grid of axes that share the vertical axis along a row."""
    size = (1.6 + 2.8 * len(titles), 0.9 + 1.8 * len(measures))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(len(measures), len(titles), squeeze=False, sharey="row", sharex="col")
    grid = [list(line) for line in axes]
    for title, axis in zip(titles, grid[0], strict=True):
        axis.set_title(title, fontsize=10)
    for measure, line in zip(measures, grid, strict=True):
        line[0].set_ylabel(MEASURES[measure], fontsize=9)
    return figure, grid


def _draw(axis: Axes, rows: Sequence[Row], measure: str, labels: Sequence[str]) -> None:
    """One line per localizer, and the published one in grey where the paper has that measure."""
    places = range(len(labels))
    for model in MODELS:
        chosen = [row for row in rows if row["model"] == model]
        style = STYLES[model]
        if not measure.endswith("_true"):
            values = [_published(row, measure) for row in chosen]
            axis.plot(places, values, **{**style, **PUBLISHED})
        values = [_number(row[measure]) for row in chosen]
        axis.plot(places, values, label=TITLES[model], linewidth=1.6, markersize=5, **style)
    axis.set_xticks(list(places), labels, fontsize=8)


def _finish(figure: Figure, axes: list[list[Axes]]) -> Figure:
    for axis in (axis for line in axes for axis in line):
        axis.set_ylim(bottom=0)
        axis.grid(axis="y", color="0.92")
        axis.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0][0].get_legend_handles_labels()
    (reference,) = axes[0][0].plot([], [], linestyle="-", **PUBLISHED)
    figure.legend(
        [*handles, reference],
        [*labels, "published"],
        loc="outside lower center",
        ncols=6 if len(axes[0]) > 2 else 3,
        fontsize=8,
        frameon=False,
        handlelength=3.5,
    )
    return figure


def _number(text: str) -> float:
    """A value of a table; an empty cell leaves a gap in the line."""
    return float(text) if text else float("nan")


def _published(row: Row, measure: str) -> float:
    """The published value, left out where the paper misprints it."""
    misprint = measure == "orientation_deg" and row["published_flag"] == "misprint"
    return float("nan") if misprint else _number(row[f"published_{measure}"])


def _save(figure: Figure, stem: Path) -> None:
    """Write PNG and SVG; no date and fixed identifiers, so that equal numbers give equal files."""
    with matplotlib.rc_context({"svg.hashsalt": "synfeal"}):
        for suffix, metadata in ((".png", {}), (".svg", {"Date": None})):
            with atomic_path(stem.with_suffix(suffix)) as temporary:
                figure.savefig(temporary, dpi=150, metadata=metadata)
