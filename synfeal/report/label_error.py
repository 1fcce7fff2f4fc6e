"""How good re-estimated labels are, with and without assistance, and what they cost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from pydantic import FiniteFloat, TypeAdapter

from baselines.groundtruth.label_error import (
    Pair,
    PoseErrors,
    RelativeError,
    absolute_errors,
    relative_error,
    share_within,
    spread,
)
from baselines.groundtruth.methods import METHODS, stages_of
from synfeal.config import Experiment
from synfeal.dataset.pose_table import read_pose_table
from synfeal.errors import InputError, why
from synfeal.files import read_json
from synfeal.report.assistance import SPLITS, TOTAL, batch_records, estimated_sets
from synfeal.report.grid import Entry, Grid, Group, Line
from synfeal.report.grid import Value as Printed
from synfeal.report.latex import write_latex
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.report.tables import Value, write_rows

NAME = "label_error"
_FACTS = TypeAdapter(dict[str, FiniteFloat])
# Labels without assistance, and the labels of the data set, by the name of their files.
STATES = {"before": "{}-unassisted", "after": "{}"}
RELATIVE_FRAMES = (1, 25)
WITHIN_M, WITHIN_DEG = 0.05, 5.0
ABSOLUTE = tuple(
    f"{measure}_{which}"
    for measure in ("position_m", "orientation_deg")
    for which in ("median", "rmse", "max")
)
RELATIVE = tuple(
    f"relative_{n}_{name}"
    for n in RELATIVE_FRAMES
    for name in ("m_rmse", "deg_rmse", "m_per_m", "deg_per_m")
)
COLUMNS = (
    *("scene", "size", "method", "split", "assistance", "frames", *ABSOLUTE, *RELATIVE),
    *("share_within_5cm_5deg", "share_filled", "seconds_per_frame", "peak_memory_mb"),
)


def write_label_error_table(
    rows: Iterable[Experiment], root: Path, out_csv: Path, out_tex: Path
) -> None:
    """Write two rows, before and after assistance, per re-estimated label set and split.

    Args:
        rows: the design; rows with other label sources are passed over.
        root: results directory of the profile, where ``labels`` and ``groundtruth`` are.
        out_csv: errors of the labels against the true poses, and what a frame took.
        out_tex: the rows of both splits together, as a table environment.

    Raises:
        InputError: labels, a record of assistance, or the facts of a batch cannot be read.
    """
    records = [
        record
        for names in estimated_sets(rows)
        for split in (*SPLITS, TOTAL)
        for record in label_records(root, *names, split)
    ]
    write_rows(out_csv, COLUMNS, records)
    write_latex(out_tex, label_error_grid([r for r in records if r["split"] == TOTAL]))


def label_records(
    root: Path, method: str, scene: str, size: str, split: str
) -> list[dict[str, Value]]:
    """Both rows of a label set and a split, or of both splits together."""
    splits = SPLITS if split == TOTAL else (split,)
    filled = sum(
        int(batch["filled"])
        for s in splits
        for batch in batch_records(root, method, scene, size, s)
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
        record: dict[str, Value] = {"scene": scene, "size": size, "method": method}
        record |= {"split": split, "assistance": state, "frames": frames}
        record |= error_record(pairs) | {"share_filled": filled / frames}
        records.append(record | cost_record(root, method, scene, size, splits, frames))
    return records


def error_record(pairs: Sequence[Pair]) -> dict[str, Value]:
    """Errors of the labels of some splits against their true poses, by column."""
    every = [absolute_errors(*pair) for pair in pairs]
    errors: PoseErrors = (
        np.concatenate([position_m for position_m, _ in every]),
        np.concatenate([orientation_deg for _, orientation_deg in every]),
    )
    record: dict[str, Value] = {}
    for measure, values in zip(("position_m", "orientation_deg"), errors, strict=True):
        found = spread(values)
        record[f"{measure}_median"] = found.median
        record[f"{measure}_rmse"] = found.rmse
        record[f"{measure}_max"] = found.max
    for n in RELATIVE_FRAMES:
        record |= _relative_record(n, relative_error(pairs, n))
    return record | {"share_within_5cm_5deg": share_within(errors, WITHIN_M, WITHIN_DEG)}


def cost_record(
    root: Path, method: str, scene: str, size: str, splits: Sequence[str], frames: int
) -> dict[str, Value]:
    """Processor seconds per frame and the largest memory, over all stages and batches."""
    seconds, peaks = 0.0, [0.0]
    for stage in stages_of(method):
        for split in splits:
            folder = root / "groundtruth" / scene / size / stage / split
            for batch, _ in enumerate(batch_records(root, method, scene, size, split)):
                facts = _read_facts(folder / f"batch-{batch:03d}.json")
                unused = METHODS[method].unused
                seconds += sum(v for k, v in facts.items() if k.endswith("_s") and k not in unused)
                peaks.append(facts["peak_memory_mb"])
    return {"seconds_per_frame": seconds / frames, "peak_memory_mb": max(peaks)}


def label_error_grid(records: Sequence[Mapping[str, Value]]) -> Grid:
    """The rows of both splits together, as printed: a line before and a line after assistance."""
    headings = ("Median", "RMSE", "Maximum", "Drift over 25 frames", "Within 5 cm, 5°", "Filled")
    return Grid(
        NAME,
        "Errors of re-estimated labels against the true poses, before and after assistance.",
        ("Labels from", "Assistance", *headings, "s per frame", "Memory"),
        tuple(
            Group(title, tuple(_lines([r for r in records if _data_set(r) == title])))
            for title in dict.fromkeys(_data_set(record) for record in records)
        ),
        (
            "Positions and orientations without alignment: the first pose is the true one. Drift: "
            "errors of the motion over 25 frames, by the metre travelled.",
        ),
    )


def _relative_record(n: int, error: RelativeError | None) -> dict[str, Value]:
    if error is None:
        return {}
    values = (error.rmse_m, error.rmse_deg, error.per_metre_m, error.per_metre_deg)
    names = ("m_rmse", "deg_rmse", "m_per_m", "deg_per_m")
    return {
        f"relative_{n}_{name}": value if np.isfinite(value) else None
        for name, value in zip(names, values, strict=True)
    }


def _read_facts(path: Path) -> dict[str, float]:
    """What a batch took: seconds under keys that end in ``_s``, and ``peak_memory_mb``."""
    try:
        facts: dict[str, float] = _FACTS.validate_python(read_json(path), strict=True)
        facts["peak_memory_mb"]
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            f"{path}: cannot be read ({why(error)}); estimate that batch again"
        ) from None
    return facts


def _data_set(record: Mapping[str, Value]) -> str:
    return f"{scene_title(str(record['scene']))}, {record['size']}"


def _lines(records: Sequence[Mapping[str, Value]]) -> list[tuple[Line, ...]]:
    """The two lines of each method of a data set."""
    methods = dict.fromkeys(record["method"] for record in records)
    return [tuple(_line(r) for r in records if r["method"] == method) for method in methods]


def _line(record: Mapping[str, Value]) -> Line:
    def number(column: str) -> float:
        value = record.get(column)
        return float("nan") if value is None else float(value)

    def pair(*columns: str, units: tuple[str, str] = (" m", "°")) -> str:
        return ", ".join(
            f"{number(c):.3g}{unit}" for c, unit in zip(columns, units, strict=True)
        ).replace("nan", "–")

    cells = (
        *(pair(f"position_m_{w}", f"orientation_deg_{w}") for w in ("median", "rmse", "max")),
        pair("relative_25_m_per_m", "relative_25_deg_per_m", units=(" m/m", "°/m")),
        f"{100 * number('share_within_5cm_5deg'):.0f} %",
        f"{100 * number('share_filled'):.1f} %",
        f"{number('seconds_per_frame'):.3g}",
        f"{number('peak_memory_mb'):.0f} MB",
    )
    title = SOURCES[str(record["method"])] if record["assistance"] == "before" else ""
    return Line(
        "labels", title, str(record["assistance"]), tuple(Entry((Printed(c),)) for c in cells)
    )
