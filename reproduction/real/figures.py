"""Figures of the profile ``real``: how much data, and how much of a photograph the scan covers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reproduction.figures.registry import save
from reproduction.figures.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RC,
    VERMILION,
    Style,
    add_legend,
    set_log,
)
from reproduction.tables.real import AMOUNT, COVER, ROWS
from synfeal.records.tables import read_frame

STYLES: dict[str, Style] = {
    "photographs": {"color": BLUE, "marker": "s", "linestyle": "--"},
    "rendered": {"color": GREEN, "marker": "^", "linestyle": ":"},
    "randomised": {"color": VERMILION, "marker": "o", "linestyle": "-"},
    "both": {"color": PURPLE, "marker": "D", "linestyle": "-."},
}
DIRECTION_FILLS = {"official": BLUE, "forward": VERMILION, "reverse": ORANGE, "alternate": GREEN}
KINDS = {"frames": "rendered frames", "photographs": "photographs fused, or learned from"}
POSITION, ORIENTATION = "position_m", "orientation_deg"
FEWEST = 10  # photographs in a bin that is drawn
UNITS = {POSITION: "position error, m", ORIENTATION: "orientation error, °"}


def write_real_figures(
    amount: Path, cover: Path, out_amount: Sequence[Path], out_shares: Sequence[Path]
) -> None:
    """Draw both figures.

    Args:
        amount: Errors by the number of frames and of photographs.
        cover: Errors by the share of a photograph that the scan covers.
        out_amount: Files of the first figure, one for each format.
        out_shares: Files of the second.
    """
    with matplotlib.rc_context(RC):
        for figure, files in (
            (draw_amount(read_frame(amount, AMOUNT)), out_amount),
            (draw_cover(read_frame(cover, COVER)), out_shares),
        ):
            for file in files:
                save(figure, file)


def draw_amount(points: pd.DataFrame) -> Figure:
    """Draw errors of PoseNet2 against the number of rendered frames, and of photographs."""
    figure = Figure(figsize=(8.0, 5.4), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    for column, (kind, title) in enumerate(KINDS.items()):
        for row, measure in enumerate(UNITS):
            panel = axes[row][column]
            for trained_on, group in points[points.kind == kind].groupby("trained_on", sort=False):
                _line(panel, group.sort_values("amount"), measure, str(trained_on))
            set_log(panel, "y")
            panel.set_xscale("log")
            amounts = sorted(set(points[points.kind == kind].amount))
            panel.set_xticks(amounts, [f"{amount:,}" for amount in amounts], minor=False)
            panel.minorticks_off()
            panel.set_ylabel(UNITS[measure] if column == 0 else "")
            panel.set_xlabel(title if row else "")
            panel.grid(visible=True, which="both", color="0.92", linewidth=0.6)
    figure.suptitle("PoseNet2 on photographs that were not scanned (hollow: one run)")
    handles, titles = axes[0][0].get_legend_handles_labels()
    add_legend(figure, axes[0][1], 2, dict(zip(titles, handles, strict=True)))
    return figure


def _line(panel: Axes, group: pd.DataFrame, measure: str, trained_on: str) -> None:
    style = STYLES[trained_on]
    x, y = group.amount, group[measure]
    low, high = y - group[f"{measure}_low"], group[f"{measure}_high"] - y
    panel.errorbar(
        x,
        y,
        yerr=[low.clip(lower=0), high.clip(lower=0)],
        label=f"learned from {ROWS[trained_on]}",
        capsize=2,
        elinewidth=0.8,
        markersize=5,
        **style,
    )
    single = group[group.n_seeds == 1]
    panel.plot(
        single.amount,
        single[measure],
        color=style["color"],
        marker=style["marker"],
        markerfacecolor="white",
        markersize=5,
        linestyle="none",
        zorder=3,
    )


def draw_cover(bins: pd.DataFrame) -> Figure:
    """Draw errors of PoseNet2 against the share of a photograph that the scan covers."""
    bins = bins[bins.n_test >= FEWEST]
    figure = Figure(figsize=(8.8, 3.4), layout="constrained")
    axes = figure.subplots(1, 2)
    for panel, measure in zip(axes, UNITS, strict=True):
        for (direction, trained_on), group in bins.groupby(["direction", "trained_on"], sort=False):
            style = STYLES[str(trained_on)] | {"color": DIRECTION_FILLS[str(direction)]}
            ordered = group.sort_values("share")
            panel.plot(
                100 * ordered.share,
                ordered[measure],
                label=f"{direction}: {ROWS[str(trained_on)]}",
                markersize=4,
                **style,
            )
        set_log(panel, "y")
        panel.set_xlabel("share of the photograph that the scan covers, %")
        panel.set_ylabel(f"median {UNITS[measure]}")
        panel.grid(visible=True, which="both", color="0.92", linewidth=0.6)
    add_legend(figure, axes[0], 3)
    figure.set_figheight(3.4 + 0.22 * len(bins.groupby(["direction", "trained_on"])) / 3)
    return figure
