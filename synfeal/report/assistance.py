"""How often the ground-truth methods needed assistance, beside the counts of section 4.1."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import BaseModel

from baselines.groundtruth.chain import BatchRecord
from baselines.groundtruth.methods import METHODS
from synfeal.config import Design
from synfeal.frames import COUNT, MAYBE, MAYBE_COUNT, TEXT, frame_of, write_frame
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.report.results import read_result, shaped
from synfeal.report.sheet import Sheet, sheet_of_texts, write_latex

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
}
Records = list[dict[str, Any]]


class _Split(BaseModel):
    records: list[BatchRecord]


class _Splits(BaseModel):
    train: _Split
    test: _Split


def write_assistance_table(design: Design, root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write one row per re-estimated label set and split, and one of both splits together.

    Counts of batches and frames, and how far off the last poses of batches were; in LaTeX the rows
    of both splits together.
    """
    records = [
        assistance_record(root, *label_set, split)
        for label_set in design.estimated
        for split in (*SPLITS, TOTAL)
    ]
    table = frame_of(records, SCHEMA)
    write_frame(out_csv, table)
    write_latex(out_tex, assistance_sheet(table[table.split == TOTAL]))


def assistance_record(
    root: Path, scene: str, size: str, method: str, split: str = TOTAL
) -> dict[str, Any]:
    """One row of the table, by column; both splits together unless one is named."""
    splits = SPLITS if split == TOTAL else (split,)
    found = [r for name in splits for r in batch_records(root, scene, size, method, name)]
    batches = pd.DataFrame(found, columns=[*BatchRecord.__annotations__])
    # A batch shares its first frame with the one before; the first of a split shares none.
    frames = int((batches.stop - batches.start - (batches.start > 0)).sum())
    sums = {count: int(batches[count].sum()) for count in ("assisted", "lost", "filled")}
    record: dict[str, Any] = {"method": method, "scene": scene, "size": size, "split": split}
    record |= {"batches": len(batches), **sums, "frames": frames}
    record |= {"registered": frames - sums["filled"]}
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
    """What happened to each batch of a split, in order."""
    path = root / "labels" / scene / size / method / "assistance.json"
    remedy = "chain these labels again"
    splits = read_result(path, ["splits"], remedy)["splits"]
    shaped(path, splits, _Splits, remedy)
    records: Records = splits[split]["records"]
    return records


def assistance_sheet(table: pd.DataFrame) -> Sheet:
    """The rows of both splits together, as printed."""
    texts = pd.DataFrame(
        {
            "Labels from": table.method.map(SOURCES),
            "Data set": table.scene.map(scene_title) + ", " + table["size"],
            "Batches": table.batches.astype(str),
            "Assisted": table.assisted.astype(str),
            "Published": [
                "–" if pd.isna(assisted) else f"{assisted} of {batches}"
                for assisted, batches in table[["published_assisted", "published_batches"]].values
            ],
            "Lost": table.lost.astype(str),
            "Frames": table.frames.astype(str),
            "Filled": table.filled.astype(str),
            "Last pose off by": last_pose(table, "before"),
        }
    )
    remark = (
        "Training and test batches together. Last pose off by: median over the batches before "
        "assistance. Published: counts of section 4.1, of the batches its images make."
    )
    return sheet_of_texts(
        NAME, "Assistance that the ground-truth methods needed.", texts, (remark,)
    )


def last_pose(table: pd.DataFrame, when: str) -> list[str]:
    """How far off last poses of batches were before or after assistance, in median."""
    errors = table[[f"last_m_{when}_median", f"last_deg_{when}_median"]].to_numpy(float)
    return ["–" if pd.isna(m) else f"{m:.2f} m, {deg:.2f}°" for m, deg in errors]
