"""A dot plot of a comparison: every run's difference with its limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from reproduction.compare.stats import Verdict
from reproduction.compare.trees import KEY, Comparison, one_yardstick

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
    """Draw runs down, sorted by the change of the position error against the true poses.

    Filled markers are errors against the labels (the paper's protocol), open ones against the true
    poses where these differ. An infinite difference sits at the edge with the word *failed*.
    """
    rows = _placed(comparison.table)
    names = rows.drop_duplicates("place").sort_values("place")["name"]
    figure = Figure(figsize=(11.0, 1.9 + 0.2 * len(names)), layout="constrained")
    axes = figure.subplots(1, len(PANELS), sharey=True)
    for axis, (measure, title) in zip(axes, PANELS.items(), strict=True):
        _panel(axis, rows[rows["measure"].isin([measure, f"{measure}_true"])], title)
    axes[0].set_yticks(range(len(names)), names, fontsize=7)
    axes[0].set_ylim(len(names) - 0.5, -0.5)
    handles = _handles(bool(rows["measure"].str.endswith("_true").any()))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    figure.suptitle(
        f"A = {comparison.names[0]}\nB = {comparison.names[1]}", fontsize=8, x=0.01, ha="left"
    )
    return figure


def _placed(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows that add something, with the name, place and height of each run."""
    runs = [run for _, run in table.groupby(list(KEY), sort=False)]
    runs.sort(key=lambda r: float(r.difference[r.measure == "position_m_true"].iloc[0]))
    parts = []
    for place, run in enumerate(runs):
        truth = run["measure"].str.endswith("_true")
        height = np.where(truth, YARDSTICK_APART, -YARDSTICK_APART)
        if one_yardstick(run):
            run, height = run[~truth], np.zeros(2)
        name = "/".join(run[list(KEY)].iloc[0])
        parts.append(run.assign(name=name, place=place, height=place + height))
    return pd.concat(parts)


def _panel(axis: Axes, rows: pd.DataFrame, title: str) -> None:
    # Symmetric about zero, and wide enough for what is finite.
    ends = rows[["low", "difference", "high"]].abs().to_numpy(dtype=float)
    edge = MARGIN * float(ends[np.isfinite(ends)].max(initial=0.0)) or 1.0
    axis.axvline(0, color="0.6", linewidth=0.8, zorder=1)
    for row in rows.itertuples():
        _dot(axis, row, edge)
    axis.set_xlim(-edge * MARGIN, edge * MARGIN)
    axis.set_xlabel(f"{title}\n← better          worse →", fontsize=9)
    axis.grid(axis="y", color="0.93", linewidth=0.6)
    axis.tick_params(axis="y", length=0)
    axis.spines[["top", "right", "left"]].set_visible(False)


def _dot(axis: Axes, row: Any, edge: float) -> None:
    color, marker = STYLES[row.verdict]
    low, value, high = np.clip([row.low, row.difference, row.high], -edge, edge)
    axis.plot([low, high], [row.height] * 2, color=color, linewidth=1.1, zorder=2)
    face = "white" if row.measure.endswith("_true") else color
    axis.plot(value, row.height, marker, color=color, markerfacecolor=face, markersize=5, zorder=3)
    if np.isinf(row.difference):
        text, side = ("failed in B ", "right") if value > 0 else (" failed in A", "left")
        axis.text(0.93 * value, row.height, text, color=color, fontsize=7, ha=side, va="center")


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
