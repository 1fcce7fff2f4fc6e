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
from reproduction.tables.columns import Column, SideTable, by_method, method_columns, write_side
from reproduction.tables.layouts import TITLES
from synfeal.config.effects import CLEAN, MIXED
from synfeal.records.tables import read_frame, write_frame

NAME = "robustness"
BLOCKS = {CLEAN: "Trained on ideal frames", MIXED: "Trained on frames with effects mixed in"}
METHODS = {name: reference.title for name, reference in REFERENCES.items()} | TITLES
UNITS = {"position_m": (" m", 2), "orientation_deg": ("°", 1)}  # and digits after the point
CAPTION = (
    "The same test paths rendered with effects of a camera and of changing light (config, "
    "robustness): median errors against the true poses."
)


def write_robustness_table(
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
    out_tex: Path,
) -> None:
    """Measure the robustness table and write it.

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
        out_csv: Table to write.
        out_tex: LaTeX to write.
    """
    models = {
        name: dict(zip(MODELS, m, strict=True)) for name, m in ((CLEAN, clean), (MIXED, mixed))
    }
    tests = dict(zip((CLEAN, *effects), (test, *varied), strict=True))
    answers = dict(zip(tests, structure, strict=bool(structure)))
    vectors = dict(zip(models, descriptors, strict=True))
    table = robustness_table(models, vectors, answers, tests, labels[0].parent, device)
    write_frame(out_csv, table)
    write_side(out_tex, side_table(table))


def read_robustness(path: Path) -> pd.DataFrame:
    """Read the table that :func:`write_robustness_table` wrote."""
    return read_frame(path, SCHEMA)


def side_table(table: pd.DataFrame) -> SideTable:
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
    return SideTable(NAME, CAPTION, columns, rows, remark_on(table), block="trained_on")


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
