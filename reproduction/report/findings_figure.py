"""The three main findings in one figure, which the read-me shows and every report opens with."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reproduction.design.shapes import SHAPES
from reproduction.figures.style import BLUE, GREEN, VERMILION
from reproduction.report.findings import (
    ADJUSTED,
    POSITION,
    WITHOUT_DEPTH,
    best,
    localizers,
    most_noise,
    moved_by,
    off_in_all_shapes,
    reference,
    shape_changes,
    shared_errors_stay,
)
from reproduction.report.intervals import Interval, cell_interval
from reproduction.report.stamped import digest, shows, stamped_png, write_stamped
from reproduction.tables.layouts import TITLES
from reproduction.tables.references import two_digits

TRUTH = "against the truth"
BOTH = "against truth = labels"
TITLE_CHARACTERS = 84  # in a line


class Row(NamedTuple):
    """A line of the figure."""

    name: str
    interval: Interval
    against: str  # what errors are measured against
    color: str


class Panel(NamedTuple):
    """Lines on one axis, under the sentence they bear out."""

    title: str
    rows: Sequence[Row]
    axis: str
    is_log: bool


def panels(root: Path) -> list[Panel]:
    """List what published results, or a finished run, have for the figure.

    A panel that lacks a row, a value or a limit is left out.
    """
    noise, off = most_noise(root), _said(moved_by(root))
    clean, noisy = best(localizers(root)), best(localizers(root, noise))
    found = {
        "feature map, exact labels": (reference(root, WITHOUT_DEPTH), BOTH, BLUE),
        f"adjusted feature map, labels {off} off": (
            reference(root, ADJUSTED, noise),
            TRUTH,
            GREEN,
        ),
        f"best network ({TITLES[clean.model]}), exact labels": (clean, BOTH, VERMILION),
        f"best network ({TITLES[noisy.model]}), labels {off} off": (noisy, TRUTH, VERMILION),
    }
    errors = [
        Row(name, _times(cell_interval(row, POSITION), 100), against, color)
        for name, (row, against, color) in found.items()
        if row is not None
    ]
    changes = [
        Row(SHAPES[shape], _change(orientation), TRUTH, VERMILION)
        for shape, (_, orientation) in shape_changes(root).items()
    ]
    drawn = []
    if len(errors) == len(found) and _are_finite(errors):
        drawn.append(
            Panel(
                "1  Matching image features beats regression on the same frames,\n"
                "2  even where the map was made from badly wrong poses",
                errors,
                f"median position error, cm, Large Room, {clean.n_train:,} frames"
                " (lower is better; each line is 3 times the one before)",
                True,
            )
        )
    if len(changes) == len(SHAPES) and _are_finite(changes):
        drawn.append(
            Panel(
                _title_of_shapes(root, _said(off_in_all_shapes(root))),
                changes,
                "change of the networks' orientation error, %, mean over five"
                " (0: labels do no harm)",
                False,
            )
        )
    return drawn


def _title_of_shapes(root: Path, off: str) -> str:
    """Say what the third finding says, over two lines; without a finding, what is shown."""
    finding = shared_errors_stay(root)
    said = finding.headline.removesuffix(".") if finding else "Label errors by their shape"
    return textwrap.fill(
        f"3  {said} (labels {off} off)", TITLE_CHARACTERS, subsequent_indent="    "
    )


def _said(off: tuple[float, float]) -> str:
    """Say how far off labels are, given in metres and degrees."""
    return f"{100 * off[0]:.0f} cm, {off[1]:.0f}°"


def _are_finite(rows: Sequence[Row]) -> bool:
    """Check that every row has a value and limits, which a handful of test paths do not give."""
    return all(math.isfinite(number) for row in rows for number in row.interval)


def write_findings_figure(drawn: Sequence[Panel], out_png: Path) -> None:
    """Draw panels into a file that says what it was drawn from."""
    write_stamped(picture(drawn), out_png)


def picture(drawn: Sequence[Panel]) -> bytes:
    """Draw the figure as PNG."""
    return stamped_png(lambda: findings_figure(drawn), panels_digest(drawn))


def is_drawn_from(png: Path, drawn: Sequence[Panel]) -> bool:
    """Tell whether an existing picture shows these panels."""
    return shows(png, panels_digest(drawn))


def panels_digest(drawn: Sequence[Panel]) -> str:
    """Hash what is drawn."""
    return digest(
        [
            f"{panel.title}|{panel.axis}|{row.name}|{row.against}|"
            + "|".join(f"{number:.6g}" for number in row.interval)
            for panel in drawn
            for row in panel.rows
        ]
    )


def findings_figure(drawn: Sequence[Panel]) -> Figure:
    """Draw one axis per panel, a line per row: a dot, and a bar for its 95 % limits."""
    heights = [len(panel.rows) + 1.6 for panel in drawn]
    figure = Figure(figsize=(9.0, 0.42 * sum(heights) + 0.5), layout="constrained")
    all_axes = figure.subplots(len(drawn), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, panel in zip(all_axes, drawn, strict=True):
        _draw(axes, panel)
    note = "Dots: medians and their changes. Bars: 95 % limits over test paths and training runs."
    figure.supxlabel(note, fontsize=8.5, color="0.35")
    return figure


def _draw(axes: Axes, panel: Panel) -> None:
    for place, row in enumerate(panel.rows):
        value, low, high = row.interval
        axes.plot([low, high], [place, place], color=row.color, lw=3, solid_capstyle="butt")
        axes.plot(value, place, "o", color=row.color, ms=7, mec="white", mew=0.8)
        transform = axes.get_yaxis_transform()
        number = _number(row.interval, panel.is_log)
        axes.text(1.13, place, number, va="center", ha="right", transform=transform)
        axes.text(1.16, place, row.against, va="center", fontsize=8, transform=transform)
    axes.set_yticks(range(len(panel.rows)), [row.name for row in panel.rows])
    axes.set_ylim(len(panel.rows) - 0.4, -0.6)
    axes.set_title(panel.title, loc="left", fontweight="bold", x=-0.58)
    axes.set_xlabel(panel.axis)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", color="0.92")
    if panel.is_log:
        axes.set_xscale("log")
        highest = max(row.interval.high for row in panel.rows)
        ticks = [tick for tick in (0.1, 0.3, 1, 3, 10, 30, 100, 300) if tick < 2 * highest]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        lowest = min(row.interval.low for row in panel.rows)
        axes.set_xlim(0.8 * lowest, 1.3 * highest)
    else:
        axes.axvline(0, color="0.3", lw=0.8)


def _number(interval: Interval, is_error: bool) -> str:
    if is_error:
        return f"{two_digits(interval.value)} cm"
    return f"{interval.value:+.0f} %".replace("-", "−")


def _times(interval: Interval, factor: float) -> Interval:
    return Interval(*(factor * end for end in interval))


def _change(interval: Interval) -> Interval:
    """Convert a factor to a change in percent."""
    return Interval(*(100 * (end - 1) for end in interval))
