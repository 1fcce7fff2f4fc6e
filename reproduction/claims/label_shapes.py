"""``shape_changes.csv``: what label errors of one size do, by their shape.

Table 6 has medians with limits, but not the errors of single frames, so that limits of changes
between its rows would be computed as if they had been tested on different frames. This table
compares them on the same frames of the common test set, as claims are compared, against the true
poses.
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import pandas as pd

from baselines.config.learning import MODELS
from reproduction.claims.evidence import COMMON, QUANTITIES, Cell, Evidence, evidence_of
from reproduction.design.experiments import Design, Experiment
from reproduction.design.shapes import SHAPES, shape_rows
from reproduction.statistics.seeds import limits
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.side import SideTable, Source, Table
from synfeal.evaluation.bootstrap import Array, difference, mean_of, relative_change
from synfeal.records.tables import LIMITLESS_MAYBE, TEXT, frame_of

NAME = "shape_changes"
ENDS = ("percent", "percent_low", "percent_high")
SCHEMA = {**dict.fromkeys(("change", "error"), TEXT), **dict.fromkeys(ENDS, LIMITLESS_MAYBE)}
CAPTION = (
    "What label errors change, by their shape: the largest ones of Table 6 that are there in all"
    " shapes, against exact labels and against each other, means over the localizers with 95 %"
    " limits; not in the paper."
)
REMARK = (
    "Errors are against the true poses and compared frame by frame, on the test frames that all"
    " sizes share. Changes are in percent of the errors with exact labels; differences of two"
    " changes are in percentage points."
)
COLUMNS = (
    Column("Label errors", "title"),
    *(Column(f"{error.capitalize()} error", error, text=f"{error}_text") for error in QUANTITIES),
)


def shape_changes_table(design: Design, root: Path) -> pd.DataFrame:
    """Compute the changes, columns :data:`SCHEMA`.

    Raises:
        ValueError: The design lacks the rows.
    """
    compared = shape_rows(design.rows)
    if compared is None:
        raise ValueError("the design has no label errors of one size in all shapes")
    evidence = evidence_of(design, root).under(COMMON)
    found = {
        shape: change_of(evidence, row, compared.exact) for shape, row in compared.by_shape.items()
    }
    found = {shape: found[shape] for shape in SHAPES}
    records = [record for shape in found for record in _records(evidence, shape, found[shape])]
    for less, more in combinations(found, 2):
        gap = difference(found[more], found[less])
        records += _records(evidence, f"{more} more than {less}", gap)
    return frame_of(records, SCHEMA)


def change_of(evidence: Evidence, wrong: Experiment, exact: Experiment) -> Array:
    """Sample the changes (2, B) of both errors in percent, means over the localizers."""
    new, old = (
        [Cell(model, row.scene, row.size, row.label_id) for model in MODELS]
        for row in (wrong, exact)
    )
    return mean_of(list(relative_change(evidence.errors(*new), evidence.errors(*old))))


def _records(evidence: Evidence, name: str, change: Array) -> list[dict[str, Any]]:
    """Describe a change by a row for either error."""
    records = []
    for quantity, sample in zip(QUANTITIES, change, strict=True):
        numbers = (float(sample[0]), *limits(sample, evidence.layout))
        records.append({"change": name, "error": quantity, **dict(zip(ENDS, numbers, strict=True))})
    return records


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a row per shape and per pair of shapes, a column per error."""
    texts = table.assign(
        text=[
            f"{value:+.0f} %" + ("" if pd.isna(low) else f" ({low:+.0f} to {high:+.0f})")
            for value, low, high in table[[*ENDS]].itertuples(index=False)
        ]
    )
    wide = texts.pivot(index="change", columns="error", values=["percent", "text"])
    names = table.change.drop_duplicates()
    lines = pd.DataFrame({"title": names.map(lambda name: _title(str(name))).to_list()})
    for error in QUANTITIES:
        lines[error] = wide["percent", error].loc[names].astype(float).to_list()
        lines[f"{error}_text"] = wide["text", error].loc[names].str.replace("-", "−").to_list()
    return SideLayout(NAME, CAPTION, COLUMNS, lines, REMARK)


def _title(change: str) -> str:
    """Say which label errors a row is of."""
    return f"{change}: {SHAPES[change]}" if change in SHAPES else change


@SideTable(
    name="shape_changes",
    title="Shape changes",
    rank=80,
    needs=("runs/{shape_run}/common_errors.csv", "labels/{true_set}/{split}.csv"),
    in_document=True,
)
class ShapeChangesTable(Table):
    """Two rows for each shape of label errors, and two for each pair of shapes."""

    schema = SCHEMA
    float_format = "%.4g"
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Compare equally large label errors of different shapes."""
        return shape_changes_table(source.design, source.root)
