"""The paper's layouts: which lines a table row has, and how labels, blocks and captions read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from baselines.groundtruth.methods import METHODS
from synfeal.config import MODELS
from synfeal.config.experiments import FROM_SCRATCH
from synfeal.report.cells import Cell
from synfeal.report.grid import Entry, Grid, Group, Kind, Line, Value, with_bold
from synfeal.report.stats import Score

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
}
HEADINGS = {
    "table2_ground_truth": "Ground truth provided by",
    "table3_inconsistencies": "Inconsistencies",
    "table4_size": "(# train, # test)",
    "table5_from_scratch": "(# train, # test)",
    "table6_label_errors": "Errors of the labels",
}
SCORES = (
    "Errors are against the labels the test set carries (the paper's protocol) and against the "
    "true poses of the simulator."
)
PAPER = (
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
ByModel = Sequence[Cell]


def grid_of(name: str, cells: Sequence[Cell]) -> Grid:
    """Lay out one of tables 2 to 5.

    Args:
        name: the table.
        cells: its cells in order, the five localizers of a row side by side.
    """
    rows = [cells[i : i + len(MODELS)] for i in range(0, len(cells), len(MODELS))]
    one_truth = all(cell.row.labels == "synfeal" for cell in cells)
    groups = tuple(
        Group(title, with_bold([lines_of(name, row, one_truth) for row in members]))
        for title, members in _blocks(rows).items()
    )
    return Grid(
        name,
        f"{CAPTIONS[name]} {_where(name, rows)} Best scores in bold.",
        (HEADINGS[name], "Error against", *TITLES.values(), *references_of(one_truth)),
        groups,
        (SCORES, UNTRAINED, PAPER, *([CHANGE] if name == FROM_SCRATCH else [])),
    )


def scene_title(scene: str) -> str:
    """A scene's name as printed, e.g. ``Large Room``."""
    return scene.replace("_", " ").title()


def lines_of(name: str, row: ByModel, one_truth: bool) -> tuple[Line, ...]:
    """The printed lines of one table row.

    Args:
        name: the table.
        row: its five cells.
        one_truth: every label of the table is a true pose, so that both scores are one line.
    """
    label = row_label(name, row[0])
    if one_truth:
        lines = _score_lines(row, "labels", label, "labels = truth")
    else:
        lines = _score_lines(row, "labels", label, "labels")
        lines += _score_lines(row, "truth", "", "truth")
    width = len(row) + len(references_of(one_truth))
    lines += _paper_lines(name, row)
    blank = Entry((Value(""),))
    return tuple(
        replace(line, entries=(*line.entries, *[blank] * (width - len(line.entries))))
        for line in (_with_references(line, row[0], one_truth) for line in lines)
    )


def references_of(one_truth: bool) -> tuple[str, ...]:
    """Titles of the columns after the localizers; true labels have no floor but zero."""
    return tuple(REFERENCES.values())[: 1 if one_truth else 2]


def _with_references(line: Line, cell: Cell, one_truth: bool) -> Line:
    """A line of scores with what the untrained score, the same for every localizer of the row."""
    if line.kind not in ("labels", "truth") or line.against == "change":
        return line
    end = "_true" if line.kind == "truth" else ""
    found = cell.own.references
    entries = [
        Entry((_plain(found[f"{name}_position_m{end}"], " m"), _plain(found[degrees], "°")))
        for name in list(REFERENCES)[: len(references_of(one_truth))]
        if (degrees := f"{name}_orientation_deg{end}") in found
    ]
    return replace(line, entries=(*line.entries, *entries))


def _plain(value: float | None, unit: str) -> Value:
    """A number that does not compete for bold."""
    return Value("–" if value is None else f"{value:.2f}{unit}")


def row_label(name: str, cell: Cell) -> str:
    """First column of a row: label source, noise, or size with the frames actually used."""
    row = cell.row
    if name == "table2_ground_truth":
        return SOURCES.get(row.labels, row.label_id)
    if name == "table3_inconsistencies":
        return f"{_level(row.noise_m)} m, {row.noise_deg:g}°"
    if name == "table6_label_errors":
        size = f"{_level(row.noise_m)} m, {row.noise_deg:g}°"
        return f"{ERRORS[row.labels]}, {size}" if row.labels in ERRORS else "none"
    return f"{row.size}: ({cell.own.n_train}, {cell.own.n_test})"


def _blocks(rows: Sequence[ByModel]) -> dict[str, list[ByModel]]:
    """Rows by the title of their block: noise of Table 3, and the scene where there are several."""
    several = len({row[0].row.scene for row in rows}) > 1
    blocks: dict[str, list[ByModel]] = {}
    for row in rows:
        scene = scene_title(row[0].row.scene) if several else ""
        blocks.setdefault(f"{BLOCKS[row[0].row.block]} {scene}".strip(), []).append(row)
    return blocks


def _score_lines(row: ByModel, kind: Kind, label: str, against: str) -> list[Line]:
    end = "_true" if kind == "truth" else ""
    lines = [Line(kind, label, against, tuple(_entry(cell, end) for cell in row))]
    if row[0].change_percent:
        lines.append(Line(kind, "", "change", tuple(_change_entry(cell, end) for cell in row)))
    return lines


def _entry(cell: Cell, end: str) -> Entry:
    own = cell.own
    note = ""
    if own.failed:
        note = f"{own.failed} of {own.n_test * own.n_seeds} predictions failed"
        note += f", {own.n_finished} of {own.n_seeds} runs have a score."
    if not own.n_finished:
        return Entry((Value("failed"),), note)
    position, orientation = own.scores[f"position_m{end}"], own.scores[f"orientation_deg{end}"]
    return Entry((_value(position, " m"), _value(orientation, "°")), note)


def _value(score: Score, unit: str) -> Value:
    assert score.value is not None  # a cell with a run that finished has all its scores
    spread = "" if score.sd is None else f" ± {score.sd:.2f}"
    return Value(f"{score.value:.2f}{spread}{unit}", round(score.value, 2))


def _change_entry(cell: Cell, end: str) -> Entry:
    measures = (f"position_m{end}", f"orientation_deg{end}")
    return Entry(tuple(_percent(cell.change_percent[measure]) for measure in measures))


def _percent(value: float | None) -> Value:
    if value is None:
        return Value("no change known")
    return Value(f"{value:+.1f}%", tone="worse" if round(value, 1) > 0 else "better")


def _paper_lines(name: str, row: ByModel) -> list[Line]:
    printed = next((cell.published for cell in row if cell.published), None)
    if printed is None:
        return []
    label = printed.printed_row
    if name in ("table4_size", FROM_SCRATCH):
        label = f"({_thousands(printed.n_train)}, {_thousands(printed.n_test)})"
    entries = tuple(_paper_entry(cell) for cell in row)
    unit = Line("unit", "", "labels, paper's unit", tuple(_entry_in_print(cell) for cell in row))
    lines = [unit, Line("paper", label, "paper", entries, printed.row_note)]
    if name == FROM_SCRATCH:
        lines.append(Line("paper", "", "change, paper", tuple(_paper_change(cell) for cell in row)))
    return lines


def _entry_in_print(cell: Cell) -> Entry:
    return Entry((_plain(cell.own.position_rms_m, " m"),))


def _paper_entry(cell: Cell) -> Entry:
    printed = cell.published
    if printed is None:
        return Entry((Value("–"),))
    degrees = None if printed.flag == "misprint" else printed.orientation_deg
    values = (
        Value(f"{printed.position_m:.2f} m", printed.position_m),
        Value(f"{printed.orientation_deg:.2f}°", degrees),
    )
    return Entry(values, printed.cell_note)


def _paper_change(cell: Cell) -> Entry:
    printed = cell.published
    if printed is None:
        return Entry((Value("–"),))
    return Entry(
        (_percent(printed.position_change_percent), _percent(printed.orientation_change_percent))
    )


def _where(name: str, rows: Sequence[ByModel]) -> str:
    """Which scene, and how many frames where that is the same for the whole table."""
    titles = list(dict.fromkeys(scene_title(row[0].row.scene) for row in rows))
    where = f"Scene: {titles[0]}" if len(titles) == 1 else f"Scenes: {', '.join(titles)}"
    counts = {(row[0].own.n_train, row[0].own.n_test) for row in rows}
    if len(counts) == 1:
        n_train, n_test = counts.pop()
        where += f"; {n_train} training and {n_test} test frames"
    return f"{where}."


def _level(noise_m: float) -> str:
    """A noise level with the paper's two digits, or as many as it needs; 0 stays 0."""
    if noise_m == 0 or round(noise_m, 2) != noise_m:
        return f"{noise_m:g}"
    return f"{noise_m:.2f}"


def _thousands(count: int) -> str:
    return f"{count / 1000:g}k"
