"""The paper's layouts: which lines a table row has, and how labels, blocks and captions read."""

from __future__ import annotations

from functools import partial
from typing import Any

import pandas as pd

from baselines.groundtruth.methods import METHODS
from synfeal.config.experiments import FROM_SCRATCH, split_init
from synfeal.frames import rows_of
from synfeal.report.cells import CHANGES
from synfeal.report.sheet import LINE, PAPER, VALUE, Sheet, with_bold

TITLES = {
    "posenet": "PoseNet",
    "poselstm": "PoseLSTM",
    "hourglass": "Hourglass",
    "posenet2resnet": "PoseNet2ResNet",
    "posenet2": "PoseNet2",
}
SOURCES = {**{name: method.title for name, method in METHODS.items()}, "synfeal": "Synfeal"}
ERRORS = {
    "noise": "independent noise",
    "offset": "one error per path",
    "bend": "a bend of space",
    "scale": "a wrong scale",
}
STARTS = {"pretrained": "transfer learning", "scratch": "from scratch"}
PARTS = {"": "", "half": ", half of the images", "quarter": ", a quarter of the images"}
# What has not been trained, printed beside the localizers: columns of metrics.
REFERENCES = {"baseline": "Mean pose", "floor": "True pose"}
BLOCKS = {"": "", "orientation": "Ori.", "position": "Pos.", "both": "Pos.+Ori."}
CAPTIONS = {
    "table2_ground_truth": "Median localization error with labels from different data collection "
    "techniques.",
    "table3_inconsistencies": "Median localization error with different levels of inconsistencies "
    "in the labels.",
    "table4_size": "Median localization error on data sets of different size.",
    "table5_from_scratch": "Median localization error without transfer learning on data sets of "
    "different size, and the change against the same run with transfer learning.",
    "table6_label_errors": "Median localization error with labels of the same median error and "
    "different kinds of it; this table is not in the paper.",
    "table7_images_shown": "Median localization error after fewer images, each a training run of "
    "its own length; this table is not in the paper.",
}
HEADINGS = {
    "table2_ground_truth": "Ground truth provided by",
    "table3_inconsistencies": "Inconsistencies",
    "table4_size": "(# train, # test)",
    "table5_from_scratch": "(# train, # test)",
    "table6_label_errors": "Errors of the labels",
    "table7_images_shown": "Images shown",
}
REMARK = (
    "Errors are against the labels the test set carries (the paper's protocol) and against the "
    "true poses of the simulator."
)
PUBLISHED = (
    "Lines marked paper: the values the paper printed, on its own meshes and at its own scale. Its "
    "position errors are root mean squares over the three axes; lines marked paper's unit are ours "
    "in that unit."
)
UNTRAINED = (
    "Mean pose: the error of always answering the mean pose of the training labels. True pose: "
    "that of the true poses against the labels, what a perfect localizer would score."
)
CHANGE = (
    "Red: worse than with transfer learning; green: not worse. Changes come from unrounded errors; "
    "some printed in the paper differ from what its rounded cells give."
)
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
UNITS = {"position_m": " m", "orientation_deg": "°"}


def scene_title(scene: str) -> str:
    """A scene's name as printed, e.g. ``Large Room``."""
    return scene.replace("_", " ").title()


def sheet_of(name: str, cells: pd.DataFrame) -> Sheet:
    """Lay out one of tables 2 to 7, from what :func:`synfeal.report.cells.read_cells` read."""
    one_truth = bool((cells.labels == "synfeal").all())
    values = printed_values(name, cells)
    if one_truth:  # both scores are one line, and the true poses score zero
        values = values[
            ~values.kind.str.startswith("truth") & (values.column != REFERENCES["floor"])
        ]
    second = (values.text == FAILED) & (values.place == 1)
    lines = _lines(name, cells, values, one_truth)
    number = pd.Series(lines.index, pd.MultiIndex.from_frame(lines[["row", "kind"]]))
    keys = pd.MultiIndex.from_frame(values[["row", "kind"]])
    values = values.assign(line=number[keys].to_numpy())[~second]
    references = [*REFERENCES.values()][: 1 if one_truth else 2]
    return Sheet(
        name,
        f"{CAPTIONS[name]} {_where(cells)} Best scores in bold.",
        (HEADINGS[name], "Error against", *TITLES.values(), *references),
        lines.assign(kind=lines.kind.str.removesuffix(" change"))[list(LINE)],
        values[list(VALUE)],
        (REMARK, UNTRAINED, PUBLISHED, *([CHANGE] if name == FROM_SCRATCH else [])),
    )


def blocks_of(cells: pd.DataFrame) -> pd.Series:
    """Titles of the block of each cell: noise of Table 3, and the scene where there are several."""
    scenes = cells.scene.map(scene_title) if cells.scene.nunique() > 1 else ""
    return (cells.block.map(BLOCKS) + " " + scenes).str.strip()


def printed_values(name: str, cells: pd.DataFrame) -> pd.DataFrame:
    """Every number of a table as it is printed, in both scores.

    Returns:
        Columns ``row`` (as in the cells), ``kind`` (of ``AGAINST``), ``column`` (a heading),
        ``place`` (0 position, 1 orientation), ``text``, ``tone``, ``note`` and ``bold``: whether it
        is the lowest of its kind, column and block, as printed.
    """
    parts, first = [], cells.groupby("row", sort=False).head(1)
    for place, (measure, unit) in enumerate(UNITS.items()):
        for kind, end in KIND_OF.items():
            score = f"{measure}{end}"
            parts.append(_scores(cells, kind, place, score, unit))
            for start, column in REFERENCES.items():  # the same for every localizer of a row
                if f"{start}_{score}" in first:
                    texts = [_plain(value, unit) for value in first[f"{start}_{score}"]]
                    parts.append(_part(first, kind, place, texts, column=column))
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
    return with_bold(values, [blocks, values.kind, values["column"], values.place])


def _part(
    cells: pd.DataFrame, kind: str, place: int, texts: list[str], **more: Any
) -> pd.DataFrame:
    """Values of some cells; ``more``: columns of :func:`printed_values`, and ``number``."""
    usual = {"column": cells.model.map(TITLES), "number": float("nan"), "tone": "", "note": ""}
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
    return _part(
        cells, kind, place, texts, number=cells[score].map(partial(round, ndigits=2)), note=notes
    )


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


def _lines(name: str, cells: pd.DataFrame, values: pd.DataFrame, one_truth: bool) -> pd.DataFrame:
    """The printed lines in order, blocks together; columns ``LINE``."""
    rows = cells.assign(block=blocks_of(cells)).groupby("row", sort=False).first()
    rows = rows.assign(group=rows.groupby("block", sort=False).ngroup())
    kinds = values[["row", "kind"]].drop_duplicates()
    lines = kinds.assign(order=kinds.kind.map(list(AGAINST).index), label="", label_note="")
    lines = lines.join(rows[["group", "block", "published_row_note"]], on="row")
    lines["against"] = lines.kind.map(AGAINST | ({"labels": "labels = truth"} if one_truth else {}))
    own, paper = lines.kind == "labels", lines.kind == PAPER
    labels = {row.Index: row_label(name, row) for row in rows_of(cells.set_index("row"))}
    lines.loc[own, "label"] = lines.row.map(labels)
    lines.loc[paper, "label"] = lines.row.map(published_labels(name, cells))
    lines.loc[paper, "label_note"] = lines.published_row_note
    return lines.sort_values(["group", "row", "order"]).reset_index(drop=True)


def row_label(name: str, cell: Any) -> str:
    """First column of a row: label source, noise, or size with the frames actually used."""
    if name == "table2_ground_truth":
        return SOURCES.get(cell.labels, str(cell.label_id))
    if name == "table3_inconsistencies":
        return f"{_level(cell.noise_m)} m, {cell.noise_deg:g}°"
    if name == "table6_label_errors":
        size = f"{_level(cell.noise_m)} m, {cell.noise_deg:g}°"
        return f"{ERRORS[cell.labels]}, {size}" if cell.labels in ERRORS else "none"
    if name == "table7_images_shown":
        start, part = split_init(cell.init)
        return STARTS[start] + PARTS[part]
    return f"{cell.size}: ({cell.n_train}, {cell.n_test})"


def published_labels(name: str, cells: pd.DataFrame) -> dict[Any, str]:
    """By row, its label in print: frames, or another one than it is run under, or none."""
    rows = cells[cells.published_position_m.notna()].groupby("row").first()
    if name not in ("table4_size", FROM_SCRATCH):
        return dict(rows.published_printed_row)
    frames = zip(rows.index, rows.published_n_train, rows.published_n_test, strict=True)
    return {row: f"({train / 1000:g}k, {test / 1000:g}k)" for row, train, test in frames}


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


def _level(noise_m: float) -> str:
    """A noise level with the paper's two digits, or as many as it needs; 0 stays 0."""
    if noise_m == 0 or round(noise_m, 2) != noise_m:
        return f"{noise_m:g}"
    return f"{noise_m:.2f}"
