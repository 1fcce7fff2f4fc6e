"""What a frame costs against how wrong it is: a panel for every scene and size of the image."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from synfeal.report.figures.sources import Results, Row
from synfeal.report.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILION, Style
from synfeal.report.layouts import scene_title

COLOURS = {"opengl": BLUE, "pyrender": VERMILION, "raycast": GREEN}
MARKERS = {"1": "o", "2": "s", "3": "^", "4": "D"}
TEXTURES, FACES = "smaller textures", "fewer triangles"
DETAIL_COLOURS = {TEXTURES: ORANGE, FACES: PURPLE}
TICKS = (1.0, 2.0, 5.0)


def draw(results: Results) -> Figure | None:
    """One row of panels per scene; nothing when the table has no rows of rendering."""
    rows = [row for row in results.table("speed_vs_error") if row["stage"] == "render"]
    return figure_of(rows) if rows else None


def figure_of(rows: Sequence[Row]) -> Figure:
    """The figure of the rows of ``speed_vs_error.csv`` whose stage is ``render``."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    panels = [
        [list(group) for _, group in groupby(of_scene, lambda row: (row["width"], row["height"]))]
        for of_scene in ([row for row in rows if row["scene"] == scene] for scene in scenes)
    ]
    n_columns = max(map(len, panels))
    size = (max(4.8, 0.6 + 3.0 * n_columns), 1.3 + 2.7 * len(scenes))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(len(scenes), n_columns, squeeze=False, sharey=True)
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


def draw_panel(axes: Axes, rows: Sequence[Row]) -> None:
    """The full mesh joined by backend, less detail joined to the choice, which is ringed.

    Args:
        axes: where to draw.
        rows: the variants of one scene and one size of the image; one of them is chosen.
    """
    chosen = next(row for row in rows if row["chosen"] == "1")
    for backend in dict.fromkeys(row["backend"] for row in rows):
        full = [r for r in rows if r["backend"] == backend and not left_out(r, chosen)]
        full.sort(key=lambda row: int(row["supersampling"]))
        axes.plot(*_points(full), color=COLOURS[backend], linewidth=0.9, zorder=2)
        for row in full:
            _mark(axes, row, COLOURS[backend])
    for kind, colour in DETAIL_COLOURS.items():
        less = [row for row in rows if left_out(row, chosen) == kind]
        points = _points([chosen, *less])
        axes.plot(*points, color=colour, linewidth=0.9, linestyle=":", zorder=2)
        for row, side in zip(less, ("left", "right"), strict=False):
            _mark(axes, row, colour, filled=False)
            _name(axes, row, _share(row, chosen), side)
    axes.plot(*_points([chosen]), **_ring())
    _scales(axes)
    axes.set_title(f"{scene_title(chosen['scene'])}, {chosen['width']} × {chosen['height']}")


def left_out(row: Row, chosen: Row) -> str:
    """What detail of the mesh a variant leaves out; nothing for the full mesh."""
    if float(row["texture_scale"]) != 1.0:
        return TEXTURES
    return FACES if row["faces"] != chosen["faces"] else ""


def _share(row: Row, chosen: Row) -> str:
    scale = float(row["texture_scale"])
    if scale != 1.0:
        return f"1/{1.0 / scale:.0f}"
    return f"{int(row['faces']) / int(chosen['faces']):.0%}"


def _name(axes: Axes, row: Row, text: str, align: str) -> None:
    """Write beside a mark; names of neighbours stand on opposite sides."""
    offset = (4 if align == "left" else -4, 3)
    axes.annotate(text, _point(row), offset, textcoords="offset points", fontsize=7, ha=align)


def _point(row: Row) -> tuple[float, float]:
    return 1e3 * float(row["seconds_per_item"]), float(row["error"])


def _points(rows: Sequence[Row]) -> tuple[list[float], list[float]]:
    points = [_point(row) for row in rows]
    return [ms for ms, _ in points], [error for _, error in points]


def _mark(axes: Axes, row: Row, colour: str, filled: bool = True) -> None:
    marker = MARKERS[row["supersampling"]]
    axes.plot(*_points([row]), linestyle="", markersize=5, **_face(marker, colour, filled))


def _face(marker: str, colour: str, filled: bool) -> Style:
    face = colour if filled else "white"
    return {"marker": marker, "markeredgecolor": colour, "markerfacecolor": face, "zorder": 3}


def _ring() -> Style:
    return {
        **{"marker": "o", "markersize": 13, "linestyle": ""},
        **{"markerfacecolor": "none", "markeredgecolor": BLACK},
    }


def _scales(axes: Axes) -> None:
    """Logarithmic, with ticks at 1, 2 and 5 that are read as plain numbers."""
    for axis, set_scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        set_scale("log")
        axis.set_major_locator(LogLocator(subs=TICKS))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    axes.margins(0.12)
    axes.grid(color="0.94")
    axes.set_axisbelow(True)


def _legend(rows: Sequence[Row]) -> list[Line2D]:
    backends = dict.fromkeys(row["backend"] for row in rows)
    handles = [Line2D([], [], color=COLOURS[name], label=name) for name in backends]
    for kind, colour in DETAIL_COLOURS.items():
        handles.append(Line2D([], [], color=colour, linestyle=":", label=f"used, with {kind}"))
    for samples in sorted({row["supersampling"] for row in rows}):
        label = f"{samples} × {samples} samples"
        style = _face(MARKERS[samples], "0.4", True)
        handles.append(Line2D([], [], linestyle="", label=label, **style))
    handles.append(Line2D([], [], label="used", **_ring()))
    return handles
