"""The tables beside tables 2 to 6, as the page shows them: a column more is a line more."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from html import escape
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from synfeal.evaluation.metrics import BOUNDS, MEANS, ORIENTATION, POSITION
from synfeal.frames import read_frame, read_records
from synfeal.report import (
    assistance,
    label_error,
    meshes,
    recall,
    references,
    robustness,
    speed_vs_error,
)
from synfeal.report.hard_cases import table as hard_cases
from synfeal.report.hard_cases.exact import Row, error_text, judged, short
from synfeal.report.html.tables import Column, sortable
from synfeal.report.layouts import SOURCES, TITLES, scene_title

DATA_SET, LABELS = Column("Data set", "data_set"), Column("Labels", "labels")


def meshes_table(path: Path) -> Markup:
    """Table 1: the meshes beside the paper's."""
    columns = [
        Column("Scene", "scene"),
        *(
            Column(title, fact, form, paper=f"published_{fact}")
            for fact, (title, form) in meshes.FACTS.items()
        ),
    ]
    caption = (
        "<b>Table 1.</b> Properties of the meshes: vertices at distinct positions, faces, volume of"
        " the axis-aligned bounding box. In grey: the meshes of the paper."
    )
    table = read_frame(path, meshes.SCHEMA)
    return sortable(meshes.NAME, caption, columns, table.assign(scene=table.scene.map(scene_title)))


def references_table(path: Path) -> Markup:
    """A row per data set and method; localizers in grey."""
    against = {"labels": "", "true poses": "_true"}
    columns = [
        *(DATA_SET, LABELS, Column("Method", "title")),
        *(
            Column(f"{unit}, {title}", f"{measure}{end}", "{:.3g}")
            for title, end in against.items()
            for measure, unit in {"position_m": "m", "orientation_deg": "°"}.items()
        ),
        *(
            Column(f"Within, %, {title}", f"within_5cm_5deg{end}", "{:.0f}", 100)
            for title, end in against.items()
        ),
        Column("Failed", "failed", "{:.0f}"),
        Column("s per frame", "seconds_per_frame", "{:.2g}"),
    ]
    caption = (
        "<b>References.</b> Image retrieval, the nearest training pose and structure-based poses"
        " beside the localizers, all from the labels of the data set. Within: share of the test"
        " frames within 5 cm and 5°. Seconds of one processor core, without what is done once for"
        " all label sets."
    )
    table = _with_data_set(read_frame(path, references.SCHEMA))
    table = table.assign(
        labels=table.labels.map(references.label_title),
        style=table.kind.where(table.kind == references.LOCALIZER, ""),
    )
    return sortable(references.NAME, caption, columns, table)


def recall_table(path: Path) -> Markup:
    """A row for every run of the design, its repetitions averaged."""
    shares = {bound.name: bound.title for bound in BOUNDS} | {recall.DCRE[0]: "DCRE"}
    shares |= {score: f"DCRE < {score.rsplit('_')[-1]}" for score in recall.DCRE[1:]}
    columns = [
        *(DATA_SET, LABELS, Column("Start", "init"), Column("Localizer", "model")),
        Column("Mean, m", MEANS[POSITION], "{:.2f} m", scored=True),
        Column("Mean, °", MEANS[ORIENTATION], "{:.1f}°", scored=True),
        *(Column(title, name, "{:.1f} %", 100, scored=True) for name, title in shares.items()),
    ]
    caption = f"<b>Recall.</b> {escape(recall.CAPTION)} {escape(recall.REMARK)} Small: 95 % limits."
    table = _with_data_set(read_frame(path, recall.SCHEMA))
    table = table.assign(
        labels=table.labels.map(references.label_title), model=table.model.map(TITLES)
    )
    return sortable(recall.NAME, caption, columns, table)


def robustness_table(path: Path) -> Markup:
    """A row for each training set and each of the effects; both errors in a cell."""
    table = robustness.read_robustness(path)
    texts = [
        table[measure].map(partial(robustness.printed, digits=digits)) + unit
        for measure, (unit, digits) in robustness.UNITS.items()
    ]
    text = texts[0].str.cat(texts[1], ", ").where(table.position_m.notna(), "failed")
    rows = pd.MultiIndex.from_frame(table[["trained_on", "effects"]].drop_duplicates())
    wide = table.assign(text=text).pivot(index=rows.names, columns="method").reindex(rows)
    shown = wide["position_m"].join(wide["text"].fillna("–"), rsuffix="_text").reset_index()
    shown = shown.assign(effects=shown.effects.map(robustness.effects_title))
    columns = [
        *(Column("Trained on", "trained_on"), Column("Test frames", "effects")),
        *(
            Column(robustness.METHODS[name], name, text=f"{name}_text")
            for name in table.method.unique()
        ),
    ]
    caption = escape(" ".join((robustness.CAPTION, *robustness.remarks(table))))
    return sortable(robustness.NAME, f"<b>Robustness.</b> {caption}", columns, shown)


def assistance_table(path: Path) -> Markup:
    """How often the methods that re-estimate labels had to be helped, beside section 4.1."""
    columns = [
        *(Column("Method", "title"), DATA_SET),
        Column("Batches", "batches", "{:.0f}", paper="published_batches"),
        Column("Assisted", "assisted", "{:.0f}", paper="published_assisted"),
        Column("Lost", "lost", "{:.0f}"),
        Column("Frames", "frames", "{:.0f}"),
        Column("Frames registered", "registered", "{:.0f}"),
        Column("Frames filled", "filled", "{:.0f}"),
        *(
            Column(f"Last pose, {when}", f"last_m_{when}_median", text=when)
            for when in ("before", "after")
        ),
    ]
    caption = (
        "<b>Assistance.</b> Batches of both splits together. Assisted: the last pose was replaced"
        " by the true one; lost: no motion was found. Last pose: its error before and after"
        " assistance, median over the batches. In grey: what section 4.1 of the paper counts."
    )
    table = _of_both_splits(read_frame(path, assistance.SCHEMA))
    off = {when: assistance.last_pose(table, when) for when in ("before", "after")}
    return sortable(assistance.NAME, caption, columns, table.assign(**off))


def label_error_table(path: Path) -> Markup:
    """A row before and a row after assistance for every method and data set."""
    spreads = {"median": "Median", "rmse": "RMSE", "max": "Max"}
    columns = [
        *(Column("Labels from", "title"), DATA_SET, Column("Assistance", "assistance")),
        *(
            Column(f"{title}, {unit}", f"{measure}_{which}", "{:.3g}")
            for measure, unit in {"position_m": "m", "orientation_deg": "°"}.items()
            for which, title in spreads.items()
        ),
        Column("Drift, %", "relative_25_m_per_m", "{:.2g}", 100),
        Column("Drift, °/m", "relative_25_deg_per_m", "{:.2g}"),
        Column("Within 5 cm, 5°, %", "share_within_5cm_5deg", "{:.0f}", 100),
        Column("Filled, %", "share_filled", "{:.1f}", 100),
        Column("s per frame", "seconds_per_frame", "{:.2g}"),
        Column("Memory, MB", "peak_memory_mb", "{:,.0f}"),
    ]
    caption = (
        "<b>Label errors.</b> Re-estimated labels of both splits against the true poses, without"
        " alignment. Before assistance: what the labels were had no last pose been replaced. Drift:"
        " errors of the motion over 25 frames, by the metre travelled; a replaced pose adds to it."
        " Along the sequence: <a href='#figures'>the figures</a> of camera paths and label errors."
    )
    table = _of_both_splits(read_frame(path, label_error.SCHEMA))
    return sortable(label_error.NAME, caption, columns, table)


def speed_table(path: Path) -> Markup:
    """What each stage could choose among, how fast and how wrong each is."""
    columns = [
        *(Column("Stage", "stage"), Column("Scene", "scene"), Column("Variant", "variant")),
        Column("Faces", "faces", "{:,.0f}"),
        Column("Items per second", "items_per_s", "{:,.0f}"),
        Column("Error", "error", "{:.3g}"),
        *(Column("Error unit", "error_unit"), Column("Used", "used")),
    ]
    caption = (
        "<b>Speed against error.</b> What a stage could choose among; marked rows are what the run"
        " used. Speeds are measured and differ between runs."
    )
    table = read_frame(path, speed_vs_error.SCHEMA)
    used, style = (table.chosen.map({1: text, 0: ""}) for text in ("✓", "used"))
    table = table.assign(scene=table.scene.map(scene_title), used=used, style=style)
    return sortable(speed_vs_error.NAME, caption, columns, table)


def hard_cases_table(path: Path) -> Markup:
    """Every case with both errors, over the formulas that made them, the bound and the times."""
    columns = [
        *(Column("What", "family"), Column("Case", "case", small="judged")),
        *(
            Column(title, which, text=f"{which}_text", small=f"{which}_formula", bad=f"{which}_bad")
            for which, title in {"naive": "First thought", "our": "Ours"}.items()
        ),
        *(Column("Bound", "bound", text="bound_text"), Column("Truth", "reference")),
        Column("First, µs", "naive_seconds", text="naive_time"),
        Column("Ours, µs", "our_seconds", text="our_time"),
    ]
    caption = (
        "<b>Hard cases.</b> Errors against exact answers: of the formula somebody would write"
        " first, and of the function this project uses. <b class='worse'>✗</b> marks errors above"
        " the bound that ours promises; “none” is no answer or no number. Cases without one right"
        " answer are to be refused. Times are those of one call, medians, and differ between runs."
    )
    frame = pd.DataFrame([_case(row) for _, row in read_records(path, hard_cases.SCHEMA)])
    starts = frame.family != frame.family.shift()
    frame = frame.assign(style=starts.map({True: "first", False: ""}))
    return sortable(hard_cases.NAME, caption, columns, frame)


SIDE_TABLES: Mapping[str, tuple[str, Callable[[Path], Markup]]] = {
    references.NAME: ("References", references_table),
    recall.NAME: ("Recall", recall_table),
    robustness.NAME: ("Robustness", robustness_table),
    assistance.NAME: ("Assistance", assistance_table),
    label_error.NAME: ("Label errors", label_error_table),
    speed_vs_error.NAME: ("Speed against error", speed_table),
    hard_cases.NAME: ("Hard cases", hard_cases_table),
}


def _with_data_set(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(data_set=table.scene.map(scene_title) + ", " + table["size"])


def _of_both_splits(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of both splits together, with the title of their method."""
    table = _with_data_set(table[table.split == assistance.TOTAL])
    return table.assign(title=table.method.map(lambda method: SOURCES.get(method, method)))


def _case(row: Row) -> dict[str, object]:
    bound = float(row["bound"])
    cells: dict[str, object] = {"judged": judged(row), "bound_text": short(bound)}
    for which, formula in {"naive": row["naive"], "our": row["ours"]}.items():
        error, seconds = float(row[f"{which}_error"]), float(row[f"{which}_seconds"])
        cells[which] = min(error, sys.float_info.max)
        cells[f"{which}_text"] = error_text(row, f"{which}_error")
        cells[f"{which}_formula"], cells[f"{which}_bad"] = formula, error > bound
        cells[f"{which}_time"] = f"{1e6 * seconds:,.0f}" if seconds >= 1e-6 else "< 1"
    return {**{k: v for k, v in row.items() if k not in cells}, **cells}
