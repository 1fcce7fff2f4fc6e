"""Tables 2 to 5 as HTML: both scores in every cell, of which a switch on the page shows one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from html import escape

from synfeal.config.experiments import FROM_SCRATCH
from synfeal.report.cells import Cell
from synfeal.report.grid import Kind, Line, Value, footnotes, with_bold
from synfeal.report.html.markup import Column, boxed, heading
from synfeal.report.layouts import (
    CHANGE,
    HEADINGS,
    REFERENCES,
    TITLES,
    grid_of,
    lines_of,
    row_label,
    scene_title,
)
from synfeal.report.stats import Score

QUANTITIES = ("position_m", "orientation_deg")
SCORE_TAGS = (
    '<span class="tag labels">against the labels: the paper’s protocol</span>'
    '<span class="tag true">against the true poses: not in the paper</span>'
)
SAME = "All labels of this table are true poses, so both scores are the same numbers."
ByModel = Sequence[Cell]
Lines = Mapping[tuple[Kind, bool], Line]
Marks = Mapping[str, str]


def score_table(name: str, cells: Sequence[Cell]) -> str:
    """One of tables 2 to 5.

    Args:
        name: the table.
        cells: its cells in order, the five localizers of a row side by side.
    """
    grid = grid_of(name, cells)
    marks = {note: chr(ord("a") + i) for i, note in enumerate(footnotes(grid))}
    rows = [cells[i : i + len(TITLES)] for i in range(0, len(cells), len(TITLES))]
    body = [html for group in _groups(rows) for html in _group(name, group, marks)]
    remarks = [SAME] if all(cell.row.labels == "synfeal" for cell in cells) else []
    remarks += [CHANGE] if name == FROM_SCRATCH else []
    below = "".join(f"<p>{escape(remark)}</p>" for remark in remarks)
    below += "".join(f"<p><sup>{mark}</sup> {escape(note)}</p>" for note, mark in marks.items())
    number = name.split("_")[0].removeprefix("table")
    caption = f"<b>Table {number}.</b> {escape(grid.caption)} {SCORE_TAGS}"
    return boxed(name, caption, _head(name), body, f'<div class="notes">{below}</div>')


def interval(score: Score) -> str:
    """The 95 % limits as printed below a score; without an upper one they reach to infinity."""
    if score.low is None:
        return ""
    high = "∞" if score.high is None else f"{score.high:.2f}"
    return f"{score.low:.2f}–{high}"


def _head(name: str) -> str:
    labels = [*(["Noise in"] if name.startswith("table3") else ["Scene"]), HEADINGS[name]]
    first = "".join(heading(Column(title), place, 2) for place, title in enumerate(labels))
    titles = [*TITLES.values(), *REFERENCES.values()]
    models = "".join(f'<th scope="colgroup" colspan="2">{title}</th>' for title in titles)
    quantities = [Column(title, True) for _ in titles for title in ("Position", "Orient.")]
    second = "".join(heading(column, 2 + place) for place, column in enumerate(quantities))
    return f"<tr>{first}{models}</tr><tr>{second}</tr>"


def _groups(rows: Sequence[ByModel]) -> list[list[ByModel]]:
    """Rows that compete for bold: those of one block of Table 3, of one scene elsewhere."""
    groups: dict[tuple[str, str], list[ByModel]] = {}
    for row in rows:
        groups.setdefault((row[0].row.block, row[0].row.scene), []).append(row)
    return list(groups.values())


def _group(name: str, rows: Sequence[ByModel], marks: Marks) -> list[str]:
    """The rows of a group; the first has a rule above."""
    printed = with_bold([lines_of(name, row, one_truth=False) for row in rows])
    texts = []
    for place, (row, lines) in enumerate(zip(rows, printed, strict=True)):
        by_kind = {(line.kind, "change" in line.against): line for line in lines}
        style = "" if place else ' class="first"'
        texts.append(f"<tr{style}>{_labels(name, row, by_kind, marks)}")
        texts[-1] += "".join(_cells(row, by_kind, marks))
        texts[-1] += "".join(_references(row[0], by_kind)) + "</tr>"
    return texts


def _labels(name: str, row: ByModel, lines: Lines, marks: Marks) -> str:
    """The first two columns: scene or block, and what tells the row from its neighbours."""
    design, paper = row[0].row, lines.get(("paper", False))
    block = design.block or scene_title(design.scene)
    label, key = row_label(name, row[0]), str(row[0].own.n_train)
    if design.block:
        key = f"{1000 * design.noise_m + design.noise_deg:g}"
    elif name == "table2_ground_truth":
        key = label
    printed = ""
    if paper and paper.label:
        note = _mark(paper.label_note, marks)
        printed = f'<span class="paper">paper: {escape(paper.label)}{note}</span>'
    return (
        f'<td>{escape(block)}</td><th scope="row" data-sort="{escape(key)}">'
        f"{escape(label)}{printed}</th>"
    )


def _cells(row: ByModel, lines: Lines, marks: Marks) -> Iterator[str]:
    """Two cells per localizer: both scores, of which one is shown, and the paper's value below."""
    for column, cell in enumerate(row):
        for place, quantity in enumerate(QUANTITIES):
            keys, shown = "", ""
            for style, kind, measure in _scores_of(quantity):
                score = cell.own.scores[measure]
                keys += f' data-{style}="{"" if score.value is None else score.value}"'
                shown += f'<div class="{style}">'
                shown += _printed(lines, kind, column, place, marks)
                shown += f"<small>{interval(score)}</small>"
                shown += _change(lines, kind, column, place) + "</div>"
            printed = _printed(lines, "paper", column, place, marks)
            if printed:
                printed += _change(lines, "paper", column, place)
                printed = f'<div class="paper">{printed}</div>'
            yield f'<td class="number"{keys}>{shown}{printed}</td>'


def _references(cell: Cell, lines: Lines) -> Iterator[str]:
    """Two cells for each answer without training: both scores, of which one is shown."""
    for column, name in enumerate(REFERENCES, start=len(TITLES)):
        for place, quantity in enumerate(QUANTITIES):
            keys, shown = "", ""
            for style, kind, measure in _scores_of(quantity):
                value = cell.own.references.get(f"{name}_{measure}", 0.0)  # truth is the truth
                keys += f' data-{style}="{value}"'
                printed = _printed(lines, kind, column, place, {})
                shown += f'<div class="{style}">{printed}</div>'
            yield f'<td class="number"{keys}>{shown}</td>'


def _scores_of(quantity: str) -> Iterator[tuple[str, Kind, str]]:
    """Style, kind of line and measure of the two scores of a quantity."""
    yield "labels", "labels", quantity
    yield "true", "truth", f"{quantity}_true"


def _printed(lines: Lines, kind: Kind, column: int, place: int, marks: Marks) -> str:
    """One number of a line; nothing where there is no such line."""
    if (line := lines.get((kind, False))) is None or column >= len(line.entries):
        return ""
    entry = line.entries[column]
    # A run without a score has one text for both quantities.
    return _value(entry.values[min(place, len(entry.values) - 1)]) + _mark(entry.note, marks)


def _change(lines: Lines, kind: Kind, column: int, place: int) -> str:
    """Table 5: the change of one number."""
    line = lines.get((kind, True))
    values = line.entries[column].values if line else ()
    return _value(values[place]) if place < len(values) else ""


def _value(value: Value) -> str:
    text = escape(value.text).replace("-", "\u2212") if value.tone else escape(value.text)
    if value.tone:
        return f'<span class="change {value.tone}">{text}</span>'
    return f"<b>{text}</b>" if value.bold else f"<span>{text}</span>"


def _mark(note: str, marks: Marks) -> str:
    return f"<sup>{marks[note]}</sup>" if note else ""
