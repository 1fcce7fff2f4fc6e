"""Frequency of assistance to ground-truth methods, beside the counts of section 4.1."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel

from baselines.labels.chain import BatchRecord
from baselines.labels.methods import METHODS
from reproduction.runs.results import read_result, shaped
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.layouts import SOURCES, data_set_titles
from reproduction.tables.side import SideTable, Source, Table
from synfeal.records.tables import (
    COUNT,
    MAYBE,
    MAYBE_COUNT,
    MAYBE_TEXT,
    TEXT,
    frame_of,
)

NAME = "assistance"
PUBLISHED_ASSISTED = {
    name: method.published_assisted
    for name, method in METHODS.items()
    if method.published_assisted is not None
}
# 8,500 images of one room in batches of 250; section 4.1 counts 64.
PUBLISHED_SCENE, PUBLISHED_BATCHES = "large_room", 34
SPLITS = ("train", "test")
TOTAL = "total"
COUNTS = ("batches", "assisted", "lost", "frames", "registered", "filled")
LAST_POSE = tuple(
    f"last_{unit}_{when}_{which}"
    for unit in ("m", "deg")
    for when in ("before", "after")
    for which in ("median", "max")
)
SCHEMA = {
    **dict.fromkeys(("scene", "size", "method", "split"), TEXT),
    **dict.fromkeys(COUNTS, COUNT),
    **dict.fromkeys(LAST_POSE, MAYBE),
    **dict.fromkeys(("published_assisted", "published_batches"), MAYBE_COUNT),
    "truth_used": MAYBE_TEXT,
}
CAPTION = "Assistance that the ground-truth methods needed."
COLUMNS = (
    Column("Data set", "data_set"),
    Column("Labels from", "title"),
    Column("Batches", "batches", "{:.0f}", paper="published_batches"),
    Column("Assisted", "assisted", "{:.0f}", paper="published_assisted"),
    Column("Lost", "lost", "{:.0f}"),
    Column("Frames", "frames", "{:.0f}"),
    Column("Registered", "registered", "{:.0f}"),
    Column("Filled", "filled", "{:.0f}"),
    Column("Last pose, before", "last_m_before_median", text="before"),
    Column("Last pose, after", "last_m_after_median", text="after"),
    Column("Truth of each batch", "truth_used"),
)
REMARK = (
    "Batches of both splits together. Assisted: the last pose was replaced by the true one; lost:"
    " no motion was found. Last pose: its error before and after assistance, median over the"
    " batches. Truth of each batch: true poses that placed and scaled it, beside replaced last"
    " ones. In grey: what section 4.1 of the paper counts, of the batches its images make."
)
Records = list[dict[str, Any]]


class _Split(BaseModel):
    records: list[BatchRecord]


class _Splits(BaseModel):
    train: _Split
    test: _Split


def assistance_record(
    root: Path, scene: str, size: str, method: str, split: str = TOTAL
) -> dict[str, Any]:
    """Compute one row of the table, by column.

    Args:
        root: Results of the profile.
        scene: Name of the scene.
        size: Name of the size.
        method: Label method.
        split: ``train``, ``test``, or ``TOTAL`` for both together.
    """
    splits = SPLITS if split == TOTAL else (split,)
    found = [r for name in splits for r in batch_records(root, scene, size, method, name)]
    batches = pd.DataFrame(found, columns=[*BatchRecord.__annotations__])
    # A batch shares its first frame with the one before; the first of a split shares none.
    frames = int((batches.stop - batches.start - (batches.start > 0)).sum())
    sums = {count: int(batches[count].sum()) for count in ("assisted", "lost", "filled")}
    record: dict[str, Any] = {"method": method, "scene": scene, "size": size, "split": split}
    record |= {"batches": len(batches), **sums, "frames": frames}
    record |= {"registered": frames - sums["filled"]}
    record |= {"truth_used": truth_used_by(root, scene, size, method)}
    for unit in ("m", "deg"):
        for when in ("before", "after"):
            errors = batches[f"error_{when}_{unit}"].astype(float)
            record[f"last_{unit}_{when}_median"] = errors.median()
            record[f"last_{unit}_{when}_max"] = errors.max()
    if split == TOTAL and method in PUBLISHED_ASSISTED and scene == PUBLISHED_SCENE:
        record["published_assisted"] = PUBLISHED_ASSISTED[method]
        record["published_batches"] = PUBLISHED_BATCHES
    return record


def batch_records(root: Path, scene: str, size: str, method: str, split: str) -> Records:
    """Read what happened to each batch of a split, in order.

    Args:
        root: Results of the profile.
        scene: Name of the scene.
        size: Name of the size.
        method: Label method.
        split: ``train`` or ``test``.

    Returns:
        Fields of :class:`~baselines.labels.chain.BatchRecord`, by name, for each batch.

    Raises:
        InputError: the labels' record cannot be read.
    """
    path = root / "labels" / scene / size / method / "assistance.json"
    remedy = "chain these labels again"
    splits = read_result(path, ["splits"], remedy)["splits"]
    shaped(path, splits, _Splits, remedy)
    records: Records = splits[split]["records"]
    return records


def truth_used_by(root: Path, scene: str, size: str, method: str) -> str:
    """Return which true poses placed the batches of a method, in words.

    Args:
        root: Results of the profile.
        scene: Name of the scene.
        size: Name of the size.
        method: Label method.

    Returns:
        The words; empty where that was not recorded.

    Raises:
        InputError: the labels' record cannot be read.
    """
    path = root / "labels" / scene / size / method / "assistance.json"
    return str(read_result(path, ["splits"], "chain these labels again").get("truth_used", ""))


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out the rows of both splits together."""
    rows = of_both_splits(table)
    for when in ("before", "after"):
        errors = rows[[f"last_m_{when}_median", f"last_deg_{when}_median"]].to_numpy(float)
        rows[when] = ["–" if np.isnan(m) else f"{m:.2f} m, {deg:.2f}°" for m, deg in errors]
    return SideLayout(NAME, CAPTION, COLUMNS, rows, REMARK, block="data_set")


def of_both_splits(table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of both splits together, with titles of their data set and method."""
    rows = table[table.split == TOTAL]
    titles = rows.method.map(lambda method: SOURCES.get(method, method))
    return rows.assign(data_set=data_set_titles(rows), title=titles)


@SideTable(
    name="assistance",
    title="Assistance",
    rank=50,
    needs=("labels/{estimated_set}/assistance.json",),
)
class AssistanceTable(Table):
    """For each estimated label set a row per split, and one of both."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Count what assistance batches needed."""
        records = [
            assistance_record(source.root, *label_set, split)
            for label_set in source.design.estimated
            for split in (*SPLITS, TOTAL)
        ]
        return frame_of(records, SCHEMA)
