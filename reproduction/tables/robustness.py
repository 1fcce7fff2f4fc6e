"""The robustness table: effects down, methods across, a block for each training set."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Literal

import pandas as pd

from baselines.config.learning import MODELS
from baselines.references.registry import REFERENCES
from baselines.references.robustness import SCHEMA, STRUCTURE, robustness_table
from reproduction.config.robustness import MIXED
from reproduction.tables.columns import Column, SideLayout, by_method, method_columns
from reproduction.tables.layouts import TITLES
from reproduction.tables.side import SideTable, Source, Table
from synfeal.config.effects import CLEAN
from synfeal.records.tables import read_frame, write_frame

NAME = "robustness"
BLOCKS = {CLEAN: "Trained on ideal frames", MIXED: "Trained on frames with effects mixed in"}
METHODS = {name: reference.title for name, reference in REFERENCES.items()} | TITLES
UNITS = {"position_m": (" m", 2), "orientation_deg": ("°", 1)}  # and digits after the point
CAPTION = (
    "The same test paths rendered with effects of a camera and of changing light (config, "
    "robustness): median errors against the true poses."
)


def write_robustness_scores(
    clean: Sequence[Path],
    mixed: Sequence[Path],
    descriptors: Sequence[Path],
    structure: Sequence[Path],
    test: Path,
    varied: Sequence[Path],
    labels: Sequence[Path],
    effects: Sequence[str],
    device: Literal["auto", "cpu", "cuda"],
    out_csv: Path,
) -> None:
    """Measure how well methods stand effects, and write it.

    Args:
        clean: Checkpoints of all localizers trained on ideal frames.
        mixed: Checkpoints of all localizers trained with effects mixed in.
        descriptors: Descriptors of the frames of both training sets.
        structure: Structure-based answers for ideal frames and each of ``effects``; none where
            frames have no depth.
        test: Packed ideal test frames.
        varied: Packed test frames with each of ``effects``.
        labels: Label files, in one folder.
        effects: Names of the effects.
        device: Device of prediction.
        out_csv: CSV to write, columns ``SCHEMA``: the rows of the table.
    """
    models = {
        name: dict(zip(MODELS, m, strict=True)) for name, m in ((CLEAN, clean), (MIXED, mixed))
    }
    tests = dict(zip((CLEAN, *effects), (test, *varied), strict=True))
    answers = dict(zip(tests, structure, strict=bool(structure)))
    vectors = dict(zip(models, descriptors, strict=True))
    write_frame(
        out_csv, robustness_table(models, vectors, answers, tests, labels[0].parent, device)
    )


def read_robustness(path: Path) -> pd.DataFrame:
    """Read the table, or what it is made from, which :func:`write_robustness_scores` wrote."""
    return read_frame(path, SCHEMA)


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a row for each training set and each of the effects, a column per method."""
    texts = [
        table[measure].map(partial(printed, digits=digits)) + unit
        for measure, (unit, digits) in UNITS.items()
    ]
    cells = table.assign(
        trained_on=table.trained_on.map(BLOCKS),
        effects=table.effects.map(effects_title),
        number=table.position_m,
        text=texts[0].str.cat(texts[1], ", ").where(table.position_m.notna(), "failed"),
    )
    columns = [
        Column("Training frames", "trained_on"),
        Column("Test frames", "effects"),
        *method_columns({name: METHODS[name] for name in table.method.unique()}),
    ]
    rows = by_method(cells, ["trained_on", "effects"])
    return SideLayout(NAME, CAPTION, columns, rows, remark_on(table), block="trained_on")


def printed(value: float, digits: int) -> str:
    """Format a number with so many digits after the point, a small one with two significant."""
    return f"{value:.{digits}f}" if value >= 10.0 ** (1 - digits) else f"{value:.2g}"


def remark_on(table: pd.DataFrame) -> str:
    """Say on how many test frames structure is tested, and on which map."""
    counts = table.groupby(table.method == STRUCTURE).n_test.max()
    if True not in counts:
        return ""
    return (
        f"{METHODS[STRUCTURE]}: {counts[True]:,} of the {counts[False]:,} test frames, spread "
        "evenly and as large as its features need; its map is of ideal frames."
    )


def effects_title(effects: str) -> str:
    """Title effects as in ``motion blur, strength 2``; frames without effects are ideal."""
    if effects == CLEAN:
        return "ideal"
    name, _, strength = effects.rpartition("_")
    return f"{name.replace('_', ' ')}, strength {strength}" if strength.isdigit() else effects


@SideTable(
    name="robustness",
    title="Robustness",
    rank=40,
    needs=("robustness/{tested_scene}.csv",),
    in_document=True,
    in_summary=True,
)
class RobustnessTable(Table):
    """The same test paths with effects of a camera and of changing light."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Read what the rule ``robustness`` measured."""
        return read_robustness(next((source.root / "robustness").glob("*.csv")))
