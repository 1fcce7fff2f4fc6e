"""Cells of tables 2 to 7: scores of the runs beside the paper's values.

The files in ``published/`` carry the columns of the experiments table, so that a cell is joined to
its published value only when scene, size, labels, noise and initialisation all agree. Values stand
as printed. ``flag`` marks what cannot be taken at face value: ``misprint`` (the orientation is
impossible and is left out of comparisons) and ``suspect`` (probably a copy of its neighbour).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from baselines.config.learning import MODELS
from reproduction.config.tables import KEYS
from reproduction.design.experiments import FROM_SCRATCH, Design, Experiment
from reproduction.statistics.limits import (
    BASELINES,
    FLOORS,
    MEASURES,
    combine,
    percent_change,
    read_metrics,
)
from reproduction.tables import yardstick
from synfeal.records.tables import (
    COUNT,
    EXTRA,
    EXTRA_TEXT,
    MAYBE,
    NUMBER,
    TEXT,
    Schema,
    frame_of,
    read_frame,
)

FOLDER = Path(__file__).parent / "published"
Key = tuple[str, str, str, str, float, float, str, str]
KEY = ("block", "scene", "size", "labels", "noise_m", "noise_deg", "init", "model")
# Errors are medians (metres, degrees), changes against transfer learning; rows that are run under
# another label than the printed one have both, and what is wrong in print has a note.
SCHEMA = {
    **dict.fromkeys(KEY, TEXT) | dict.fromkeys(("noise_m", "noise_deg"), NUMBER),
    **dict.fromkeys(("n_train", "n_test"), COUNT),
    **dict.fromkeys(("position_m", "orientation_deg"), NUMBER),
    **dict.fromkeys(("position_change_percent", "orientation_change_percent"), EXTRA),
    **dict.fromkeys(("flag", "printed_row", "row_note", "cell_note"), TEXT),
}


def key_of(row: Experiment, model: str) -> Key:
    """Return what must agree for a published value to be the counterpart of a cell."""
    noise = (row.noise_m, row.noise_deg)
    return (row.block, row.scene, row.size, row.labels, *noise, row.init, model)


@cache
def published_cells(table: str) -> dict[Key, Any]:
    """Read the cells of one of tables 2 to 5, by what they are run with."""
    cells = published_frame(table)
    keys = cells[list(KEY)].itertuples(index=False, name=None)
    return dict(zip(keys, cells.itertuples(index=False), strict=True))


@cache
def published_frame(table: str) -> pd.DataFrame:
    """Read columns ``SCHEMA`` of one of tables 2 to 5; no rows of one that the paper lacks."""
    path = FOLDER / f"{table}.csv"
    return read_frame(path, SCHEMA) if path.is_file() else frame_of((), SCHEMA)


LIMITS = tuple(f"{measure}_{end}" for measure in MEASURES for end in ("low", "high"))
DEVIATIONS = tuple(f"{measure}_sd" for measure in MEASURES)
# Of Table 5: by measure, the change against the run with transfer learning.
CHANGES = {
    "position_m": "position_change_percent",
    "orientation_deg": "orientation_change_percent",
    "position_m_true": "position_true_change_percent",
    "orientation_deg_true": "orientation_true_change_percent",
}
COUNTS = ("n_train", "n_test", "n_seeds", "failed")
SCORES = {
    **dict.fromkeys((*MEASURES, "position_rms_m", *LIMITS, *DEVIATIONS), MAYBE),
    **dict.fromkeys((*CHANGES.values(), *BASELINES, *FLOORS), MAYBE),
    **dict.fromkeys(COUNTS, COUNT),
    "limits_of": EXTRA_TEXT,  # files of earlier versions lack it
}
# Distance that label errors truly moved positions by; of the tables whose rows name a size of them.
MOVED = "moved_m"
CELL = {
    "row": COUNT,
    **{key: SCHEMA[key] for key in KEY},
    "label_id": TEXT,
    **SCORES,
    "n_finished": COUNT,
    **dict.fromkeys((MOVED, *yardstick.COLUMNS), EXTRA),
}
PUBLISHED = {name: f"published_{name}" for name in SCHEMA if name not in KEY}


def read_cells(table: str, design: Design, root: Path) -> pd.DataFrame:
    """Read the cells of one of tables 2 to 7, row by row, five localizers each.

    Args:
        table: Name of the table.
        design: The profile's table of experiments.
        root: Results of the profile.

    Returns:
        Columns ``CELL`` (``row`` counts the rows of the table, ``n_finished`` the runs that have a
        score, ``failed`` the predictions that were not finite) and ``PUBLISHED``, of which the text
        is empty and the rest missing where the paper has no such cell.
    """
    records = [
        {"row": place, "model": model, "label_id": row.label_id}
        | row.model_dump()
        | {MOVED: design.moved_m(row)}
        | _scores(row, model, design, root)
        for place, row in enumerate(design.rows_of(table))
        for model in MODELS
    ]
    published = published_frame(table).rename(columns=PUBLISHED)
    cells = frame_of(records, CELL).merge(published, how="left", on=list(KEY), validate="m:1")
    texts = {name: "" for own, name in PUBLISHED.items() if SCHEMA[own] is TEXT}
    return cells.fillna(texts)


def schema_of(table: str, repeated: bool = False) -> Schema:
    """Return the columns of a table's CSV, in order; ``*_sd`` where a cell has several seeds."""
    left_out = {
        *(() if repeated else DEVIATIONS),
        *(() if table == FROM_SCRATCH else CHANGES.values()),
    }
    published = ["position_m", "orientation_deg"]
    published += list(CHANGES.values())[:2] if table == FROM_SCRATCH else []
    return {
        **{key: NUMBER if key in ("noise_m", "noise_deg") else TEXT for key in KEYS[table]},
        "model": TEXT,
        **{name: kind for name, kind in SCORES.items() if name not in left_out},
        **dict.fromkeys((PUBLISHED[name] for name in published), MAYBE),
        "published_flag": TEXT,
    } | (
        (dict.fromkeys(DEVIATIONS, EXTRA) if repeated else {})
        | ({MOVED: EXTRA} if "noise_m" in KEYS[table] else {})
        | (dict.fromkeys(yardstick.COLUMNS, EXTRA) if table == yardstick.TABLE else {})
    )


def _scores(row: Experiment, model: str, design: Design, root: Path) -> dict[str, Any]:
    record = _combined(row, model, design, root)
    if row.table == yardstick.TABLE:
        return record | yardstick.yardstick_alone(row, model, design, root)
    if row.table != FROM_SCRATCH:
        return record
    pretrained = _combined(row.pretrained, model, design, root)
    return record | {
        change: percent_change(record[measure], pretrained[measure])
        for measure, change in CHANGES.items()
    }


def _combined(row: Experiment, model: str, design: Design, root: Path) -> dict[str, Any]:
    runs = [root / "runs" / run.directory / "metrics.json" for run in design.runs_of(row, model)]
    return combine([read_metrics(path) for path in runs])
