"""Markdown of a grid, for the summary and the read-me."""

from __future__ import annotations

from synfeal.report.grid import Entry, Grid, Group, Line, footnotes


def markdown_of(grid: Grid) -> str:
    """A table with its caption above and its footnotes below, ending in a newline."""
    marks = {note: chr(ord("a") + i) for i, note in enumerate(footnotes(grid))}
    blocks = any(group.title for group in grid.groups)
    heading = [*([""] if blocks else []), *grid.columns]
    rows = [row for group in grid.groups for row in _group(group, blocks, marks)]
    table = [_row(heading), _row(["---"] * len(heading)), *map(_row, rows)]
    notes = [f"({mark}) {note}  " for note, mark in marks.items()]
    parts = [f"**{grid.caption}**", "\n".join(table), "\n".join(notes)]
    return "\n\n".join(part for part in parts if part) + "\n"


def _group(group: Group, blocks: bool, marks: dict[str, str]) -> list[list[str]]:
    lines = [_line(line, marks) for row in group.rows for line in row]
    if not blocks:
        return lines
    return [[group.title if i == 0 else "", *line] for i, line in enumerate(lines)]


def _line(line: Line, marks: dict[str, str]) -> list[str]:
    slant = "*" if line.kind == "paper" else ""
    texts = [f"{slant}{text}{slant}" if text else "" for text in (line.label, line.against)]
    texts[0] += _mark(line.label_note, marks)
    return [*texts, *(_entry(entry, slant, marks) for entry in line.entries)]


def _entry(entry: Entry, slant: str, marks: dict[str, str]) -> str:
    # Each number is emphasised by itself: renderers disagree on emphasis inside emphasis.
    emphases = [slant + ("**" if value.bold else "") for value in entry.values]
    texts = [f"{e}{value.text}{e}" for e, value in zip(emphases, entry.values, strict=True)]
    return ", ".join(texts) + _mark(entry.note, marks)


def _mark(note: str, marks: dict[str, str]) -> str:
    return f" ({marks[note]})" if note else ""


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"
