"""What the paper published, one row per table cell, keyed by the design that produces the cell.

The files in ``published/`` carry the columns of the experiments table, so that a cell is joined to
its published value only when scene, size, labels, noise and initialisation all agree. Values stand
as printed. ``flag`` marks what cannot be taken at face value: ``misprint`` (the orientation is
impossible and is left out of comparisons) and ``suspect`` (probably a copy of its neighbour).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from synfeal.config import Experiment
from synfeal.frames import COUNT, EXTRA, NUMBER, TEXT, frame_of, read_frame, records_of

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
MESHES = {"scene": TEXT, "vertices": COUNT, "faces": COUNT, "volume_m3": NUMBER}


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
def published_cells(table: str) -> dict[Key, Any]:
    """Cells of one of the tables 2 to 5 by what they are run with, attributes as in ``SCHEMA``."""
    cells = published_frame(table)
    keys = cells[list(KEY)].itertuples(index=False, name=None)
    return dict(zip(keys, cells.itertuples(index=False), strict=True))


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
