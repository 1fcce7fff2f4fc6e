"""The page of a benchmark: one table, one picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.sweep import Picture, Sweep
from reproduction.figures.speed_vs_error import pareto_front
from reproduction.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RC, SKY, VERMILION
from synfeal.records.files import atomic_path

COLORS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
MARKERS = "os^DvP"
LEGEND_INCHES = 7.0  # fits four columns of settings


def write_page(out: Path, name: str, sweep: Sweep, rows: pd.DataFrame) -> None:
    """Write the page of a benchmark and, where the sweep asks for one, its picture.

    Args:
        out: Path whose suffix becomes ``.md`` for the page and ``.png`` for the picture.
        name: Name of the sweep's file.
        sweep: The sweep.
        rows: Its measured runs.
    """
    if sweep.picture is not None:
        draw(out.with_suffix(".png"), sweep, sweep.picture, rows)
    environment = Environment(
        loader=PackageLoader("benchmarks", "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    table = summary(sweep, rows).to_markdown(index=False, disable_numparse=True)
    picture = out.with_suffix(".png").name if sweep.picture else None
    text = environment.get_template("page.md.j2").render(
        sweep=sweep, name=name, table=table, picture=picture
    )
    with atomic_path(out.with_suffix(".md")) as temporary:
        temporary.write_text(text, encoding="utf-8")


def summary(sweep: Sweep, rows: pd.DataFrame) -> pd.DataFrame:
    """Tabulate combinations as text: means over the seeds, with the least and the largest."""
    lines = []
    for values, runs in rows.groupby(list(sweep.vary), sort=False):
        line: dict[str, Any] = dict(zip(sweep.vary, values, strict=True))
        line["seeds"] = str(len(runs))
        for column, shown in sweep.show.items():
            line[shown.title] = with_range(runs[column], shown.digits)
        lines.append(line)
    return pd.DataFrame(lines)


def with_range(values: pd.Series, digits: int) -> str:
    """Format the mean, with the least and the largest where there are several."""
    text = f"{values.mean():.{digits}f}"
    if len(values) == 1:
        return text
    return f"{text} ({values.min():.{digits}f} – {values.max():.{digits}f})"


def draw(path: Path, sweep: Sweep, picture: Picture, rows: pd.DataFrame) -> None:
    """Draw a mark for every run, and join the means of one group in the order of the table.

    Args:
        path: PNG to write.
        sweep: The sweep.
        picture: Which measures and axes to draw.
        rows: Measured runs of the sweep.
    """
    columns = list(rows.groupby(picture.across, sort=False)) if picture.across else [("", rows)]
    # Measures stand side by side, or below one another where an axis goes across.
    shape = (len(picture.y), len(columns)) if picture.across else (1, len(picture.y))
    size = (2.4 * shape[1], 2.5 * shape[0]) if picture.across else (4.3 * shape[1], 3.9)
    with mpl.rc_context(RC), atomic_path(path) as temporary:
        size = max(size[0], LEGEND_INCHES if picture.group else 0.0), size[1]
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(*shape, squeeze=False, sharey="row" if picture.across else False)
        panels = panels if picture.across else panels.T
        for column, (title, runs) in enumerate(columns):
            panels[0, column].set_title(str(title))
            for row, measure in enumerate(picture.y):
                _draw_panel(panels[row, column], sweep, picture, runs, measure)
        if picture.group is not None:
            handles = panels[0, 0].get_legend_handles_labels()
            figure.legend(*handles, title=picture.group, loc="outside lower center", ncols=4)
        figure.savefig(temporary, dpi=130)


def _draw_panel(
    panel: Axes, sweep: Sweep, picture: Picture, rows: pd.DataFrame, measure: str
) -> None:
    """Draw one measure against the column of costs."""
    axes = [name for name in sweep.vary if name not in (*picture.average, picture.across)]
    joined = [name for name in axes if name != picture.group]
    groups = [("", rows)] if picture.group is None else rows.groupby(picture.group, sort=False)
    for place, (label, runs) in enumerate(groups):
        style: dict[str, Any] = {
            "color": COLORS[place % len(COLORS)],
            "marker": MARKERS[place // len(COLORS)],
        }
        means = runs.groupby(joined or axes, sort=False).mean(numeric_only=True)
        marks: dict[str, Any] = style | {"linestyle": "", "markersize": 3.5, "alpha": 0.5}
        panel.plot(runs[picture.x], runs[measure], **marks)
        panel.plot(means[picture.x], means[measure], label=str(label), **style)
    panel.set(xlabel=sweep.show[picture.x].title, ylabel=sweep.show[measure].title)
    if picture.across:
        panel.label_outer()
    panel.grid(color="0.93", which="both")
    if picture.chosen:
        means = rows.groupby(axes, sort=False).mean(numeric_only=True).reset_index()
        mark_front(panel, means, picture.x, measure, picture.chosen)
    if picture.log:
        _logarithmic(panel)


def mark_front(panel: Axes, means: pd.DataFrame, x: str, y: str, chosen: Mapping[str, str]) -> None:
    """Join what nothing beats in both columns, cover what is beaten with grey, ring the choice.

    Args:
        panel: Axes to draw on.
        means: A row per combination, with both columns and the axes of the sweep.
        x: Column along the horizontal axis; less is better.
        y: Column along the vertical axis; less is better.
        chosen: Values in use by axis of the sweep, as text.
    """
    front = pareto_front(means[x], means[y])
    best = means[front].sort_values(x)
    panel.plot(best[x], best[y], color="0.3", linestyle=":", linewidth=1.0, zorder=1)
    beaten: dict[str, Any] = {
        "linestyle": "",
        "marker": "o",
        "markersize": 7,
        "color": "0.75",
        "zorder": 4,
    }
    panel.plot(means[x][~front], means[y][~front], **beaten)
    used = means[[all(str(row[k]) == v for k, v in chosen.items()) for _, row in means.iterrows()]]
    ring: dict[str, Any] = {
        "linestyle": "",
        "marker": "o",
        "markersize": 14,
        "markerfacecolor": "none",
    }
    panel.plot(used[x], used[y], markeredgecolor=BLACK, zorder=5, **ring)


def _logarithmic(panel: Axes) -> None:
    panel.set(xscale="log", yscale="log")
    low, high = panel.get_ylim()
    within_a_decade = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8)
    axes = (
        (panel.xaxis, (1, 2, 3, 5)),
        (panel.yaxis, within_a_decade if high < 10 * low else (1, 2, 5)),
    )
    for axis, marked in axes:
        axis.set_major_locator(LogLocator(subs=marked))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
