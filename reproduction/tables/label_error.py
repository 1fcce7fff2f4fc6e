"""Errors of re-estimated labels, with and without assistance, and their cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import FiniteFloat

from baselines.labels.alignment import ALIGNMENTS, aligned_errors
from baselines.labels.label_error import Pair, absolute_errors, relative_error, share_within, spread
from baselines.labels.methods import METHODS, stages_of
from reproduction.runs.results import read_result
from reproduction.tables.assistance import SPLITS, TOTAL, batch_records, of_both_splits
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.side import SideTable, Source, Table
from synfeal.dataset.pose_table import read_pose_table
from synfeal.records.tables import COUNT, EXTRA, MAYBE, NUMBER, TEXT, frame_of

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
# After alignment; what is scaled is turned no further, so angles are those of the rigid one.
ALIGNED = tuple(
    f"{alignment}_{measure}_{which}"
    for alignment in ALIGNMENTS
    for measure in ("position_m", "orientation_deg")
    for which in SPREAD
    if (alignment, measure) != ("similarity", "orientation_deg")
)
SCHEMA = {
    **dict.fromkeys(("scene", "size", "method", "split", "assistance"), TEXT),
    "frames": COUNT,
    **dict.fromkeys(ABSOLUTE, NUMBER),
    **dict.fromkeys(RELATIVE, MAYBE),
    **dict.fromkeys(("share_within_5cm_5deg", "share_filled"), NUMBER),
    **dict.fromkeys(ALIGNED, EXTRA),
    **dict.fromkeys(("seconds_per_frame", "peak_memory_mb"), NUMBER),
}
CAPTION = "Errors of re-estimated labels against the true poses, before and after assistance."
COLUMNS = (
    Column("Data set", "data_set"),
    Column("Labels from", "title"),
    Column("Assistance", "assistance"),
    Column("Median, m", "position_m_median", "{:.3g}"),
    Column("RMSE, m", "position_m_rmse", "{:.3g}"),
    Column("Max, m", "position_m_max", "{:.3g}"),
    Column("Median, °", "orientation_deg_median", "{:.3g}"),
    Column("RMSE, °", "orientation_deg_rmse", "{:.3g}"),
    Column("Max, °", "orientation_deg_max", "{:.3g}"),
    Column("Rigid, median, m", "rigid_position_m_median", "{:.3g}"),
    Column("Rigid, median, °", "rigid_orientation_deg_median", "{:.3g}"),
    Column("Similarity, median, m", "similarity_position_m_median", "{:.3g}"),
    Column("Drift, %", "relative_25_m_per_m", "{:.2g}", 100),
    Column("Drift, °/m", "relative_25_deg_per_m", "{:.2g}"),
    Column("Within 5 cm, 5°, %", "share_within_5cm_5deg", "{:.0f}", 100),
    Column("Registered, %", "share_registered", "{:.1f}", 100),
    Column("s per frame", "seconds_per_frame", "{:.2g}"),
    Column("Memory, MB", "peak_memory_mb", "{:,.0f}"),
)
REMARK = (
    "Both splits, without alignment: the first pose is the true one. Rigid, similarity: after each"
    " split was turned and shifted, or also scaled, onto the true poses as one, by the mean"
    " rotation of its cameras. Registered: frames whose pose the method found; labels of the"
    " others were filled in, count here, and are not trained on. Before assistance: what the"
    " labels were had no last pose been replaced. Drift: errors of the motion over 25 frames, by"
    " the metre travelled; a replaced pose adds to it. Figures show both along the sequence."
)


def label_records(
    root: Path, scene: str, size: str, method: str, split: str
) -> list[dict[str, Any]]:
    """Compute the two rows of a label set, before and after assistance.

    Args:
        root: Results of the profile.
        scene: Name of the scene.
        size: Name of the size.
        method: Label method.
        split: ``train``, ``test``, or ``TOTAL`` for both together.

    Returns:
        Both rows, by column.
    """
    splits = SPLITS if split == TOTAL else (split,)
    batches = [b for s in splits for b in batch_records(root, scene, size, method, s)]
    folder, records = root / "labels" / scene / size, []
    truths = [read_pose_table(folder / "synfeal" / f"{s}.csv") for s in splits]
    frames = sum(map(len, truths))
    same = {"scene": scene, "size": size, "method": method, "split": split, "frames": frames}
    same |= {"share_filled": sum(int(batch["filled"]) for batch in batches) / frames}
    same |= cost_record(root, scene, size, method, splits, frames)
    for state, stem in STATES.items():
        labels = [read_pose_table(folder / method / f"{stem.format(s)}.csv") for s in splits]
        errors = error_record(list(zip(labels, truths, strict=True)))
        records.append({**same, "assistance": state, **errors})
    return records


def error_record(pairs: Sequence[Pair]) -> dict[str, Any]:
    """Compute errors of the labels of some splits against their true poses, by column."""
    every = [absolute_errors(labels, truth) for labels, truth in pairs]
    position_m, orientation_deg = (np.concatenate(parts) for parts in zip(*every, strict=True))
    record: dict[str, Any] = {}
    errors = {"position_m": position_m, "orientation_deg": orientation_deg}
    for measure, values in errors.items():
        found = spread(values)
        record |= {f"{measure}_{which}": getattr(found, which) for which in SPREAD}
    for n in RELATIVE_FRAMES:
        error = relative_error(pairs, n)
        for name, attribute in DRIFT.items() if error else ():
            value = getattr(error, attribute)
            record[f"relative_{n}_{name}"] = value if np.isfinite(value) else None
    for alignment in ALIGNMENTS:
        measures = ("position_m", "orientation_deg")
        for measure, values in zip(measures, aligned_errors(pairs, alignment), strict=True):
            found, stem = spread(values), f"{alignment}_{measure}"
            moved = {f"{stem}_{which}": getattr(found, which) for which in SPREAD}
            record |= {name: value for name, value in moved.items() if name in ALIGNED}
    within = share_within((position_m, orientation_deg), WITHIN_M, WITHIN_DEG)
    return record | {"share_within_5cm_5deg": within}


def cost_record(
    root: Path, scene: str, size: str, method: str, splits: Sequence[str], frames: int
) -> dict[str, Any]:
    """Compute processor seconds per frame and the largest memory, over all stages and batches.

    Args:
        root: Results of the profile.
        scene: Name of the scene.
        size: Name of the size.
        method: Label method.
        splits: Splits to add up.
        frames: Number of their frames.

    Raises:
        InputError: the facts of a batch cannot be read.
    """
    seconds, peaks = 0.0, [0.0]
    for stage in stages_of(method):
        for split in splits:
            folder = root / "estimates" / scene / size / stage / split
            for batch, _ in enumerate(batch_records(root, scene, size, method, split)):
                path, kind = folder / f"batch-{batch:03d}.json", dict[str, FiniteFloat]
                facts = read_result(path, ["peak_memory_mb"], "estimate that batch again", kind)
                unused = METHODS[method].unused
                seconds += sum(v for k, v in facts.items() if k.endswith("_s") and k not in unused)
                peaks.append(facts["peak_memory_mb"])
    return {"seconds_per_frame": seconds / frames, "peak_memory_mb": max(peaks)}


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a row before and a row after assistance for every method and data set."""
    rows = of_both_splits(table)
    rows = rows.assign(share_registered=1 - rows.share_filled)
    return SideLayout(NAME, CAPTION, COLUMNS, rows, REMARK, block="data_set")


@SideTable(
    name="label_error",
    title="Label error",
    rank=60,
    needs=(
        "labels/{estimated_set}/assistance.json",
        "labels/{estimated_set}/{split}-unassisted.csv",
        "labels/{pose_set}/{split}.csv",
        "estimates/{estimated_batch}.json",
    ),
)
class LabelErrorTable(Table):
    """Errors of estimated labels and what a frame took, before and after assistance."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Compare all estimated labels with the true poses."""
        records = [
            record
            for label_set in source.design.estimated
            for split in (*SPLITS, TOTAL)
            for record in label_records(source.root, *label_set, split)
        ]
        return frame_of(records, SCHEMA)
