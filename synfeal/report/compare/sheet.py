"""Tables of text in sections: aligned for a terminal, or as Markdown."""

from __future__ import annotations

from dataclasses import dataclass

Row = tuple[str, ...]


@dataclass(frozen=True)
class Sheet:
    """A table.

    Attributes:
        headings: one per column.
        sections: title (may be empty) and rows of each; a row has one text per column.
        n_left: columns aligned to the left, from the first; the others are numbers.
    """

    headings: Row
    sections: tuple[tuple[str, tuple[Row, ...]], ...]
    n_left: int = 1

    def text(self) -> str:
        """Columns aligned with spaces, a section's title on a line of its own."""
        rows = [self.headings, *(row for _, rows in self.sections for row in rows)]
        widths = [max(len(row[i]) for row in rows) for i in range(len(self.headings))]
        lines = [self._aligned(self.headings, widths)]
        for title, members in self.sections:
            lines += [title] if title else []
            lines += [self._aligned(row, widths) for row in members]
        return "\n".join(lines) + "\n"

    def markdown(self) -> str:
        """A Markdown table; a section's title is a row with one cell."""
        rules = [":---" if i < self.n_left else "---:" for i in range(len(self.headings))]
        lines = [_row(self.headings), _row(tuple(rules))]
        for title, members in self.sections:
            lines += [_row((f"**{title}**", *[""] * (len(rules) - 1)))] if title else []
            lines += map(_row, members)
        return "\n".join(lines) + "\n"

    def _aligned(self, row: Row, widths: list[int]) -> str:
        cells = [
            text.ljust(width) if i < self.n_left else text.rjust(width)
            for i, (text, width) in enumerate(zip(row, widths, strict=True))
        ]
        indent = "  " if any(title for title, _ in self.sections) else ""
        return (indent + "  ".join(cells)).rstrip()


def _row(cells: Row) -> str:
    return f"| {' | '.join(cells)} |"
