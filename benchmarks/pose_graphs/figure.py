"""The picture of the two tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synfeal.files import atomic_path
from synfeal.report.tables import Value

Row = dict[str, Value]
COLOUR_OF = {"sphere": "#0072B2", "Manhattan": "#D55E00"}
MARK_OF = {"gtsam LM": "*", "Open3D LM": "P"}


def draw_curves(comparison: Sequence[Row], growth: Sequence[Row], out: Path) -> None:
    """Left: chi2 over that of least squares against seconds. Right: seconds of a pass."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for name, colour in COLOUR_OF.items():
        _speed(left, [row for row in comparison if row["graph"] == name], colour)
        _growth(right, name, [row for row in growth if row["graph"] == name], colour)
    left.set(xscale="log", yscale="log", xlabel="seconds", ylabel="χ² / χ² of least squares")
    left.set_title("TORO approaches least squares slowly", loc="left", fontsize=10)
    right.set(xlabel="edges", ylabel="seconds of a pass", xlim=(0, None), ylim=(0, None))
    right.set_title("The time of a pass grows with the edges", loc="left", fontsize=10)
    right.legend(frameon=False, fontsize=8)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    with atomic_path(out) as temporary:
        figure.savefig(temporary, dpi=150)


def _speed(axes: Axes, rows: Sequence[Row], colour: str) -> None:
    """One graph: a line through TORO's runs, and the two least-squares solvers."""
    toro = [row for row in rows if str(row["optimiser"]).startswith("TORO")]
    axes.plot(_values(toro, "seconds"), _values(toro, "chi2_ratio"), "o-", color=colour)
    for row in [*toro, *(row for row in rows if row["optimiser"] in MARK_OF)]:
        x, y = (_values([row], key)[0] for key in ("seconds", "chi2_ratio"))
        name = str(row["optimiser"])
        if name in MARK_OF:
            axes.plot(x, y, MARK_OF[name], color=colour, markersize=10)
        turned = 35 if name in MARK_OF else 0  # they stand side by side
        axes.annotate(name, (x, y), (4, 5), textcoords="offset points", fontsize=7, rotation=turned)


def _growth(axes: Axes, name: str, rows: Sequence[Row], colour: str) -> None:
    """Measured points and the straight line through the origin that fits them best."""
    edges, seconds = _values(rows, "edges"), _values(rows, "seconds_per_pass")
    slope = float(edges @ seconds / (edges @ edges))
    axes.plot(edges, seconds, "o", color=colour, label=f"{name}: {slope * 1e6:.1f} µs an edge")
    axes.plot([0, edges.max()], [0, slope * edges.max()], "-", color=colour, linewidth=1)


def _values(rows: Sequence[Row], column: str) -> np.ndarray:
    return np.array([float(str(row[column])) for row in rows])
