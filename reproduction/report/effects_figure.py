"""The paper's effects beside ours with their limits, in one figure."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reproduction.claims.evidence import QUANTITIES
from reproduction.figures.style import BLUE, VERMILION, Style
from reproduction.report.reproduced import Effect
from reproduction.report.stamped import digest, stamped_png

TICKS_PERCENT = (-75, -50, 0, 100, 300)
SPACING = 0.3  # between position and orientation, rows


def effects_digest(effects: Sequence[Effect]) -> str:
    """Hash the effects that the figure shows."""
    lines = []
    for effect in effects:
        numbers = [*effect.ours[0], *effect.ours[1], *(effect.paper or ())]
        lines.append(f"{effect.name}|{effect.run}|{'|'.join(f'{n:.6g}' for n in numbers)}")
    return digest(lines)


def effects_picture(effects: Sequence[Effect]) -> bytes:
    """Draw the figure as PNG."""
    return stamped_png(lambda: effects_figure(effects), effects_digest(effects))


def effects_figure(effects: Sequence[Effect]) -> Figure:
    """Draw a row per effect: the paper's as diamonds, ours as dots with 95 % limits."""
    figure = Figure(figsize=(9.0, 0.55 * len(effects) + 1.3), layout="constrained")
    axes = figure.subplots()
    for row, effect in enumerate(effects):
        _draw(axes, row, effect)
    axes.axvline(1, color="0.3", lw=0.8, zorder=0)
    axes.set_xscale("log")
    axes.set_xticks(
        [1 + percent / 100 for percent in TICKS_PERCENT],
        [f"{percent:+d} %".replace("-", "−") if percent else "0" for percent in TICKS_PERCENT],
    )
    axes.minorticks_off()
    axes.grid(axis="x", color="0.92")
    axes.set_yticks(range(len(effects)), [effect.name for effect in effects])
    axes.set_ylim(len(effects) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("change of the median error (0: none)")
    handles, titles = axes.get_legend_handles_labels()
    shown = dict(zip(titles, handles, strict=True))
    figure.legend(shown.values(), shown, loc="outside upper center", ncols=4, handlelength=1.5)
    return figure


def _draw(axes: Axes, row: int, effect: Effect) -> None:
    """Draw the paper's change and ours, position above orientation."""
    colors, marks = (BLUE, VERMILION), ("o", "s")
    for place, quantity in enumerate(QUANTITIES):
        y, color = row + SPACING * (place - 0.5), colors[place]
        value, low, high = effect.ours[place]
        axes.plot([low, high], [y, y], color=color, lw=2.5, solid_capstyle="butt", zorder=2)
        ours: Style = {"color": color, "ms": 6, "mec": "white", "mew": 0.7, "zorder": 2}
        axes.plot(value, y, marks[place], label=f"{quantity}, ours", **ours)
        if effect.paper is not None:
            paper: Style = {"mfc": "white", "mec": color, "mew": 1.4, "ms": 6.5, "zorder": 3}
            axes.plot(effect.paper[place], y, "D", label=f"{quantity}, paper", **paper)
