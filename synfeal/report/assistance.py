"""How often the ground-truth methods needed assistance, beside the counts of section 4.1."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from pydantic import BaseModel, TypeAdapter

from baselines.groundtruth.chain import BatchRecord
from baselines.groundtruth.methods import METHODS
from synfeal.config import Experiment
from synfeal.report.grid import Entry, Grid, Group, Line
from synfeal.report.grid import Value as Printed
from synfeal.report.latex import write_latex
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.report.results import check_result, read_result
from synfeal.report.tables import Value, write_rows

NAME = "assistance"
PUBLISHED_ASSISTED = {
    name: method.published_assisted
    for name, method in METHODS.items()
    if method.published_assisted is not None
}
# 8,500 images in batches of 250; section 4.1 counts 64.
PUBLISHED_BATCHES = 34
SPLITS = ("train", "test")
TOTAL = "total"
COUNTS = ("batches", "assisted", "lost", "frames", "registered", "filled")
LAST_POSE = tuple(
    f"last_{unit}_{when}_{which}"
    for unit in ("m", "deg")
    for when in ("before", "after")
    for which in ("median", "max")
)
COLUMNS = (
    *("scene", "size", "method", "split", *COUNTS, *LAST_POSE),
    *("published_assisted", "published_batches"),
)
Records = list[dict[str, Any]]


class _Split(BaseModel):
    records: list[BatchRecord]


class _Splits(BaseModel):
    train: _Split
    test: _Split


_SHAPE = TypeAdapter(_Splits)


def write_assistance_table(
    rows: Iterable[Experiment], root: Path, out_csv: Path, out_tex: Path
) -> None:
    """Write one row per re-estimated label set and split, and one of both splits together.

    Args:
        rows: the design; rows with other label sources are passed over.
        root: results directory of the profile, where ``labels`` is.
        out_csv: counts of batches and frames, and how far off the last poses of batches were.
        out_tex: the rows of both splits together, as a table environment.

    Raises:
        InputError: a record of assistance is missing or unreadable.
    """
    records = [
        assistance_record(root, *names, split)
        for names in estimated_sets(rows)
        for split in (*SPLITS, TOTAL)
    ]
    write_rows(out_csv, COLUMNS, records)
    write_latex(out_tex, assistance_grid([r for r in records if r["split"] == TOTAL]))


def estimated_sets(rows: Iterable[Experiment]) -> list[tuple[str, str, str]]:
    """Method, scene and size of every label set of a design that a method re-estimated."""
    return list(dict.fromkeys((r.labels, r.scene, r.size) for r in rows if r.labels in METHODS))


def assistance_record(
    root: Path, method: str, scene: str, size: str, split: str = TOTAL
) -> dict[str, Value]:
    """One row of the table, by column; both splits together unless one is named."""
    splits = SPLITS if split == TOTAL else (split,)
    batches = [batch for name in splits for batch in batch_records(root, method, scene, size, name)]
    record: dict[str, Value] = {"method": method, "scene": scene, "size": size, "split": split}
    record |= {"batches": len(batches)}
    for count in ("assisted", "lost", "filled"):
        record[count] = sum(int(batch[count]) for batch in batches)
    # A batch shares its first frame with the one before; the first of a split shares none.
    frames = sum(batch["stop"] - batch["start"] - (batch["start"] > 0) for batch in batches)
    record |= {"frames": frames, "registered": frames - int(str(record["filled"]))}
    record |= _last_pose(batches)
    if split == TOTAL and method in PUBLISHED_ASSISTED:
        record["published_assisted"] = PUBLISHED_ASSISTED[method]
        record["published_batches"] = PUBLISHED_BATCHES
    return record


def batch_records(root: Path, method: str, scene: str, size: str, split: str) -> Records:
    """What happened to each batch of a split, in order.

    Raises:
        InputError: the record of assistance is missing or unreadable.
    """
    path = root / "labels" / scene / size / method / "assistance.json"
    remedy = "chain these labels again"
    splits = read_result(path, ["splits"], remedy)["splits"]
    check_result(path, splits, _SHAPE, remedy)
    records: Records = splits[split]["records"]
    return records


def assistance_grid(records: Sequence[Mapping[str, Value]]) -> Grid:
    """The rows of both splits together, as printed."""
    headings = ("Batches", "Assisted", "Published", "Lost", "Frames", "Filled", "Last pose off by")
    return Grid(
        NAME,
        "Assistance that the ground-truth methods needed.",
        ("Labels from", "Data set", *headings),
        (Group("", tuple((_line(record),) for record in records)),),
        (
            "Training and test batches together. Last pose off by: median over the batches before "
            "assistance. Published: counts of section 4.1, of the batches its images make.",
        ),
    )


def _last_pose(batches: Records) -> dict[str, Value]:
    """Errors of the last poses: median over the batches and maximum, before and after."""
    found: dict[str, Value] = {}
    for unit in ("m", "deg"):
        for when in ("before", "after"):
            errors = [float(batch[f"error_{when}_{unit}"]) for batch in batches]
            found[f"last_{unit}_{when}_median"] = median(errors) if errors else None
            found[f"last_{unit}_{when}_max"] = max(errors, default=None)
    return found


def _line(record: Mapping[str, Value]) -> Line:
    published = "–"
    if record.get("published_assisted") is not None:
        published = f"{record['published_assisted']} of {record['published_batches']}"
    metres, degrees = record["last_m_before_median"], record["last_deg_before_median"]
    off = "–" if metres is None or degrees is None else f"{metres:.2f} m, {degrees:.2f}°"
    cells = (record["batches"], record["assisted"], published, record["lost"], record["frames"])
    entries = tuple(Entry((Printed(str(cell)),)) for cell in (*cells, record["filled"], off))
    data_set = f"{scene_title(str(record['scene']))}, {record['size']}"
    return Line("labels", SOURCES[str(record["method"])], data_set, entries)
