"""Tables 2 to 7 as files: tidy CSV, one row per cell, and LaTeX in the paper's layout."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.design.experiments import FROM_SCRATCH, Design
from reproduction.statistics.limits import PATHS, PATHS_AND_SEEDS
from reproduction.tables import yardstick
from reproduction.tables.cells import CHANGES, MOVED, read_cells, schema_of
from reproduction.tables.layouts import (
    BLOCKS,
    CAPTIONS,
    CHANGE,
    DOSE,
    HEADINGS,
    ONE_RUN,
    PUBLISHED,
    REFERENCES,
    REMARK,
    TITLES,
    UNITS,
    UNTRAINED,
    YARDSTICK,
    published_labels,
    row_label,
    scene_title,
)
from reproduction.tables.sheet import PAPER, Line, Sheet, Value, write_latex
from synfeal.records.tables import rows_of, write_frame

# Kinds of lines in their order, and what their numbers are measured against; in Table 5 each score
# is followed by its change.
AGAINST = {
    "labels": "labels",
    "yardstick": "labels, yardstick alone",
    "labels change": "change",
    "truth": "truth",
    "truth change": "change",
    "unit": "labels, paper's unit",
    PAPER: "paper",
    "paper change": "change, paper",
}
KIND_OF = {"labels": "", "truth": "_true"}
FAILED = "failed"
# Suffix of the limits of a cell.
PATHS_ONLY = {PATHS: ", paths only", PATHS_AND_SEEDS: ""}


def write_table(table: str, design: Design, root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write one of tables 2 to 7 from the scores of its runs, a row per cell.

    Args:
        table: Name of the table, such as ``table4_size``.
        design: Rows of the table, and the runs they read.
        root: Results of the profile.
        out_csv: Tidy table to write.
        out_tex: LaTeX in the paper's layout to write.
    """
    cells = read_cells(table, design, root)
    write_frame(out_csv, cells[[*schema_of(table, repeated=bool((cells.n_seeds > 1).any()))]])
    write_latex(out_tex, sheet_of(table, cells))


def sheet_of(name: str, cells: pd.DataFrame) -> Sheet:
    """Lay out one of tables 2 to 7, from what :func:`reproduction.tables.cells.read_cells` read."""
    one_truth = bool((cells.labels == "synfeal").all())  # then both scores are one line
    against = AGAINST | ({"labels": "labels = truth"} if one_truth else {})
    kinds = [k for k in against if not (one_truth and k.startswith("truth"))]
    kinds = [k for k in kinds if name == FROM_SCRATCH or not k.endswith("change")]
    has_yardstick = bool(cells[yardstick.COLUMNS[0]].notna().any())
    kinds = [k for k in kinds if k != "yardstick" or has_yardstick]
    references = dict([*REFERENCES.items()][: 1 if one_truth else 2])
    in_print = published_labels(name, cells)
    # Blocks: noise of Table 3, and the scene where there are several.
    scenes = cells.scene.map(scene_title) if cells.scene.nunique() > 1 else ""
    titles = (cells.block.map(BLOCKS) + " " + scenes).str.strip()
    lines = []
    for title, block in cells.groupby(titles, sort=False):
        keys = [(cell, kind) for cell in rows_of(block) for kind in kinds]
        numbers = {(cell.row, kind, cell.model): _numbers(kind, cell) for cell, kind in keys}
        _mark_best(numbers)
        for lead in rows_of(block.drop_duplicates("row")):
            labels = {
                "labels": Value(row_label(name, lead), sort=_order(name, lead)),
                PAPER: Value(in_print.get(lead.row, ""), note=lead.published_row_note),
            }
            for kind in kinds:
                found = [numbers.get((lead.row, kind, model), []) for model in TITLES]
                found += [_reference(start, kind, lead) for start in references]
                if any(found):
                    texts = [[labels.get(kind, Value(""))], [Value(against[kind])]]
                    lines.append(Line(str(title), lead.row, kind, [*texts, *found]))
    headings = (HEADINGS[name], "Error against", *TITLES.values(), *references.values())
    changes = [CHANGE] if name == FROM_SCRATCH else []
    told = [YARDSTICK] if has_yardstick else []
    told += dose_remarks(cells)
    remarks = (REMARK, UNTRAINED, *told, PUBLISHED, *changes, *one_run_remarks(cells))
    caption = f"{CAPTIONS[name]} {_where(cells)} Best scores in bold."
    return Sheet(name, caption, headings, lines, remarks)


def dose_remarks(cells: pd.DataFrame) -> list[str]:
    """Remark where labels were moved farther than their rows say."""
    return [DOSE] if bool((cells[MOVED] > cells.noise_m).any()) else []


def one_run_remarks(cells: pd.DataFrame) -> list[str]:
    """Remark where limits do not cover training runs."""
    return [ONE_RUN] if bool((cells.limits_of == PATHS).any()) else []


def _order(name: str, row: Any) -> object:
    """Return the key a row is sorted by on the page: its noise, label or number of frames."""
    if row.block:
        return f"{1000 * row.noise_m + row.noise_deg:g}"
    return row_label(name, row) if name == "table2_ground_truth" else row.n_train


def _numbers(kind: str, cell: Any) -> list[Value]:
    """Format position and orientation of a localizer on a line; none where the paper lacks them."""
    source, _, change = kind.partition(" ")
    if source in ("unit", PAPER) and pd.isna(cell.published_position_m):
        return []
    if kind == "yardstick":
        units = dict(zip(yardstick.COLUMNS, UNITS.values(), strict=True))
        values = [Value(_plain(getattr(cell, name), unit)) for name, unit in units.items()]
        return [] if pd.isna(cell.yardstick_position_m) else values
    if kind == "unit":
        return [Value(_plain(cell.position_rms_m, " m"))]
    if change:
        start = "published_" if source == PAPER else ""
        names = [CHANGES[f"{measure}{KIND_OF.get(source, '')}"] for measure in UNITS]
        return [_change(getattr(cell, f"{start}{name}")) for name in names]
    if kind == PAPER:
        m, deg, note = (getattr(cell, f"published_{n}") for n in (*UNITS, "cell_note"))
        rival = "" if cell.published_flag == "misprint" else deg  # shown, and never the best
        return [Value(f"{m:.2f} m", note=note, sort=m), Value(f"{deg:.2f}°", note=note, sort=rival)]
    scores = [_score(cell, f"{m}{KIND_OF[kind]}", unit) for m, unit in UNITS.items()]
    return scores[:1] if scores[0].text == FAILED else scores  # said once


def _score(cell: Any, score: str, unit: str) -> Value:
    value, sd, low, high = (getattr(cell, f"{score}{end}") for end in ("", "_sd", "_low", "_high"))
    text = f"{value:.2f}{'' if pd.isna(sd) else f' ± {sd:.2f}'}{unit}"
    note = (
        f"{cell.failed} of {cell.n_test * cell.n_seeds} predictions failed, {cell.n_finished} of"
        f" {cell.n_seeds} runs have a score."
    )
    upper = "∞" if pd.isna(high) else f"{high:.2f}"  # too many failed to know it
    return Value(
        FAILED if pd.isna(value) else text,
        note=note if cell.failed else "",
        limits="" if pd.isna(low) else f"{low:.2f}–{upper}{PATHS_ONLY[cell.limits_of]}",
        sort="" if pd.isna(value) else value,
    )


def _change(value: Any) -> Value:
    if pd.isna(value):
        return Value("no change known")
    return Value(f"{value:+.1f}%", tone="worse" if round(value, 1) > 0 else "better")


def _reference(start: str, kind: str, cell: Any) -> list[Value]:
    """Format an answer without training, the same for every localizer of a row."""
    scores = {f"{start}_{m}{KIND_OF[kind]}": u for m, u in UNITS.items() if kind in KIND_OF}
    values = [(getattr(cell, score), u) for score, u in scores.items() if hasattr(cell, score)]
    return [Value(_plain(v, unit), sort="" if pd.isna(v) else v) for v, unit in values]


def _plain(value: float, unit: str) -> str:
    return "–" if pd.isna(value) else f"{value:.2f}{unit}"


def _mark_best(numbers: Mapping[tuple[int, str, str], list[Value]]) -> None:
    """Make the lowest of a block bold, by kind and localizer; ties as printed are all lowest."""
    rivals = defaultdict(list)
    for (_, kind, model), values in numbers.items():
        for place, value in enumerate(values):
            if value.sort != "":
                rivals[kind, model, place].append((round(value.sort, 2), values))
    for (_, _, place), found in rivals.items():
        lowest = min(number for number, _ in found)
        for number, values in found if len(found) > 1 else ():
            values[place] = values[place]._replace(bold=number == lowest)


def _where(cells: pd.DataFrame) -> str:
    """Name the scene, and the number of frames where the whole table has one."""
    titles = list(dict.fromkeys(map(scene_title, cells.scene)))
    where = f"Scene: {titles[0]}" if len(titles) == 1 else f"Scenes: {', '.join(titles)}"
    counts = cells[["n_train", "n_test"]].drop_duplicates()
    if len(counts) == 1:
        where += "; {} training and {} test frames".format(*counts.iloc[0])
    return f"{where}."
