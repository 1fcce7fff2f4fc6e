"""Tables 2 to 5 as files: tidy CSV, one row per cell, and LaTeX in the paper's layout."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from synfeal.config import Design
from synfeal.config.experiments import FROM_SCRATCH
from synfeal.config.tables import KEYS
from synfeal.frames import write_frame
from synfeal.report.cells import Cell, read_cells
from synfeal.report.latex import write_latex
from synfeal.report.layouts import grid_of
from synfeal.report.stats import BASELINES, FLOORS, MEASURES

LIMITS = tuple(f"{measure}_{end}" for measure in MEASURES for end in ("low", "high"))
CHANGES = {
    "position_m": "position_change_percent",
    "orientation_deg": "orientation_change_percent",
    "position_m_true": "position_true_change_percent",
    "orientation_deg_true": "orientation_true_change_percent",
}
Value = str | int | float | None


def write_table(
    name: str,
    design: Design,
    root: Path,
    out_csv: Path,
    out_tex: Path,
) -> None:
    """Write one of tables 2 to 5 from the scores of its runs.

    Args:
        name: the table, e.g. ``table4_size``.
        design: of the profile, the rows of this table among others.
        root: results directory of the profile, where ``runs`` is.
        out_csv: one row per cell.
        out_tex: a table environment; the packages it needs are named in its first lines.

    Raises:
        InputError: a run's scores are missing or unreadable.
    """
    cells = read_cells(name, design, root)
    records = [record_of(name, cell) for cell in cells]
    repeated = any(cell.own.n_seeds > 1 for cell in cells)
    write_rows(out_csv, columns_of(name, repeated), records)
    write_latex(out_tex, grid_of(name, cells))


def columns_of(name: str, repeated: bool = False) -> list[str]:
    """Columns of a table's CSV, in order; ``*_sd`` where a cell has several seeds."""
    deviations = [f"{measure}_sd" for measure in MEASURES] if repeated else []
    change = [*CHANGES.values()] if name == FROM_SCRATCH else []
    published = ["published_position_m", "published_orientation_deg"]
    if name == FROM_SCRATCH:
        published += [f"published_{CHANGES[m]}" for m in ("position_m", "orientation_deg")]
    return [
        *(*KEYS[name], "model", *MEASURES, "position_rms_m", *LIMITS, *deviations, *change),
        *(*BASELINES, *FLOORS),
        *("n_train", "n_test", "n_seeds", "failed", *published, "published_flag"),
    ]


def record_of(name: str, cell: Cell) -> dict[str, Value]:
    """One CSV row: everything known about a cell, by column name."""
    record: dict[str, Value] = {key: getattr(cell.row, key) for key in KEYS[name]}
    record["model"] = cell.model
    for measure, score in cell.own.scores.items():
        record[measure] = score.value
        record[f"{measure}_low"] = score.low
        record[f"{measure}_high"] = score.high
        record[f"{measure}_sd"] = score.sd
    for count in ("position_rms_m", "n_train", "n_test", "n_seeds", "failed"):
        record[count] = getattr(cell.own, count)
    record.update(cell.own.references)
    record.update({CHANGES[m]: value for m, value in cell.change_percent.items()})
    return record | _published_record(cell)


def _published_record(cell: Cell) -> dict[str, Value]:
    if cell.published is None:
        return {}
    measures = ("position_m", "orientation_deg", *list(CHANGES.values())[:2])
    values: dict[str, Value] = {f"published_{m}": getattr(cell.published, m) for m in measures}
    return values | {"published_flag": cell.published.flag}


def write_rows(path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, Value]]) -> None:
    """Write a CSV of some columns: floats with six significant digits, None as an empty cell."""
    texts = [[_text(row.get(column)) for column in columns] for row in rows]
    write_frame(path, pd.DataFrame(texts, columns=list(columns)))


def _text(value: Value) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
