"""How good re-estimated labels are, with and without assistance, and what they cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import FiniteFloat

from baselines.groundtruth.label_error import (
    Pair,
    PoseErrors,
    absolute_errors,
    relative_error,
    share_within,
    spread,
)
from baselines.groundtruth.methods import METHODS, stages_of
from synfeal.config import Design
from synfeal.dataset.pose_table import read_pose_table
from synfeal.frames import COUNT, MAYBE, NUMBER, TEXT, frame_of, write_frame
from synfeal.report.assistance import SPLITS, TOTAL, batch_records
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.report.results import read_result
from synfeal.report.sheet import Sheet, sheet_of_texts, write_latex

NAME = "label_error"
# Labels without assistance, and the labels of the data set, by the name of their files.
STATES = {"before": "{}-unassisted", "after": "{}"}
RELATIVE_FRAMES = (1, 25)
WITHIN_M, WITHIN_DEG = 0.05, 5.0
SPREAD = ("median", "rmse", "max")
# By how names of columns end, what of a relative error they hold.
DRIFT = {"m_rmse": "rmse_m", "deg_rmse": "rmse_deg"}
DRIFT |= {"m_per_m": "per_metre_m", "deg_per_m": "per_metre_deg"}
ABSOLUTE = tuple(f"{m}_{which}" for m in ("position_m", "orientation_deg") for which in SPREAD)
RELATIVE = tuple(f"relative_{n}_{name}" for n in RELATIVE_FRAMES for name in DRIFT)
SCHEMA = {
    **dict.fromkeys(("scene", "size", "method", "split", "assistance"), TEXT),
    "frames": COUNT,
    **dict.fromkeys(ABSOLUTE, NUMBER),
    **dict.fromkeys(RELATIVE, MAYBE),
    **dict.fromkeys(("share_within_5cm_5deg", "share_filled"), NUMBER),
    **dict.fromkeys(("seconds_per_frame", "peak_memory_mb"), NUMBER),
}


def write_label_error_table(design: Design, root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write two rows, before and after assistance, per re-estimated label set and split.

    Errors of the labels against the true poses, and what a frame took; in LaTeX the rows of both
    splits together.
    """
    records = [
        record
        for label_set in design.estimated
        for split in (*SPLITS, TOTAL)
        for record in label_records(root, *label_set, split)
    ]
    table = frame_of(records, SCHEMA)
    write_frame(out_csv, table)
    write_latex(out_tex, label_error_sheet(table[table.split == TOTAL]))


def label_records(
    root: Path, scene: str, size: str, method: str, split: str
) -> list[dict[str, Any]]:
    """Both rows of a label set and a split, or of both splits together."""
    splits = SPLITS if split == TOTAL else (split,)
    filled = sum(
        int(batch["filled"])
        for s in splits
        for batch in batch_records(root, scene, size, method, s)
    )
    folder, records = root / "labels" / scene / size, []
    for state, stem in STATES.items():
        pairs = [
            (
                read_pose_table(folder / method / f"{stem.format(s)}.csv"),
                read_pose_table(folder / "synfeal" / f"{s}.csv"),
            )
            for s in splits
        ]
        frames = sum(len(truth) for _, truth in pairs)
        record: dict[str, Any] = {"scene": scene, "size": size, "method": method}
        record |= {"split": split, "assistance": state, "frames": frames}
        record |= error_record(pairs) | {"share_filled": filled / frames}
        records.append(record | cost_record(root, scene, size, method, splits, frames))
    return records


def error_record(pairs: Sequence[Pair]) -> dict[str, Any]:
    """Errors of the labels of some splits against their true poses, by column."""
    every = [absolute_errors(*pair) for pair in pairs]
    errors: PoseErrors = (
        np.concatenate([position_m for position_m, _ in every]),
        np.concatenate([orientation_deg for _, orientation_deg in every]),
    )
    record: dict[str, Any] = {}
    for measure, values in zip(("position_m", "orientation_deg"), errors, strict=True):
        found = spread(values)
        record |= {f"{measure}_{which}": getattr(found, which) for which in SPREAD}
    for n in RELATIVE_FRAMES:
        error = relative_error(pairs, n)
        for name, attribute in DRIFT.items() if error else ():
            value = getattr(error, attribute)
            record[f"relative_{n}_{name}"] = value if np.isfinite(value) else None
    return record | {"share_within_5cm_5deg": share_within(errors, WITHIN_M, WITHIN_DEG)}


def cost_record(
    root: Path, scene: str, size: str, method: str, splits: Sequence[str], frames: int
) -> dict[str, Any]:
    """Processor seconds per frame and the largest memory, over all stages and batches."""
    seconds, peaks = 0.0, [0.0]
    for stage in stages_of(method):
        for split in splits:
            folder = root / "groundtruth" / scene / size / stage / split
            for batch, _ in enumerate(batch_records(root, scene, size, method, split)):
                path, kind = folder / f"batch-{batch:03d}.json", dict[str, FiniteFloat]
                facts = read_result(path, ["peak_memory_mb"], "estimate that batch again", kind)
                unused = METHODS[method].unused
                seconds += sum(v for k, v in facts.items() if k.endswith("_s") and k not in unused)
                peaks.append(facts["peak_memory_mb"])
    return {"seconds_per_frame": seconds / frames, "peak_memory_mb": max(peaks)}


def label_error_sheet(table: pd.DataFrame) -> Sheet:
    """The rows of both splits together, as printed: a line before and a line after assistance."""
    data_set = table.scene.map(scene_title) + ", " + table["size"]
    texts = pd.DataFrame(
        {
            "block": data_set,
            "row": data_set + table.method,
            "Labels from": table.method.map(SOURCES).where(table.assistance == "before", ""),
            "Assistance": table.assistance,
            **{
                title: _pairs(table, f"position_m_{which}", f"orientation_deg_{which}")
                for title, which in {"Median": "median", "RMSE": "rmse", "Maximum": "max"}.items()
            },
            "Drift over 25 frames": _pairs(
                table, "relative_25_m_per_m", "relative_25_deg_per_m", (" m/m", "°/m")
            ),
            "Within 5 cm, 5°": [f"{100 * share:.0f} %" for share in table.share_within_5cm_5deg],
            "Filled": [f"{100 * share:.1f} %" for share in table.share_filled],
            "s per frame": [f"{seconds:.3g}" for seconds in table.seconds_per_frame],
            "Memory": [f"{megabytes:.0f} MB" for megabytes in table.peak_memory_mb],
        }
    )
    caption = "Errors of re-estimated labels against the true poses, before and after assistance."
    remark = (
        "Positions and orientations without alignment: the first pose is the true one. Drift: "
        "errors of the motion over 25 frames, by the metre travelled."
    )
    return sheet_of_texts(NAME, caption, texts, (remark,))


def _pairs(
    table: pd.DataFrame, first: str, second: str, units: tuple[str, str] = (" m", "°")
) -> list[str]:
    texts = [
        f"{a:.3g}{units[0]}, {b:.3g}{units[1]}" for a, b in table[[first, second]].to_numpy(float)
    ]
    return [text.replace("nan", "–") for text in texts]
