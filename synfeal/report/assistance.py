"""How often the ground-truth methods needed assistance, beside the counts of section 4.1."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from synfeal.config import Experiment
from synfeal.report.results import read_result
from synfeal.report.tables import Value, write_rows

# Section 4.1 counts 64 batches; 8,500 images in batches of 250 are 34.
PUBLISHED_ASSISTED = {"sfm": 3, "rgbd-toro": 6, "rgbd-g2o": 4}
PUBLISHED_BATCHES = 64
SPLITS = ("train", "test")
COUNTS = ("batches", "assisted", "lost", "registered", "filled")
ERRORS = tuple(f"label_error_{unit}_{split}" for split in SPLITS for unit in ("m", "deg"))
COLUMNS = ("method", "scene", "size", *COUNTS, *ERRORS, "published_assisted", "published_batches")


def write_assistance_table(rows: Iterable[Experiment], root: Path, out_csv: Path) -> None:
    """Write one row per label set that a method re-estimated, training and test split together.

    Args:
        rows: the design; rows with other label sources are passed over.
        root: results directory of the profile, where ``labels`` is.
        out_csv: counts of batches and frames, and the median label error of each split.

    Raises:
        InputError: a record of assistance is missing or unreadable.
    """
    estimated = [row for row in rows if row.labels in PUBLISHED_ASSISTED]
    sets = dict.fromkeys((row.labels, row.scene, row.size) for row in estimated)
    write_rows(out_csv, COLUMNS, [assistance_record(root, *names) for names in sets])


def assistance_record(root: Path, method: str, scene: str, size: str) -> dict[str, Value]:
    """The counts of one label set, by column."""
    path = root / "labels" / scene / size / method / "assistance.json"
    splits = read_result(path, ["splits"], "chain these labels again")["splits"]
    record: dict[str, Value] = {"method": method, "scene": scene, "size": size}
    for count in COUNTS:
        record[count] = sum(_count(splits[split], count) for split in SPLITS)
    for split in SPLITS:
        error = splits[split]["label_error"]
        record[f"label_error_m_{split}"] = error["median_m"]
        record[f"label_error_deg_{split}"] = error["median_deg"]
    published = {"assisted": PUBLISHED_ASSISTED[method], "batches": PUBLISHED_BATCHES}
    return record | {f"published_{name}": count for name, count in published.items()}


def _count(split: Mapping[str, Any], name: str) -> int:
    """A total of the split, or the sum over its batches where no total is kept."""
    if name in split:
        return int(split[name])
    return sum(int(batch[name]) for batch in split["records"])
