"""Output of ``synfeal evaluate``: printed scores, tables, a figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from synfeal.evaluation.coverage import Coverage
from synfeal.evaluation.metrics import (
    BOUNDS,
    MEANS,
    ORIENTATION,
    POSITION,
    Metrics,
    cumulative,
    joint_error,
)
from synfeal.evaluation.reprojection import DCRE_BOUNDS
from synfeal.evaluation.run import Evaluation, Settings
from synfeal.records.files import atomic_path
from synfeal.records.tables import write_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 3  # frames named where some are missing
TITLES = {"": "against the data set", "_labels": "against the labels"}


def rows_of(found: Evaluation) -> list[tuple[str, str, str, float]]:
    """List title, key in ``metrics``, format and factor of everything that is printed, in order."""
    rows = []
    units = ((POSITION, "position", "{:.4g} m"), (ORIENTATION, "orientation", "{:.4g}°"))
    for name, title, text in units:
        keys = {"median": name, "mean": MEANS[name], "RMSE": f"{name}_rmse", "max": f"{name}_max"}
        rows += [(f"{title}, {which}", key, text, 1.0) for which, key in keys.items()]
    rows += [(f"within {bound.title}", bound.name, "{:.1f} %", 100.0) for bound in BOUNDS]
    if "dcre" in found.errors:
        rows.append(("DCRE, median", "dcre", "{:.2f} %", 100.0))
        rows += [
            (f"DCRE below {b:.0%}", f"dcre_below_{b:g}", "{:.1f} %", 100.0) for b in DCRE_BOUNDS
        ]
    return rows


def scores_table(found: Evaluation) -> pd.DataFrame:
    """Tabulate the scores, one per row: ``score,against,value,low,high``."""
    scores = [
        {
            "score": key,
            "against": _against(end),
            "value": found.metrics.get(f"{key}{end}"),
            "low": found.metrics.get(f"{key}{end}_low"),
            "high": found.metrics.get(f"{key}{end}_high"),
        }
        for end in found.ends
        for _, key, _, _ in rows_of(found)
    ]
    for end in found.ends:
        for name in (POSITION, ORIENTATION):
            for one in found.coverage.get(name + end, []):
                values = {"held": one.held, "stated_over_needed": one.width}
                for what, value in values.items():
                    score = f"{name}_{100 * one.level:.0f}_{what}"
                    scores.append({"score": score, "against": _against(end), "value": value})
    columns = ["score", "against", "value", "low", "high"]
    return pd.DataFrame(scores, columns=columns).astype(dict.fromkeys(columns[2:], float))


def _against(end: str) -> str:
    return "labels" if end else "dataset"


def report_text(poses: Path, settings: Settings, found: Evaluation) -> str:
    """Format what ``synfeal evaluate`` prints: the findings, then the table of scores.

    Args:
        poses: File of the poses that were scored.
        settings: How they were scored.
        found: The scores.
    """
    lines = [*_findings(poses, settings, found), ""]
    heads = [TITLES[end] for end in found.ends]
    rows = [
        [title, *(_cell(found.metrics, f"{key}{end}", text, factor) for end in found.ends)]
        for title, key, text, factor in rows_of(found)
    ]
    widths = [max(len(row[i]) for row in [["", *heads], *rows]) for i in range(len(heads) + 1)]
    for row in [["", *heads], *rows]:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        lines += ["  ".join(cells).rstrip()]
    lines += _coverage_lines(found)
    return "\n".join(lines) + "\n"


def _coverage_lines(found: Evaluation) -> list[str]:
    """Say how many errors lie within their stated radii, and how wide these are."""
    if not found.coverage:
        return []
    lines = ["", "stated errors: held (stated radius over needed)"]
    for end in found.ends:
        for name, title in ((POSITION, "position"), (ORIENTATION, "orientation")):
            if (name + end) in found.coverage:
                cells = [
                    f"{100 * one.level:.0f} %: {100 * one.held:.1f} % ({one.width:.2f})"
                    for one in found.coverage[name + end]
                ]
                lines.append(f"{title}, {TITLES[end]}: {', '.join(cells)}")
    return lines


def _findings(poses: Path, settings: Settings, found: Evaluation) -> list[str]:
    n_frames, named = len(found.frames.names), found.row >= 0
    # Of a photograph that is not localized, a file holds a row and no pose.
    there = named & np.isfinite(found.estimates.translation[found.row]).all(axis=1)
    lines = [
        f"{poses}: {found.estimates.kind}, {len(found.estimates.names)} poses, taken as"
        f" {found.convention.direction} with quaternions {found.convention.order}"
        + f" and camera axes of {found.convention.axes}"
        * (found.convention.axes != "opencv"),
        f"{found.frames.title}: {n_frames} frames, {int(there.sum())} of them with a pose",
    ]
    if found.frames.n_left_out:
        lines.append(
            f"{found.frames.n_left_out} poses of the reference have no estimate within"
            f" {settings.most_apart_s:g} s and are left out"
            if found.frames.frame_key == "time"
            else f"{found.frames.n_left_out} further photographs are not in {poses} and left out"
        )
    names = np.array(found.frames.names)
    lines += _some("without a pose, which counts as a failure", names[~there])
    lines += _some("no rotation, which counts likewise", names[there & ~found.rotations])
    if foreign := len(found.estimates.names) - int(named.sum()):
        lines.append(f"{foreign} poses of other frames are left out")
    if settings.align != "none":
        scale = f", scale {found.scales['']:.6g}" if settings.align == "sim3" else ""
        lines.append(f"aligned as a whole first ({settings.align}){scale}")
    if not any(key.endswith("_low") for key in found.metrics):
        lines.append("too few paths or sequences for limits")
    lines.append("mean, RMSE and max are of the frames with a pose")
    return lines


def _some(what: str, names: np.ndarray) -> list[str]:
    if not len(names):
        return []
    more = f", ... ({len(names)})" if len(names) > SHOWN else ""
    return [f"{what}: {', '.join(names[:SHOWN])}{more}"]


def _cell(metrics: Metrics, key: str, text: str, factor: float) -> str:
    value = metrics.get(key)
    if value is None:
        return "∞"
    shown = text.format(factor * value)
    low, high = metrics.get(f"{key}_low"), metrics.get(f"{key}_high")
    if low is None and f"{key}_low" not in metrics:
        return shown
    ends = ("∞" if end is None else f"{factor * end:.4g}" for end in (low, high))
    return f"{shown} ({'–'.join(ends)})"


COLORS, DASHES = ("#0072B2", "#D55E00"), ("-", "--")
LEAST = 1e-6  # where an error of nothing is drawn on a logarithmic axis


def figure_of(title: str, found: Evaluation) -> Figure:
    """Draw three panels: position, orientation, and both at once (x cm and x°).

    A fourth one, where errors are stated: how many of them the radii of each level hold.
    """
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter

    n_panels = 4 if found.coverage else 3
    figure = Figure(figsize=(11 / 3 * n_panels, 3.8), layout="constrained")
    figure.suptitle(title, fontsize=10)
    every = figure.subplots(1, n_panels, sharey=True)
    panels = every[:3]
    labels = ("position error (m)", "orientation error (°)", "both errors: below x cm and x°")
    for end, color, dash in zip(found.ends, COLORS, DASHES, strict=False):
        shown = found.errors[POSITION + end], found.errors[ORIENTATION + end]
        for axes, values in zip(panels, (*shown, joint_error(found.errors, end)), strict=True):
            error, percent = cumulative(np.maximum(values, LEAST))
            axes.step(error, percent, dash, where="post", color=color, label=TITLES[end])
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
    if found.coverage:
        _draw_coverage(every[3], found)
    return figure


def _draw_coverage(axes: Axes, found: Evaluation) -> None:
    """Draw the share of errors within radii against the share that these are said to hold."""
    axes.plot([0, 100], [0, 100], color="0.6", linewidth=0.8)
    for end, dash in zip(found.ends, DASHES, strict=False):
        for name, title, color in zip(
            (POSITION, ORIENTATION), ("position", "orientation"), COLORS, strict=True
        ):
            drawn: list[Coverage] = found.coverage.get(name + end, [])
            label = f"{title}, {TITLES[end]}" if len(found.ends) > 1 else title
            axes.plot(
                [100 * one.level for one in drawn],
                [100 * one.held for one in drawn],
                dash,
                marker="o",
                markersize=3,
                color=color,
                label=label,
            )
    axes.set(xlim=(40, 101), xlabel="level of the stated radius (%)")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)


FILES = ("scores.csv", "errors.csv", "errors.png")


def write_files(out: Sequence[Path], title: str, found: Evaluation) -> None:
    """Write scores, errors and the figure.

    Args:
        out: Three files, in this order: ``.csv``, ``.csv`` and ``.png``.
        title: Title of the figure.
        found: The scores.
    """
    errors = pd.DataFrame({"frame": found.frames.names, **found.errors})  # inf: no pose
    for path, table in zip(out, (scores_table(found), errors), strict=False):
        write_frame(path, table, float_format=None)
    with atomic_path(out[2]) as temporary:
        figure_of(title, found).savefig(temporary, dpi=150)
