"""What the paper published, one row per table cell, keyed by the design that produces the cell.

The files in ``published/`` carry the columns of the experiments table, so that a cell is joined to
its published value only when scene, size, labels, noise and initialisation all agree. Values stand
as printed. ``flag`` marks what cannot be taken at face value: ``misprint`` (the orientation is
impossible and is left out of comparisons) and ``suspect`` (probably a copy of its neighbour).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import pandas as pd

from synfeal.config import Experiment
from synfeal.frames import COUNT, EXTRA, NUMBER, TEXT, frame_of, read_frame, records_of

FOLDER = Path(__file__).parent / "published"
Key = tuple[str, str, str, str, float, float, str, str]
KEY = ("block", "scene", "size", "labels", "noise_m", "noise_deg", "init", "model")
SCHEMA = {
    **dict.fromkeys(KEY, TEXT) | dict.fromkeys(("noise_m", "noise_deg"), NUMBER),
    **dict.fromkeys(("n_train", "n_test"), COUNT),
    **dict.fromkeys(("position_m", "orientation_deg"), NUMBER),
    **dict.fromkeys(("position_change_percent", "orientation_change_percent"), EXTRA),
    **dict.fromkeys(("flag", "printed_row", "row_note", "cell_note"), TEXT),
}
MESHES = {"scene": TEXT, "vertices": COUNT, "faces": COUNT, "volume_m3": NUMBER}


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
    names = [field.name for field in fields(PublishedCell)]
    return {
        tuple(row[key] for key in KEY): PublishedCell(**{name: row[name] for name in names})
        for row in records_of(published_frame(table))
    }


@cache
def published_frame(table: str) -> pd.DataFrame:
    """Columns ``SCHEMA`` of one of the tables 2 to 5; no rows of one that the paper has not."""
    path = FOLDER / f"{table}.csv"
    return read_frame(path, SCHEMA) if path.is_file() else frame_of((), SCHEMA)


@cache
def published_meshes() -> dict[str, MeshFacts]:
    """Table 1 by scene."""
    frame = read_frame(FOLDER / "table1_meshes.csv", MESHES)
    return {row.pop("scene"): MeshFacts(**row) for row in records_of(frame)}
