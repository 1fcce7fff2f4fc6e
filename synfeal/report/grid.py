"""A table as it is read on paper, before it becomes LaTeX or Markdown.

A grid has groups (the blocks between two rules), a group has rows (one data set each), and a row
has lines: the regenerated errors, the same against the true poses, the first in the unit that the
paper prints, and the paper's. Text is Unicode; the writers translate it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

Kind = Literal["labels", "truth", "unit", "paper"]


@dataclass(frozen=True)
class Value:
    """One printed number.

    Attributes:
        text: as printed, with its unit.
        number: what bold is decided on, rounded as printed; None never wins.
        bold: the best of its column and group.
        tone: colour of a percentage, ``better`` or ``worse``; empty for everything else.
    """

    text: str
    number: float | None = None
    bold: bool = False
    tone: Literal["", "better", "worse"] = ""


@dataclass(frozen=True)
class Entry:
    """One cell of a line: its values, and a footnote if it needs one."""

    values: tuple[Value, ...]
    note: str = ""


@dataclass(frozen=True)
class Line:
    """One printed line of a row.

    Attributes:
        kind: what the numbers are; lines of one kind compete for bold.
        label: first column, may be empty.
        against: second column: what the errors are measured against.
        entries: one per column.
        label_note: footnote of the label, if any.
    """

    kind: Kind
    label: str
    against: str
    entries: tuple[Entry, ...]
    label_note: str = ""


@dataclass(frozen=True)
class Group:
    """Rows between two rules; the best of each column is bold within the group."""

    title: str
    rows: tuple[tuple[Line, ...], ...]


@dataclass(frozen=True)
class Grid:
    """A whole table.

    Attributes:
        name: file name without suffix; also the label references use.
        caption: one or two sentences.
        columns: headings: of the label, of ``against``, and of every entry.
        groups: blocks of rows.
        remarks: sentences below the table that belong to no single cell.
    """

    name: str
    caption: str
    columns: tuple[str, ...]
    groups: tuple[Group, ...]
    remarks: tuple[str, ...] = ()


def with_bold(rows: Sequence[tuple[Line, ...]]) -> tuple[tuple[Line, ...], ...]:
    """The rows of a group with the lowest number of each column, value and kind set bold.

    Ties at the printed precision are all bold, as in the paper; where fewer than two rows have a
    number there is nothing to compare and nothing is bold.
    """
    best = _best(rows)
    return tuple(tuple(_bold_line(line, best) for line in row) for row in rows)


def footnotes(grid: Grid) -> list[str]:
    """All distinct footnotes in reading order; their marks are a, b, c, ..."""
    lines = [line for group in grid.groups for row in group.rows for line in row]
    notes = [note for line in lines for note in (line.label_note, *(e.note for e in line.entries))]
    return [note for note in dict.fromkeys(notes) if note]


def _best(rows: Sequence[tuple[Line, ...]]) -> dict[tuple[str, int, int], float]:
    numbers: dict[tuple[str, int, int], list[float]] = {}
    for line in (line for row in rows for line in row):
        for column, entry in enumerate(line.entries):
            for place, value in enumerate(entry.values):
                if value.number is not None:
                    numbers.setdefault((line.kind, column, place), []).append(value.number)
    return {where: min(found) for where, found in numbers.items() if len(found) > 1}


def _bold_line(line: Line, best: dict[tuple[str, int, int], float]) -> Line:
    def bold(entry: Entry, column: int) -> Entry:
        values = [
            replace(value, bold=value.number is not None and value.number == best.get(where))
            for place, value in enumerate(entry.values)
            for where in [(line.kind, column, place)]
        ]
        return replace(entry, values=tuple(values))

    return replace(line, entries=tuple(bold(e, column) for column, e in enumerate(line.entries)))
