"""The paper's tables, one page each: ours beside print in its own protocol, and what they cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from baselines.config.learning import MODELS
from reproduction.claims.levels import read_label_errors
from reproduction.claims.tables import SHARE, Part, parts_in, read_claims
from reproduction.plan.plan import planned_tables
from reproduction.plan.text import duration
from reproduction.replications.archive import ON_COMMON
from reproduction.report.claim_lines import part_text
from reproduction.report.paper_cells import pooled_rows
from reproduction.report.published import read_table
from reproduction.runs.published import MEASURED
from reproduction.tables.layouts import BLOCKS, TITLES, label_title, row_label, scene_title
from reproduction.tables.meshes import FACTS
from reproduction.tables.meshes import NAME as MESHES
from reproduction.tables.meshes import SCHEMA as MESHES_SCHEMA
from reproduction.tables.sheet import markdown_table
from synfeal.records.tables import read_frame, rows_of

HEADINGS = {
    "table2_ground_truth": "labels from",
    "table3_inconsistencies": "noise in",
    "table4_size": "scene, size (frames here)",
    "table5_from_scratch": "scene, size (frames here)",
}
CORES = 2
POOLED_HEADING = (
    "## Over {} replications\n\nGeometric means over rooms, paths, label sets and weights drawn"
    " anew, with 95 % limits over replications{} *(printed values in brackets)*:"
)
FOR_ALL_SIZES = ", errors against the true poses of one test set for all sizes of a scene"


def meshes_beside_print(root: Path) -> str:
    """Format Table 1: vertices, faces and volume of the meshes *(published in brackets)*."""
    meshes = read_frame(root / "tables" / f"{MESHES}.csv", MESHES_SCHEMA, "publish again")
    table: dict[str, object] = {"scene": meshes.scene.map(scene_title)}
    for fact, (title, form) in FACTS.items():
        ours, printed = meshes[fact].map(form.format), meshes[f"published_{fact}"].map(form.format)
        table[title.replace("# ", "").lower()] = ours + " *(" + printed + ")*"
    return markdown_table(pd.DataFrame(table))


def cells_beside_print(root: Path, name: str) -> str:
    """Format one of Tables 2 to 5 as the paper does *(published in brackets)*.

    Errors are against the labels of the test set, positions root mean squares over the axes.

    Args:
        root: Published results.
        name: Name of the table.
    """
    cells = read_table(root, name)
    rows = [_row_title(name, cell) for cell in rows_of(cells)]
    return by_localizer(cells, HEADINGS[name], rows, _beside_print)


def pooled_beside_print(folder: Path, name: str) -> str:
    """Format the rows of one of Tables 2 to 5 that replications have, under a heading.

    Args:
        folder: Pooled tables.
        name: Name of the table.
    """
    cells = pooled_rows(folder, name).dropna(subset=["replications"])
    rows = [_row_title(name, cell) for cell in rows_of(cells)]
    table = by_localizer(cells, HEADINGS[name], rows, _pooled_cell)
    test_set = FOR_ALL_SIZES if name in ON_COMMON else ""
    return f"{POOLED_HEADING.format(int(cells['replications'].max()), test_set)}\n\n{table}"


def _pooled_cell(cell: Any) -> str:
    """Format both errors with limits, positions as root mean squares over the axes."""
    position_rms_m = (
        getattr(cell, f"position_m{end}") / math.sqrt(3) for end in ("", "_low", "_high")
    )
    turned_deg = (getattr(cell, f"orientation_deg{end}") for end in ("", "_low", "_high"))
    mark = "" if cell.flag == "none" else f", {cell.flag}"
    return (
        "{:.2f} m ({:.2f} – {:.2f}), ".format(*position_rms_m)
        + "{:.1f}° ({:.1f} – {:.1f})".format(*turned_deg)
        + f" *({cell.printed_position_m:.2f}, {cell.printed_orientation_deg:.2f}{mark})*"
    )


def by_localizer(
    cells: pd.DataFrame, heading: str, rows: Sequence[str], text: Callable[[Any], str]
) -> str:
    """Format cells as a row per title, in the order of the titles, and a column per localizer.

    Args:
        cells: Cells of a table.
        heading: Heading of the titles.
        rows: Title of the row that each cell is in.
        text: Formats a cell.
    """
    texts = [text(cell) for cell in rows_of(cells)]
    table = cells.assign(row=rows, text=texts).pivot(index="row", columns="model", values="text")
    ordered = table.loc[[*dict.fromkeys(rows)], list(MODELS)].rename(columns=TITLES)
    return markdown_table(ordered.rename_axis(index=heading).reset_index())


def _row_title(name: str, cell: Any) -> str:
    if name == "table2_ground_truth":
        return label_title(cell.labels)
    if name == "table3_inconsistencies":
        return f"{BLOCKS[cell.block]} {row_label(name, cell)}"
    return f"{scene_title(cell.scene)} {cell.size} ({cell.n_train:,}, {cell.n_test:,})"


def _beside_print(cell: Any) -> str:
    """Format both errors; what the paper misprints is marked."""
    ours = "failed"
    if not math.isnan(cell.position_rms_m):
        ours = f"{cell.position_rms_m:.2f} m, {cell.orientation_deg:.1f}°"
    if math.isnan(cell.published_position_m):
        return ours
    mark = "" if cell.published_flag == "none" else f", {cell.published_flag}"
    return f"{ours} *({cell.published_position_m:.2f}, {cell.published_orientation_deg:.2f}{mark})*"


def label_quality(folder: Path) -> str:
    """Format how far off the training labels of each method are, and how often it was assisted.

    Args:
        folder: Effects of the claims, with the errors of labels.
    """
    assisted = {
        part.label: f"{part_text(part)}{_printed_share(part)}"
        for part in parts_in(read_claims(folder).effects)
        if part.unit == SHARE
    }
    rows = [
        {
            "labels from": label_title(row.method),
            "median error": f"{100 * row.position_m:.1f} cm, {row.orientation_deg:.2f}°",
            "root mean square": f"{100 * row.position_m_rmse:.1f} cm",
            "batches assisted (95 % limits)": assisted.get(row.method, "–"),
        }
        for row in rows_of(read_label_errors(folder))
    ]
    return markdown_table(pd.DataFrame(rows))


def _printed_share(part: Part) -> str:
    return "" if math.isnan(part.printed) else f" *({100 * part.printed:.0f} %)*"


def making(root: Path, name: str) -> str:
    """Say how a table is made alone with the profile of a run, and what that takes.

    Args:
        root: Published results; those of ``mini``, the default, or another profile of ``config``.
        name: Name of the table.
    """
    cost = _planned(root.name)[name]
    return (
        f"```\nsnakemake --cores {CORES} results/{root.name}/tables/{name}.csv\n```\n\n"
        f"From nothing: {cost['jobs']:.0f} jobs, about {duration(cost['wall_s'])} on {CORES} cores"
        f" ({duration(cost['cpu_s'])} of processor time, predicted from measured runs). What an"
        " earlier run has made is not made again."
    )


@cache
def _planned(profile: str) -> Mapping[str, Mapping[str, float]]:
    found = planned_tables(profile, MEASURED, CORES).T.to_dict()
    return {str(name): cost for name, cost in found.items()}
