"""What ``synfeal evaluate`` prints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from synfeal.evaluation.metrics import BOUNDS, MEANS, ORIENTATION, POSITION, Metrics
from synfeal.evaluation.reprojection import DCRE_BOUNDS
from synfeal.evaluation.run import Evaluation, Settings

SHOWN = 3  # frames named where some are missing
TITLES = {"": "against the data set", "_labels": "against --labels"}
UNITS = {POSITION: ("m", "{:.4g} m"), ORIENTATION: ("deg", "{:.4g}°")}


def rows_of(found: Evaluation) -> list[tuple[str, str, str, float]]:
    """Title, key in ``metrics``, format and factor of everything that is printed, in order."""
    rows = []
    for name, title in ((POSITION, "position"), (ORIENTATION, "orientation")):
        text = UNITS[name][1]
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
    """One row per score: ``score,against,value,low,high``."""
    return pd.DataFrame(
        {
            "score": key,
            "against": "labels" if end else "dataset",
            "value": found.metrics.get(f"{key}{end}"),
            "low": found.metrics.get(f"{key}{end}_low"),
            "high": found.metrics.get(f"{key}{end}_high"),
        }
        for end in found.ends
        for _, key, _, _ in rows_of(found)
    ).astype({"value": float, "low": float, "high": float})


def errors_table(found: Evaluation) -> pd.DataFrame:
    """One row per frame: its name and its errors, ``inf`` where there is no pose."""
    return pd.DataFrame({"frame": found.frames.names, **found.errors})


def report_text(poses: Path, settings: Settings, found: Evaluation) -> str:
    """Findings, then the table."""
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
    return "\n".join(lines) + "\n"


def _findings(poses: Path, settings: Settings, found: Evaluation) -> list[str]:
    n_frames, there = len(found.frames.frames), found.matched.row >= 0
    lines = [
        f"{poses}: {found.estimates.kind}, {len(found.estimates.names)} poses, taken as"
        f" {found.convention.direction} with quaternions {found.convention.order}",
        f"{found.frames.split} split: {n_frames} frames, {int(there.sum())} of them with a pose",
    ]
    names = np.array(found.frames.names)
    lines += _some("without a pose, which counts as a failure", names[~there])
    lines += _some("no rotation, which counts likewise", names[there & ~found.rotations])
    if found.matched.foreign:
        lines.append(f"{found.matched.foreign} poses of other frames are left out")
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
