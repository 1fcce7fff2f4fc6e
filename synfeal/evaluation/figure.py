"""The figure of ``synfeal evaluate``: which share of the frames is localized how well."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from synfeal.evaluation.metrics import ORIENTATION, POSITION, cumulative, joint_error
from synfeal.evaluation.run import Evaluation
from synfeal.evaluation.text import TITLES

COLOURS, DASHES = ("#0072B2", "#D55E00"), ("-", "--")
LEAST = 1e-6  # where an error of nothing is drawn on a logarithmic axis


def figure_of(title: str, found: Evaluation) -> Figure:
    """Three panels: position, orientation, and both at once (x cm and x°)."""
    figure = Figure(figsize=(11, 3.8), layout="constrained")
    figure.suptitle(title, fontsize=10)
    panels = figure.subplots(1, 3, sharey=True)
    labels = ("position error (m)", "orientation error (°)", "both errors: below x cm and x°")
    for end, colour, dash in zip(found.ends, COLOURS, DASHES, strict=False):
        shown = found.errors[POSITION + end], found.errors[ORIENTATION + end]
        for axes, values in zip(panels, (*shown, joint_error(found.errors, end)), strict=True):
            error, percent = cumulative(np.maximum(values, LEAST))
            axes.step(error, percent, dash, where="post", color=colour, label=TITLES[end])
    for axes, label in zip(panels, labels, strict=True):
        axes.set(xscale="log", ylim=(0, 101), xlabel=label)
        axes.axhline(50, color="0.85", linewidth=0.8, zorder=0)
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(axis="x", color="0.93")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("frames with at most this error (%)")
    if len(found.ends) > 1:
        panels[0].legend(frameon=False, fontsize=8)
    return figure
