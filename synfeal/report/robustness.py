"""The robustness table as it is printed: effects down, methods across, a block a training set."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Literal

import pandas as pd

from baselines.references.registry import REFERENCES
from baselines.references.robustness import SCHEMA, STRUCTURE, robustness_table
from synfeal.config.effects import CLEAN, MIXED
from synfeal.config.models import MODELS
from synfeal.frames import read_frame, write_frame
from synfeal.report.layouts import TITLES
from synfeal.report.sheet import LINE, VALUE, Sheet, with_bold, write_latex

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
    """Measure and write the table.

    Args:
        clean: checkpoints of all localizers, trained on ideal frames.
        mixed: the same, trained on frames with effects mixed in.
        descriptors: of the frames of both training sets.
        structure: answers of structure-based poses for the ideal frames and each of ``effects``;
            none where there are no frames with depth.
        test: packed test frames.
        varied: the same with each of ``effects``.
        labels: true poses of both splits, in one folder.
        effects: names of what the test frames are varied by.
        device: where to predict.
        out_csv: the table.
        out_tex: its LaTeX.
    """
    models = {
        name: dict(zip(MODELS, m, strict=True)) for name, m in ((CLEAN, clean), (MIXED, mixed))
    }
    tests = dict(zip((CLEAN, *effects), (test, *varied), strict=True))
    answers = dict(zip(tests, structure, strict=bool(structure)))
    vectors = dict(zip(models, descriptors, strict=True))
    table = robustness_table(models, vectors, answers, tests, labels[0].parent, device)
    write_robustness(table, out_csv, out_tex)


def write_robustness(table: pd.DataFrame, out_csv: Path, out_tex: Path) -> None:
    """Write what :func:`baselines.references.robustness.robustness_table` found, and its LaTeX."""
    write_frame(out_csv, table)
    write_latex(out_tex, robustness_sheet(table))


def read_robustness(path: Path) -> pd.DataFrame:
    """The table that :func:`write_robustness` wrote."""
    return read_frame(path, SCHEMA)


def robustness_sheet(table: pd.DataFrame) -> Sheet:
    """A row for each of the effects; the lowest error of each method and block is bold."""
    titles = {name: METHODS[name] for name in table.method.unique()}
    rows = table[["trained_on", "effects"]].drop_duplicates()
    blocks = rows.groupby("trained_on", sort=False).ngroup()
    rows = rows.iloc[blocks.argsort(kind="stable")].reset_index(drop=True)
    cells = table.merge(rows.rename_axis(index="line").reset_index())
    failed = cells[list(UNITS)].isna().any(axis=1)
    parts = [
        pd.DataFrame(
            {
                "line": cells.line,
                "column": cells.method.map(titles),
                "place": place,
                "text": cells[measure]
                .map(partial(printed, digits=digits))
                .add(unit)
                .where(~failed, "failed" if not place else ""),
                "number": cells[measure]
                .map(lambda v, n=digits: float(printed(v, n)))
                .where(~failed),
                **{"tone": "", "note": "", "block": cells.trained_on},
            }
        )[~(failed & (place > 0))]
        for place, (measure, (unit, digits)) in enumerate(UNITS.items())
    ]
    values = pd.concat(parts, ignore_index=True)
    lines = pd.DataFrame(
        {
            "block": rows.trained_on.map(BLOCKS),
            "row": rows.index,
            **{"kind": "truth", "label_note": "", "against": "true poses"},
            "label": rows.effects.map(effects_title),
        }
    )
    return Sheet(
        NAME,
        CAPTION,
        ("Test frames", "Against", *titles.values()),
        lines[list(LINE)],
        with_bold(values, [values[key] for key in ("block", "column", "place")])[list(VALUE)],
        remarks(table),
    )


def printed(value: float, digits: int) -> str:
    """A number with so many digits after the point; small ones with two that count."""
    return f"{value:.{digits}f}" if value >= 10.0 ** (1 - digits) else f"{value:.2g}"


def remarks(table: pd.DataFrame) -> tuple[str, ...]:
    """How many of the test frames structure-based poses are tested on, and on which map."""
    counts = table.groupby(table.method == STRUCTURE).n_test.max()
    if True not in counts:
        return ()
    return (
        f"{METHODS[STRUCTURE]}: {counts[True]:,} of the {counts[False]:,} test frames, spread "
        "evenly and as large as its features need; its map is of ideal frames.",
    )


def effects_title(effects: str) -> str:
    """As in ``motion blur, strength 2``; frames without effects are ideal."""
    if effects == CLEAN:
        return "ideal"
    name, _, strength = effects.rpartition("_")
    return f"{name.replace('_', ' ')}, strength {strength}" if strength.isdigit() else effects
