"""What a frame costs against how wrong it is: a panel for every scene and size of the image."""

from __future__ import annotations

from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from synfeal.report.figures import speed_vs_error
from synfeal.report.figures.sources import Results
from synfeal.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    VERMILION,
    Style,
    set_log,
)
from synfeal.report.layouts import scene_title

COLOURS = {"opengl": BLUE, "pyrender": VERMILION, "raycast": GREEN}
MARKERS = {1: "o", 2: "s", 3: "^", 4: "D"}
TEXTURES, FACES = "smaller textures", "fewer triangles"
DETAIL_COLOURS = {TEXTURES: ORANGE, FACES: PURPLE}
RING = speed_vs_error.RING | {"markeredgecolor": BLACK}


def draw(results: Results) -> Figure | None:
    """One row of panels per scene; nothing when the table has no rows of rendering."""
    rows = results.speeds("render")
    return figure_of(rows) if len(rows) else None


def figure_of(rows: pd.DataFrame) -> Figure:
    """The figure of the rows of ``speed_vs_error.csv`` whose stage is ``render``."""
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
    """The full mesh joined by backend, less detail joined to the choice, which is ringed.

    ``rows`` are the variants of one scene and one size of the image; one of them is chosen.
    """
    chosen = rows[rows["chosen"] == 1].iloc[0]
    rows = rows.assign(ms=1e3 * rows["seconds_per_item"], left_out=left_out(rows, chosen["faces"]))
    ring = 1e3 * chosen["seconds_per_item"], chosen["error"]
    for backend, full in rows[rows["left_out"] == ""].groupby("backend", sort=False):
        full = full.sort_values("supersampling", kind="stable")
        colour = COLOURS[str(backend)]
        axes.plot(full["ms"], full["error"], color=colour, linewidth=0.9, zorder=2)
        for row in full.itertuples():
            _mark(axes, row, colour)
    for kind, colour in DETAIL_COLOURS.items():
        less = rows[rows["left_out"] == kind]
        points = [ring, *zip(less["ms"], less["error"], strict=True)]
        axes.plot(*zip(*points, strict=True), color=colour, linewidth=0.9, linestyle=":", zorder=2)
        for row, side in zip(less.itertuples(), ("left", "right"), strict=False):
            _mark(axes, row, colour, filled=False)
            _name(axes, row, chosen["faces"], side)
    axes.plot(*ring, **RING)
    set_log(axes, "x", "y")
    axes.margins(0.12)
    axes.grid(color="0.94")
    size = f"{chosen['width']:.0f} × {chosen['height']:.0f}"
    axes.set_title(f"{scene_title(chosen['scene'])}, {size}")


def _mark(axes: Axes, row: Any, colour: str, filled: bool = True) -> None:
    style = _face(MARKERS[row.supersampling], colour, filled)
    axes.plot(row.ms, row.error, linestyle="", markersize=5, **style)


def _name(axes: Axes, row: Any, full_faces: float, align: str) -> None:
    """Write beside a mark what is left; names of neighbours stand on opposite sides."""
    scale, offset = row.texture_scale, (4 if align == "left" else -4, 3)
    text = f"1/{1.0 / scale:.0f}" if scale != 1.0 else f"{row.faces / full_faces:.0%}"
    place = (row.ms, row.error)
    axes.annotate(text, place, offset, textcoords="offset points", fontsize=7, ha=align)


def left_out(rows: pd.DataFrame, faces: float) -> pd.Series[str]:
    """What detail of the mesh a variant leaves out; nothing for the full mesh."""
    found = (rows["faces"] != faces).map({True: FACES, False: ""})
    return found.mask(rows["texture_scale"] != 1.0, TEXTURES)


def _face(marker: str, colour: str, filled: bool) -> Style:
    face = colour if filled else "white"
    return {"marker": marker, "markeredgecolor": colour, "markerfacecolor": face, "zorder": 3}


def _legend(rows: pd.DataFrame) -> list[Line2D]:
    handles = [Line2D([], [], color=COLOURS[name], label=name) for name in rows["backend"].unique()]
    for kind, colour in DETAIL_COLOURS.items():
        handles.append(Line2D([], [], color=colour, linestyle=":", label=f"used, with {kind}"))
    for samples in sorted(rows["supersampling"].unique()):
        label = f"{samples:.0f} × {samples:.0f} samples"
        style = _face(MARKERS[samples], "0.4", True)
        handles.append(Line2D([], [], linestyle="", label=label, **style))
    return [*handles, Line2D([], [], label="used", **RING)]
