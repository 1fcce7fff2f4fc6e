"""Table 8, which the paper lacks: localizers trained on a scan, tested on photographs."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.tables.columns import NOTHING, Column, SideLayout
from reproduction.tables.layouts import TITLES
from synfeal.records.tables import (
    COUNT,
    LIMITLESS,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    Kind,
    read_frame,
    rows_of,
)

NAME = "table8_real"
# Not every row has one, and older tables have none.
EXTRA = Kind("float64", optional=True, expected=False, finite=False)
MEASURES = ("position_m", "orientation_deg", "recall_5cm_5deg", "localized")
_ENDS = ("", "_low", "_high")
SCHEMA = {
    **dict.fromkeys(("scene", "direction", "labels", "trained_on", "method"), TEXT),
    "images": MAYBE_COUNT,
    **{f"{measure}{end}": LIMITLESS for measure in MEASURES for end in _ENDS},
    "position_m_worst": LIMITLESS,
    "orientation_deg_worst": LIMITLESS,
    **{f"{measure}{end}_sfm": EXTRA for measure in MEASURES for end in _ENDS},
    **{f"times_{name}{end}": EXTRA for name in ("position", "orientation") for end in _ENDS},
    **dict.fromkeys(("n_seeds", "n_test", "n_blocks", "n_fused"), COUNT),
    "correlation_frames": NUMBER,
}
_POSE = {f"{name}{end}": LIMITLESS for name in MEASURES[:2] for end in _ENDS}
AMOUNT = {"kind": TEXT, "trained_on": TEXT, "amount": COUNT, "n_seeds": COUNT, **_POSE}
RUNS = {
    **dict.fromkeys(("direction", "labels", "trained_on", "method"), TEXT),
    "seed": COUNT,
    **dict.fromkeys(MEASURES[:2], LIMITLESS),
}
COVER = {
    **dict.fromkeys(("direction", "trained_on"), TEXT),
    **dict.fromkeys(("share_low", "share_high", "share"), NUMBER),
    "n_test": COUNT,
    **dict.fromkeys(MEASURES[:2], LIMITLESS),
}

ROWS = {
    "photographs": "photographs of the scan",
    "rendered": "rendered",
    "randomised": "rendered, randomised",
    "both": "both together",
}
METHODS = TITLES | {
    "structure": "Structure",
    "structure-refined": "Structure, refined on the scan",
    "retrieval": "Most alike by thumbnail",
    "nearest": "Nearest pose (oracle)",
    "mean": "Mean pose",
}
DIRECTIONS = {
    "official": "The official split",
    "forward": "Scan of the first half, photographs of the second",
    "reverse": "Scan of the second half, photographs of the first",
    "alternate": "Scan of every other tenth, photographs of the others",
}
WITH_SFM = ", labels by SfM"
LOST = "half not localized"
CAPTION = (
    "From a scan to photographs that were not scanned: median errors of localizers trained on"
    " photographs of the scan, on frames rendered of it, or both."
)


def read_real(path: Path) -> pd.DataFrame:
    """Read the table that :func:`reproduction.real.tables.write_real_tables` wrote."""
    return read_frame(path, SCHEMA)


def block_title(direction: str, labels: str) -> str:
    """Title a block of the table by its direction and labels."""
    return DIRECTIONS[direction] + (WITH_SFM if labels == "sfm" else "")


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a line per training and localizer, a block per direction and source of labels."""
    rows = table.assign(
        block=[block_title(row.direction, row.labels) for row in rows_of(table)],
        trained_on=table.trained_on.map(ROWS),
        method=table.method.map(METHODS),
        position_text=table.position_m.map(partial(_median, form="{:.3f} m")),
        orientation_text=table.orientation_deg.map(partial(_median, form="{:.1f}°")),
        position_text_sfm=table.position_m_sfm.map(partial(_median, form="{:.3f} m")),
        orientation_text_sfm=table.orientation_deg_sfm.map(partial(_median, form="{:.1f}°")),
        position_limits=[_between(row, "position_m", "{:.3f}") for row in rows_of(table)],
        orientation_limits=[_between(row, "orientation_deg", "{:.1f}") for row in rows_of(table)],
        times_limits=[_between(row, "times_position", "{:.1f}") for row in rows_of(table)],
    )
    columns = [
        Column("Scan", "block"),
        Column("Learned from", "trained_on"),
        Column("Method", "method"),
        Column("Position", "position_m", text="position_text", small="position_limits"),
        Column(
            "Orientation", "orientation_deg", text="orientation_text", small="orientation_limits"
        ),
        Column("5 cm, 5°", "recall_5cm_5deg", "{:.0f} %", factor=100),
        Column("Localized", "localized", "{:.0f} %", factor=100),
        Column("As exact as photographs", "times_position", "{:.1f} ×", small="times_limits"),
        *_sfm_columns(table),
        Column("Seeds", "n_seeds", "{:.0f}"),
        Column("Worst seed", "position_m_worst", "{:.3f} m", on_paper=False),
        Column("Photographs", "n_test", "{:.0f}", on_paper=False),
    ]
    return SideLayout(NAME, CAPTION, columns, rows, remark_on(table), block="block")


def _sfm_columns(table: pd.DataFrame) -> list[Column]:
    if table.position_m_sfm.isna().all():
        return []
    return [
        Column("Position, against SfM", "position_m_sfm", text="position_text_sfm"),
        Column("Orientation, against SfM", "orientation_deg_sfm", text="orientation_text_sfm"),
    ]


def _between(row: Any, name: str, form: str) -> str:
    low, high = getattr(row, f"{name}_low"), getattr(row, f"{name}_high")
    return "" if pd.isna(low) or pd.isna(high) else f"{form.format(low)}–{form.format(high)}"


def _median(value: float, form: str) -> str:
    """Format a median error; infinite where fewer than half of the photographs were localized."""
    if math.isnan(value):
        return NOTHING
    return form.format(value) if math.isfinite(value) else LOST


def remark_on(table: pd.DataFrame) -> str:
    """Say what limits are over, and how many photographs there are."""
    first = table.iloc[0]
    length = first.n_test / first.n_blocks
    return (
        f"Errors are medians over {first.n_test:,} photographs of {first.scene}, means over seeds;"
        f" 95 % limits are over blocks of {length:.0f} neighbouring photographs and over seeds."
        " Where a photograph is not localized, its error is infinite."
    )
