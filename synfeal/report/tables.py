"""Tables 2 to 7 as files: tidy CSV, one row per cell, and LaTeX in the paper's layout."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from synfeal.config import Design
from synfeal.config.experiments import FROM_SCRATCH
from synfeal.frames import rows_of, write_frame
from synfeal.report.cells import CHANGES, read_cells, schema_of
from synfeal.report.layouts import (
    BLOCKS,
    CAPTIONS,
    CHANGE,
    HEADINGS,
    PUBLISHED,
    REFERENCES,
    REMARK,
    TITLES,
    UNITS,
    UNTRAINED,
    published_labels,
    row_label,
    scene_title,
)
from synfeal.report.sheet import PAPER, Line, Sheet, Value, write_latex

# Kinds of lines in their order, and what their numbers are measured against; after those of a
# score stands its change, in Table 5.
AGAINST = {
    "labels": "labels",
    "labels change": "change",
    "truth": "truth",
    "truth change": "change",
    "unit": "labels, paper's unit",
    PAPER: "paper",
    "paper change": "change, paper",
}
KIND_OF = {"labels": "", "truth": "_true"}
FAILED = "failed"


def write_table(table: str, design: Design, root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write one of tables 2 to 7 from the scores of its runs: a row per cell, and LaTeX."""
    cells = read_cells(table, design, root)
    write_frame(out_csv, cells[[*schema_of(table, repeated=bool((cells.n_seeds > 1).any()))]])
    write_latex(out_tex, sheet_of(table, cells))


def sheet_of(name: str, cells: pd.DataFrame) -> Sheet:
    """Lay out one of tables 2 to 7, from what :func:`synfeal.report.cells.read_cells` read."""
    one_truth = bool((cells.labels == "synfeal").all())
    against = AGAINST | ({"labels": "labels = truth"} if one_truth else {})
    references = [*REFERENCES.values()][: 1 if one_truth else 2]
    headings = (HEADINGS[name], "Error against", *TITLES.values(), *references)
    printed: dict[tuple[int, str, str], list[Value]] = defaultdict(list)
    values = printed_values(name, cells).sort_values("place", kind="stable")
    for v in rows_of(values[(values.text != FAILED) | (values.place == 0)]):  # said once
        sort = "" if pd.isna(v.sort) else v.sort
        value = Value(v.text, v.bold, v.tone, v.note, v.limits, sort)
        printed[v.row, v.kind, v.column].append(value)
    in_print = published_labels(name, cells)
    rows = cells.assign(title=blocks_of(cells)).drop_duplicates("row")
    blocks = rows.groupby("title", sort=False).ngroup()
    lines = []
    for row in rows_of(rows.iloc[blocks.argsort(kind="stable")]):
        # Where labels are the truth, both scores are one line.
        for kind in (k for k in against if not (one_truth and k.startswith("truth"))):
            label = Value("")
            if kind == "labels":
                label = Value(row_label(name, row), sort=_order(name, row))
            elif kind == PAPER:
                label = Value(in_print.get(row.row, ""), note=row.published_row_note)
            numbers = [printed[row.row, kind, heading] for heading in headings[2:]]
            if any(numbers):
                texts = [[label], [Value(against[kind])], *numbers]
                lines.append(Line(row.title, row.row, kind, texts))
    remarks = (REMARK, UNTRAINED, PUBLISHED, *([CHANGE] if name == FROM_SCRATCH else []))
    caption = f"{CAPTIONS[name]} {_where(cells)} Best scores in bold."
    return Sheet(name, caption, headings, lines, remarks)


def _order(name: str, row: Any) -> object:
    """What the page sorts a row by: its noise, label or number of frames."""
    if row.block:
        return f"{1000 * row.noise_m + row.noise_deg:g}"
    return row_label(name, row) if name == "table2_ground_truth" else row.n_train


def blocks_of(cells: pd.DataFrame) -> pd.Series:
    """Titles of the block of each cell: noise of Table 3, and the scene where there are several."""
    scenes = cells.scene.map(scene_title) if cells.scene.nunique() > 1 else ""
    return (cells.block.map(BLOCKS) + " " + scenes).str.strip()


def printed_values(name: str, cells: pd.DataFrame) -> pd.DataFrame:
    """Every number of a table as it is printed, in both scores.

    Returns:
        Columns ``row`` (as in the cells), ``kind`` (of ``AGAINST``), ``column`` (a heading),
        ``place`` (0 position, 1 orientation), and those of a :class:`Value`; ``bold`` is the
        lowest of its kind, column and block, as printed.
    """
    parts, first = [], cells.groupby("row", sort=False).head(1)
    for place, (measure, unit) in enumerate(UNITS.items()):
        for kind, end in KIND_OF.items():
            score = f"{measure}{end}"
            parts.append(_scores(cells, kind, place, score, unit))
            for start, column in REFERENCES.items():  # the same for every localizer of a row
                if f"{start}_{score}" in first:
                    numbers = first[f"{start}_{score}"]
                    texts = [_plain(value, unit) for value in numbers]
                    parts.append(_part(first, kind, place, texts, column=column, sort=numbers))
            if name == FROM_SCRATCH:
                parts.append(_changes(cells, f"{kind} change", place, CHANGES[score]))
        parts.append(_published(cells, place, measure, unit))
        if name == FROM_SCRATCH:
            parts.append(_changes(cells, "paper change", place, f"published_{CHANGES[measure]}"))
    in_print = cells[cells.published_position_m.notna()]
    texts = [_plain(value, " m") for value in in_print.position_rms_m]
    parts.append(_part(in_print, "unit", 0, texts))
    values = pd.concat(parts, ignore_index=True)
    blocks = values.row.map(blocks_of(cells).groupby(cells.row).first())
    return _with_bold(values, [blocks, values.kind, values["column"], values.place])


def _with_bold(values: pd.DataFrame, keys: Sequence[pd.Series]) -> pd.DataFrame:
    """Values whose ``number`` becomes ``bold``: the lowest of those with the same ``keys``.

    Ties as printed are all bold; where fewer than two have a number there is nothing to compare.
    """
    numbers = values.number.groupby(list(keys))
    bold = (values.number == numbers.transform("min")) & (numbers.transform("count") > 1)
    return values.drop(columns="number").assign(bold=bold)


def _part(
    cells: pd.DataFrame, kind: str, place: int, texts: list[str], **more: Any
) -> pd.DataFrame:
    """Values of some cells; ``more``: columns of :func:`printed_values`, and ``number``."""
    usual = {"column": cells.model.map(TITLES), "number": np.nan, "sort": np.nan}
    usual |= dict.fromkeys(("tone", "note", "limits"), "")
    found = pd.DataFrame({"row": cells.row, "kind": kind, "place": place, "text": texts})
    return found.assign(**{**usual, **more})


def _scores(cells: pd.DataFrame, kind: str, place: int, score: str, unit: str) -> pd.DataFrame:
    texts = [
        FAILED if pd.isna(value) else f"{value:.2f}{'' if pd.isna(sd) else f' ± {sd:.2f}'}{unit}"
        for value, sd in zip(cells[score], cells[f"{score}_sd"], strict=True)
    ]
    notes = [
        f"{cell.failed} of {cell.n_test * cell.n_seeds} predictions failed, {cell.n_finished} of"
        f" {cell.n_seeds} runs have a score."
        if cell.failed
        else ""
        for cell in rows_of(cells)
    ]
    ends = zip(cells[f"{score}_low"], cells[f"{score}_high"], strict=True)
    limits = [  # where too many failed, they reach to infinity
        "" if pd.isna(low) else f"{low:.2f}–{'∞' if pd.isna(high) else f'{high:.2f}'}"
        for low, high in ends
    ]
    number = cells[score].map(partial(round, ndigits=2))
    more = {"number": number, "note": notes, "limits": limits, "sort": cells[score]}
    return _part(cells, kind, place, texts, **more)


def _published(cells: pd.DataFrame, place: int, measure: str, unit: str) -> pd.DataFrame:
    found = cells[cells.published_position_m.notna()]
    values = found[f"published_{measure}"]
    # A misprinted orientation is shown, and never the best.
    competes = (found.published_flag != "misprint") | (place == 0)
    texts = [f"{value:.2f}{unit}" for value in values]
    note = found.published_cell_note
    return _part(found, PAPER, place, texts, number=values.where(competes), note=note)


def _changes(cells: pd.DataFrame, kind: str, place: int, change: str) -> pd.DataFrame:
    found = cells[cells.published_position_m.notna()] if kind == "paper change" else cells
    values = found[change]
    texts = ["no change known" if pd.isna(value) else f"{value:+.1f}%" for value in values]
    tones = [
        "" if pd.isna(value) else "worse" if round(value, 1) > 0 else "better" for value in values
    ]
    return _part(found, kind, place, texts, tone=tones)


def _plain(value: float, unit: str) -> str:
    """A number that does not compete for bold."""
    return "–" if pd.isna(value) else f"{value:.2f}{unit}"


def _where(cells: pd.DataFrame) -> str:
    """Which scene, and how many frames where that is the same for the whole table."""
    titles = list(dict.fromkeys(map(scene_title, cells.scene)))
    where = f"Scene: {titles[0]}" if len(titles) == 1 else f"Scenes: {', '.join(titles)}"
    counts = cells[["n_train", "n_test"]].drop_duplicates()
    if len(counts) == 1:
        where += "; {} training and {} test frames".format(*counts.iloc[0])
    return f"{where}."
