"""The tables that have one score only: meshes, assistance, and what speed costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from synfeal.report import assistance, meshes, speed_vs_error
from synfeal.report.html.markup import Column, number_cell, plain_table, text_cell
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.report.results import read_table

Row = Mapping[str, str]
USED = ' class="used"'
WHEN = ("before", "after")


def meshes_table(path: Path) -> str:
    """Table 1: the meshes beside the paper's."""
    printed = [f"published_{fact}" for fact in meshes.FACTS]
    rows = read_table(path, meshes.COLUMNS, meshes.FACTS, printed)
    columns = [Column("Scene"), *(Column(title, True) for title in meshes.LABELS.values())]
    body = [
        f"<tr>{text_cell(scene_title(row['scene']))}"
        f"{''.join(_fact(row, fact) for fact in meshes.FACTS)}</tr>"
        for row in rows
    ]
    caption = (
        "<b>Table 1.</b> Properties of the meshes: vertices at distinct positions, faces, volume of"
        " the axis-aligned bounding box. In grey: the meshes of the paper."
    )
    return plain_table(meshes.NAME, caption, columns, body)


def assistance_table(path: Path) -> str:
    """How often the methods that re-estimate labels had to be helped, beside section 4.1."""
    rows = read_table(path, assistance.COLUMNS, assistance.COUNTS, assistance.LAST_POSE)
    titles = ("Batches", "Assisted", "Lost", "Frames", "Frames registered", "Frames filled")
    columns = [Column("Method"), Column("Data set"), *(Column(title, True) for title in titles)]
    columns += [Column(f"Last pose off by, {when} assistance", True) for when in WHEN]
    caption = (
        "<b>Assistance.</b> Batches of both splits together. Assisted: the last pose was replaced"
        " by the true one; lost: no motion was found. Last pose: median over the batches. In grey:"
        " what section 4.1 of the paper counts."
    )
    total = [_assisted(row) for row in rows if row["split"] == assistance.TOTAL]
    return plain_table("assistance", caption, columns, total)


def speed_table(path: Path) -> str:
    """What each stage could choose among, how fast and how wrong each is."""
    rows = read_table(path, speed_vs_error.COLUMNS, ("items_per_s", "error"), ("faces",))
    columns = [Column(title) for title in ("Stage", "Scene", "Variant")]
    columns += [Column(title, True) for title in ("Faces", "Items per second", "Error")]
    caption = (
        "<b>Speed against error.</b> What a stage could choose among; marked rows are what the run"
        " used. Speeds are measured and differ between runs."
    )
    columns += [Column("Error unit"), Column("Used")]
    return plain_table("speed_vs_error", caption, columns, _speeds(rows))


def _fact(row: Row, fact: str) -> str:
    printed = row[f"published_{fact}"]
    beside = f'<div class="paper">{_count(printed)}</div>' if printed else ""
    return number_cell(float(row[fact]), _count(row[fact]), beside)


def _count(text: str) -> str:
    return f"{int(text):,}" if text.isdigit() else f"{float(text):,.2f}"


def _assisted(row: Row) -> str:
    cells = [
        text_cell(SOURCES.get(row["method"], row["method"])),
        text_cell(f"{scene_title(row['scene'])}, {row['size']}"),
    ]
    for count in assistance.COUNTS:
        printed = row.get(f"published_{count}", "")
        beside = f'<div class="paper">{escape(printed)}</div>' if printed else ""
        cells.append(number_cell(float(row[count]), row[count], beside))
    for when in WHEN:
        metres, degrees = (row[f"last_{unit}_{when}_median"] for unit in ("m", "deg"))
        text = f"{float(metres):.2f} m, {float(degrees):.2f}°" if metres and degrees else "–"
        cells.append(number_cell(float(metres) if metres else None, text))
    return f"<tr>{''.join(cells)}</tr>"


def _speeds(rows: Sequence[Row]) -> list[str]:
    lines = []
    for row in rows:
        used, items_per_s = row["chosen"] == "1", float(row["items_per_s"])
        cells = [
            *(text_cell(row["stage"]), text_cell(scene_title(row["scene"]))),
            text_cell(row["variant"]),
            _faces(row["faces"]),
            number_cell(items_per_s, f"{items_per_s:,.0f}"),
            number_cell(float(row["error"]), row["error"]),
            text_cell(row["error_unit"]),
            text_cell("✓" if used else ""),
        ]
        lines.append(f"<tr{USED if used else ''}>{''.join(cells)}</tr>")
    return lines


def _faces(text: str) -> str:
    return number_cell(float(text), f"{float(text):,.0f}") if text else text_cell("")
