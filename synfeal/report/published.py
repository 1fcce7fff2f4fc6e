"""What the paper published, one row per table cell, keyed by the design that produces the cell.

The files in ``published/`` carry the columns of the experiments table, so that a cell is joined to
its published value only when scene, size, labels, noise and initialisation all agree. Values stand
as printed. ``flag`` marks what cannot be taken at face value: ``misprint`` (the orientation is
impossible and is left out of comparisons) and ``suspect`` (probably a copy of its neighbour).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from synfeal.config import Experiment

FOLDER = Path(__file__).parent / "published"
Key = tuple[str, str, str, str, float, float, str, str]


@dataclass(frozen=True)
class PublishedCell:
    """One cell of a table of the paper.

    Attributes:
        n_train: training frames.
        n_test: test frames.
        position_m: median position error, metres.
        orientation_deg: median orientation error, degrees.
        position_change_percent: Table 5: printed change against transfer learning.
        orientation_change_percent: the same of the orientation error.
        flag: ``none``, ``misprint`` (of the orientation) or ``suspect``.
        printed_row: the row's label as printed where the row is run under another one, else empty.
        row_note: footnote of the row, if any.
        cell_note: footnote of the cell, if any.
    """

    n_train: int
    n_test: int
    position_m: float
    orientation_deg: float
    position_change_percent: float | None
    orientation_change_percent: float | None
    flag: str
    printed_row: str
    row_note: str
    cell_note: str


@dataclass(frozen=True)
class MeshFacts:
    """Properties of a scene's mesh: counts, and the volume of its bounding box in cubic metres."""

    vertices: int
    faces: int
    volume_m3: float


def key_of(row: Experiment, model: str) -> Key:
    """What has to agree for a published value to be the counterpart of a cell."""
    noise = (row.noise_m, row.noise_deg)
    return (row.block, row.scene, row.size, row.labels, *noise, row.init, model)


@cache
def published_cells(table: str) -> dict[Key, PublishedCell]:
    """All cells of one of the tables 2 to 5; none of one that the paper does not have."""
    rows = _read(table) if (FOLDER / f"{table}.csv").is_file() else []
    return {_key_in(row): _cell_in(row) for row in rows}


@cache
def published_meshes() -> dict[str, MeshFacts]:
    """Table 1 by scene."""
    return {
        row["scene"]: MeshFacts(int(row["vertices"]), int(row["faces"]), float(row["volume_m3"]))
        for row in _read("table1_meshes")
    }


def _read(table: str) -> list[dict[str, str]]:
    with (FOLDER / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _key_in(row: dict[str, str]) -> Key:
    noise = (float(row["noise_m"]), float(row["noise_deg"]))
    names = (row["block"], row["scene"], row["size"], row["labels"])
    return (*names, *noise, row["init"], row["model"])


def _cell_in(row: dict[str, str]) -> PublishedCell:
    return PublishedCell(
        n_train=int(row["n_train"]),
        n_test=int(row["n_test"]),
        position_m=float(row["position_m"]),
        orientation_deg=float(row["orientation_deg"]),
        position_change_percent=_optional(row.get("position_change_percent")),
        orientation_change_percent=_optional(row.get("orientation_change_percent")),
        flag=row["flag"],
        printed_row=row["printed_row"],
        row_note=row["row_note"],
        cell_note=row["cell_note"],
    )


def _optional(text: str | None) -> float | None:
    return float(text) if text else None
