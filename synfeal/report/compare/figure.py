"""A dot plot of a comparison: every run's difference with its limits."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from synfeal.report.compare.stats import Difference, Verdict
from synfeal.report.compare.trees import Comparison, RunComparison

# Okabe and Ito's colour-blind-safe colours; markers say the same in grey.
STYLES: dict[Verdict, tuple[str, str]] = {
    "better": ("#0072B2", "<"),
    "no difference seen": ("0.45", "o"),
    "worse": ("#D55E00", ">"),
}
PANELS = {
    "position_m": "position error, B − A (m)",
    "orientation_deg": "orientation error, B − A (°)",
}
YARDSTICK_APART = 0.16
MARGIN = 1.08


def comparison_figure(comparison: Comparison) -> Figure:
    """Runs down, sorted by the change of the position error against the true poses.

    Filled markers are errors against the labels (the paper's protocol), open ones against the true
    poses where these differ. An infinite difference sits at the edge with the word *failed*.
    """
    runs = sorted(comparison.runs, key=lambda run: run.differences["position_m_true"].value)
    figure = Figure(figsize=(11.0, 1.9 + 0.2 * len(runs)), layout="constrained")
    axes = figure.subplots(1, len(PANELS), sharey=True)
    for axis, (measure, title) in zip(axes, PANELS.items(), strict=True):
        _panel(axis, runs, measure, title)
    axes[0].set_yticks(range(len(runs)), [run.key.name for run in runs], fontsize=7)
    axes[0].set_ylim(len(runs) - 0.5, -0.5)
    handles = _handles(any(not run.one_yardstick for run in runs))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    figure.suptitle(
        f"A = {comparison.names[0]}\nB = {comparison.names[1]}", fontsize=8, x=0.01, ha="left"
    )
    return figure


def edge_of(differences: Sequence[Difference]) -> float:
    """Half the width of an axis that is symmetric about zero and holds what is finite."""
    values = [abs(v) for d in differences for v in (d.low, d.value, d.high)]
    return MARGIN * max((v for v in values if math.isfinite(v)), default=0.0) or 1.0


def _panel(axis: Axes, runs: Sequence[RunComparison], measure: str, title: str) -> None:
    shown = [(place, *yardstick) for place, run in enumerate(runs) for yardstick in _both(run)]
    edge = edge_of([run.differences[measure + end] for run in runs for _, end in _both(run)])
    axis.axvline(0, color="0.6", linewidth=0.8, zorder=1)
    for place, shift, end in shown:
        _dot(axis, runs[place].differences[measure + end], place + shift, edge, bool(end))
    axis.set_xlim(-edge * MARGIN, edge * MARGIN)
    axis.set_xlabel(f"{title}\n← better          worse →", fontsize=9)
    axis.grid(axis="y", color="0.93", linewidth=0.6)
    axis.tick_params(axis="y", length=0)
    axis.spines[["top", "right", "left"]].set_visible(False)


def _both(run: RunComparison) -> list[tuple[float, str]]:
    """Shift and measure ending of each yardstick that says something of its own."""
    if run.one_yardstick:
        return [(0.0, "")]
    return [(-YARDSTICK_APART, ""), (YARDSTICK_APART, "_true")]


def _dot(axis: Axes, difference: Difference, place: float, edge: float, is_open: bool) -> None:
    color, marker = STYLES[difference.verdict]
    low, value, high = (
        min(max(v, -edge), edge) for v in (difference.low, difference.value, difference.high)
    )
    axis.plot([low, high], [place, place], color=color, linewidth=1.1, zorder=2)
    face = "white" if is_open else color
    axis.plot(value, place, marker, color=color, markerfacecolor=face, markersize=5, zorder=3)
    if math.isinf(difference.value):
        text, side = ("failed in B ", "right") if value > 0 else (" failed in A", "left")
        axis.text(0.93 * value, place, text, color=color, fontsize=7, ha=side, va="center")


def _handles(two_yardsticks: bool) -> list[Line2D]:
    handles = [
        Line2D([], [], color=color, marker=marker, markersize=5, linewidth=1.1, label=verdict)
        for verdict, (color, marker) in STYLES.items()
    ]
    if two_yardsticks:
        handles += [
            Line2D([], [], color="0.3", marker="o", markersize=5, linewidth=0, mfc=face, label=text)
            for face, text in (
                ("0.3", "against labels (the paper's protocol)"),
                ("white", "against true poses"),
            )
        ]
    return handles
