"""Figures of speed against error: variants of a stage, the best of them, the choice."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from baselines.labels.methods import METHODS
from reproduction.figures.sources import Draw, Results
from reproduction.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    METHOD_STYLES,
    MODEL_STYLES,
    ORANGE,
    PURPLE,
    VERMILION,
    Style,
    add_legend,
    set_log,
)
from reproduction.tables.layouts import TITLES, scene_title
from synfeal.records.tables import rows_of


def pareto_front(seconds: ArrayLike, errors: ArrayLike) -> NDArray[np.bool_]:
    """Mark those of N variants (costs and errors (N,), less is better) that no other dominates.

    A variant dominates another when it is at least as good in both and better in one; of equal
    variants none dominates the other.
    """
    cost = np.stack([np.asarray(seconds, np.float64), np.asarray(errors, np.float64)], axis=1)
    order = np.lexsort((cost[:, 1], cost[:, 0]))
    # Among all variants that cost no more, those later in this order have no smaller error.
    best = np.minimum.accumulate(cost[order, 1])
    first = np.concatenate([[True], cost[order[1:], 1] < best[:-1]])
    starts = cost[order[first]]
    return np.array((cost[:, None] == starts[None]).all(axis=2).any(axis=1), dtype=np.bool_)


# The style of what has a name of its own, by title.
NAMED = {method.title: METHOD_STYLES[name] for name, method in METHODS.items()}
NAMED |= {TITLES[model]: style for model, style in MODEL_STYLES.items()}
SIZE = (6.4, 4.6)
RING: Style = {"marker": "o", "markerfacecolor": "none", "markersize": 13, "linestyle": ""}


def of_stage(stage: str, figure: Callable[[pd.DataFrame], Figure]) -> Draw:
    """Return the drawing of a stage's rows of ``speed_vs_error.csv``; None where there are none."""

    def draw(results: Results) -> Figure | None:
        rows = results.speeds(stage)
        return figure(rows) if len(rows) else None

    return draw


def collision_figure(rows: pd.DataFrame) -> Figure:
    """Draw the error of meshes for collisions against their speed, one line per scene."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    for (_, scene), style in zip(rows.groupby("scene", sort=False), cycle(MODEL_STYLES.values())):
        _draw_meshes(axes, scene, style)
    _finish(axes, "Face counts of the collision mesh", linear_below=0.01)
    axes.set_xlabel("million rays per second")
    axes.set_ylabel("decisions that differ from the full mesh (%)")
    add_legend(figure, axes, 1)
    return figure


def _draw_meshes(axes: Axes, rows: pd.DataFrame, style: Style) -> None:
    """Draw meshes of a scene small and open; those on the front filled, the choice ringed."""
    speed, error = (rows["items_per_s"] / 1e6).to_numpy(), 100.0 * rows["error"].to_numpy()
    front = pareto_front(1.0 / speed, error)
    order = np.argsort(speed[front], kind="stable")
    color = style["color"]
    open_marks = {"marker": style["marker"], "markerfacecolor": "none", "markeredgecolor": color}
    axes.plot(speed[~front], error[~front], linestyle="", markersize=4, alpha=0.6, **open_marks)
    scene = scene_title(rows["scene"].iloc[0])
    axes.plot(
        speed[front][order],
        error[front][order],
        label=f"{scene}: Pareto front (open: dominated)",
        linewidth=1.2,
        markersize=5,
        **style,
    )
    full = rows["faces"].iloc[0]
    for place in np.flatnonzero(rows["chosen"] == 1).tolist():
        label = f"{scene}: used, {rows['faces'].iloc[place]:,.0f} of {full:,.0f} faces"
        axes.plot(speed[place], error[place], label=label, markeredgecolor=color, **RING)


def labels_figure(rows: pd.DataFrame) -> Figure:
    """Draw the error of methods that estimate labels against their time."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    for _, scene in rows.groupby("scene", sort=False):
        _draw_named(axes, scene, factor=100.0)
    _finish(axes, "Methods that estimate labels", linear_below=1.0)
    axes.set_xlabel("frames per second of processor time")
    axes.set_ylabel("median position error of the labels (cm)")
    add_legend(figure, axes, 3)
    return figure


def training_figure(rows: pd.DataFrame) -> Figure:
    """Draw the error of training runs against their time, a panel for every scene."""
    scenes = dict(list(rows.groupby("scene", sort=False)))
    figure = Figure(figsize=(1.0 + 3.4 * len(scenes), 3.6), layout="constrained")
    panels = figure.subplots(1, len(scenes), squeeze=False, sharey=True)[0]
    for axes, (scene, part) in zip(panels, scenes.items(), strict=True):
        _draw_named(axes, part)
        axes.set_xlim(0, 1.15 * part["items_per_s"].max())
        axes.grid(color="0.94")
        axes.set(title=scene_title(str(scene)), xlabel="images per second of processor time")
    # Set once for all: a limit set by the first panel would cut off marks of the next.
    panels[0].set_ylim(0, 1.1 * rows["error"].max())
    panels[0].set_ylabel("median position error (m)")
    add_legend(figure, max(panels, key=lambda axes: len(axes.lines)), 3)
    return figure


def _finish(axes: Axes, title: str, linear_below: float) -> None:
    """Finish the axes; errors below ``linear_below`` are on a linear scale, so that 0 shows."""
    axes.set_title(title)
    axes.set_yscale("symlog", linthresh=linear_below)
    axes.set_ylim(bottom=-0.2 * linear_below)  # marks at 0 are seen whole
    axes.yaxis.set_major_formatter("{x:g}")
    axes.grid(color="0.94")


def _draw_named(axes: Axes, rows: pd.DataFrame, factor: float = 1.0) -> None:
    """Draw a mark for each variant, in its style of all figures; filled on the Pareto front."""
    front = pareto_front(1.0 / rows["items_per_s"], rows["error"])
    for row, on_front in zip(rows_of(rows), front, strict=True):
        style: Style = NAMED[row.variant] | {"linestyle": "", "markersize": 8}
        face = style["color"] if on_front else "none"
        look = style | {"markerfacecolor": face, "markeredgecolor": style["color"]}
        axes.plot(row.items_per_s, factor * row.error, label=row.variant, **look)


COLORS = {"opengl": BLUE, "pyrender": VERMILION, "raycast": GREEN}
MARKERS = {1: "o", 2: "s", 3: "^", 4: "D"}
TEXTURES, FACES = "smaller textures", "fewer triangles"
DETAIL_COLORS = {TEXTURES: ORANGE, FACES: PURPLE}
USED = RING | {"markeredgecolor": BLACK}


def render_figure(rows: pd.DataFrame) -> Figure:
    """Draw ways to draw a frame: a row of panels per scene, a panel for every image size."""
    panels = [
        [panel for _, panel in of_scene.groupby(["width", "height"], sort=False)]
        for _, of_scene in rows.groupby("scene", sort=False)
    ]
    n_columns = max(map(len, panels))
    size = (max(4.8, 0.6 + 3.0 * n_columns), 1.3 + 2.7 * len(panels))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(panels), n_columns, squeeze=False, sharey=True)
    for line, of_scene in zip(grid, panels, strict=True):
        for axes in line[len(of_scene) :]:
            axes.set_visible(False)
        for axes, panel in zip(line, of_scene, strict=False):
            draw_panel(axes, panel)
        line[0].set_ylabel("mean error (levels of 0 to 255)")
    for axes in grid[-1]:
        axes.set_xlabel("ms per frame")
    figure.legend(handles=_legend(rows), loc="outside lower center", ncols=min(4, n_columns + 1))
    return figure


def draw_panel(axes: Axes, rows: pd.DataFrame) -> None:
    """Draw the full mesh joined by backend, less detail joined to it; what is used is ringed.

    ``rows`` are the variants of one scene and one size of the image; one of them is chosen.
    """
    chosen = rows[rows["chosen"] == 1].iloc[0]
    full_faces = rows["faces"].max()
    rows = rows.assign(ms=1e3 * rows["seconds_per_item"], left_out=left_out(rows, full_faces))
    ring = 1e3 * chosen["seconds_per_item"], chosen["error"]
    same = (rows["backend"] == chosen["backend"]) & (
        rows["supersampling"] == chosen["supersampling"]
    )
    full_used = rows[same & (rows["left_out"] == "")].iloc[0]
    for backend, full in rows[rows["left_out"] == ""].groupby("backend", sort=False):
        full = full.sort_values("supersampling", kind="stable")
        color = COLORS[str(backend)]
        axes.plot(full["ms"], full["error"], color=color, linewidth=0.9, zorder=2)
        for row in full.itertuples():
            _mark(axes, row, color)
    for kind, color in DETAIL_COLORS.items():
        less = rows[(rows["left_out"] == kind) & (rows["chosen"] == 0)]
        points = [
            (full_used["ms"], full_used["error"]),
            *zip(less["ms"], less["error"], strict=True),
        ]
        axes.plot(*zip(*points, strict=True), color=color, linewidth=0.9, linestyle=":", zorder=2)
        for row, side in zip(less.itertuples(), ("left", "right"), strict=False):
            _mark(axes, row, color, filled=False)
            _name(axes, row, full_faces, side)
    if _is_less(chosen, full_faces):
        style = _face(MARKERS[chosen["supersampling"]], COLORS[chosen["backend"]], filled=False)
        axes.plot(*ring, linestyle="", markersize=5, **style)
    axes.plot(*ring, **USED)
    set_log(axes, "x", "y")
    axes.margins(0.12)
    axes.grid(color="0.94")
    size = f"{chosen['width']:.0f} × {chosen['height']:.0f}"
    axes.set_title(f"{scene_title(chosen['scene'])}, {size}")


def _mark(axes: Axes, row: Any, color: str, filled: bool = True) -> None:
    style = _face(MARKERS[row.supersampling], color, filled)
    axes.plot(row.ms, row.error, linestyle="", markersize=5, **style)


def _name(axes: Axes, row: Any, full_faces: float, align: str) -> None:
    """Write beside a mark what is left; names of neighbours stand on opposite sides."""
    scale, offset = row.texture_scale, (4 if align == "left" else -4, 3)
    text = f"1/{1.0 / scale:.0f}" if scale != 1.0 else f"{row.faces / full_faces:.0%}"
    place = (row.ms, row.error)
    axes.annotate(text, place, offset, textcoords="offset points", fontsize=7, ha=align)


def _is_less(row: Any, full_faces: float) -> bool:
    """Tell whether a variant draws less than the full mesh."""
    return bool(row["faces"] != full_faces or row["texture_scale"] != 1.0)


def left_out(rows: pd.DataFrame, faces: float) -> pd.Series[str]:
    """Name the detail of the mesh that a variant leaves out; nothing for the full mesh."""
    found = (rows["faces"] != faces).map({True: FACES, False: ""})
    return found.mask(rows["texture_scale"] != 1.0, TEXTURES)


def _face(marker: str, color: str, filled: bool) -> Style:
    face = color if filled else "white"
    return {"marker": marker, "markeredgecolor": color, "markerfacecolor": face, "zorder": 3}


def _legend(rows: pd.DataFrame) -> list[Line2D]:
    handles = [Line2D([], [], color=COLORS[name], label=name) for name in rows["backend"].unique()]
    for kind, color in DETAIL_COLORS.items():
        handles.append(Line2D([], [], color=color, linestyle=":", label=f"with {kind}"))
    for samples in sorted(rows["supersampling"].unique()):
        label = f"{samples:.0f} × {samples:.0f} samples"
        style = _face(MARKERS[samples], "0.4", True)
        handles.append(Line2D([], [], linestyle="", label=label, **style))
    return [*handles, Line2D([], [], label="used", **USED)]
