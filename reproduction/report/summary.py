"""Summarise a run on one page of Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from reproduction.design.experiments import Design
from reproduction.design.side_tables import SIDE_TABLES
from reproduction.tables import meshes
from reproduction.tables.cells import read_cells
from reproduction.tables.columns import side_sheet
from reproduction.tables.layouts import TITLES, scene_title
from reproduction.tables.sheet import sheet_markdown
from reproduction.tables.side import read_side_table, table_named
from reproduction.tables.write import sheet_of
from synfeal.records.files import write_text
from synfeal.records.tables import rows_of

ALIVE = "table4_size"
FOUND = "## Do the localizers localize?"
INTRO = """\
# Results of profile `{profile}`

Every cell is a median error over the test frames. Lines *paper* are the values the paper printed,
on its own meshes and at its own scale. Errors are against the labels the test set carries (the
paper's protocol) and against the true poses of the simulator. The same numbers with limits and
frame counts are in `tables/*.csv`, and as LaTeX in `tables/*.tex`.
"""


def write_summary(design: Design, root: Path, out_md: Path) -> None:
    """Write whether localizers learned anything, then every table beside the paper's.

    Args:
        design: The profile's table of experiments.
        root: Results of the profile; tables that it lacks are left out.
        out_md: Markdown to write.
    """
    cells = {name: read_cells(name, design, root) for name in design.tables}
    findings = run_sentences(cells)
    scores = [sheet_of(name, found) for name, found in cells.items()]
    sheets = []
    for name in (name for name, side in SIDE_TABLES.items() if side.in_summary):
        path = root / "tables" / f"{name}.csv"
        if path.exists():
            rows, layout = read_side_table(name, path)
            findings += table_named(name).findings(rows)
            sheets.append(side_sheet(layout))
        sheets += scores if name == meshes.NAME else []
    parts = [
        INTRO.format(profile=root.name),
        f"{FOUND}\n",
        "".join(f"- {finding}\n" for finding in findings),
        "## Tables\n",
        *map(sheet_markdown, sheets),
    ]
    write_text(out_md, "\n".join(parts))


def findings_in(summary: Path) -> list[str]:
    """Read back the findings that a summary begins with.

    Args:
        summary: Page by :func:`write_summary`; none where it is missing.

    Returns:
        Its findings, a line each.
    """
    if not summary.is_file():
        return []
    _, _, after = summary.read_text(encoding="utf-8").partition(f"{FOUND}\n")
    section, _, _ = after.partition("\n## ")
    return [line for line in section.splitlines() if line]


def run_sentences(cells: Mapping[str, pd.DataFrame]) -> list[str]:
    """Say how many cells have a score, which have none, and what Table 4 says."""
    failed = [
        f"{name} {cell.scene} {cell.size} {cell.label_id} {cell.model}"
        for name, found in cells.items()
        for cell in rows_of(found[found.n_finished == 0])
    ]
    which = f"; without one: {', '.join(failed)}" if failed else ""
    total = sum(map(len, cells.values()))
    counted = f"{total - len(failed)} of {total} table cells have a score{which}."
    return [counted, *(alive_sentences(cells[ALIVE]) if ALIVE in cells else [])]


POSITION, ORIENTATION = "position_m_true", "orientation_deg_true"


def alive_sentences(cells: pd.DataFrame) -> list[str]:
    """Say what the cells of Table 4 show about each scene, by errors against the true poses."""
    scenes = cells.groupby("scene", sort=False)
    return [text for scene, found in scenes for text in _sentences(scene_title(str(scene)), found)]


def _sentences(title: str, cells: pd.DataFrame) -> list[str]:
    """Say which errors are below half of the mean pose's, and what more frames change."""
    n_train = cells.groupby("size", sort=False).n_train.first()
    sizes = n_train.idxmin(), n_train.idxmax()
    first, last = (cells[cells["size"] == size].set_index("model") for size in sizes)
    half_m = last[f"baseline_{POSITION}"].iloc[0] / 2
    below = int((last[POSITION] < half_m).sum())
    errors = [
        f"{TITLES[str(model)]} " + ("failed" if pd.isna(error_m) else f"{error_m:.2f} m")
        for model, error_m in last[POSITION].items()
    ]
    lines = [
        f"{title}, {sizes[1]}: {below} of {len(last)} localizers have a median position error below"
        f" half of the mean-pose baseline ({half_m:.2f} m): {', '.join(errors)}."
    ]
    if pd.isna(half_m):
        lines = [f"{title}, {sizes[1]}: the mean-pose baseline could not be computed."]
    if sizes[0] != sizes[1]:
        falls = [_falls(last[measure] < first[measure]) for measure in (POSITION, ORIENTATION)]
        lines.append(
            f"{title}, {sizes[0]} to {sizes[1]}: the position error falls for {falls[0]}, the"
            f" orientation error for {falls[1]}."
        )
    return lines


def _falls(falls: pd.Series) -> str:
    others = [TITLES[str(model)] for model in falls.index[~falls]]
    exceptions = f" (not {', '.join(others)})" if others else ""
    return f"{falls.sum()} of {len(falls)}{exceptions}"
