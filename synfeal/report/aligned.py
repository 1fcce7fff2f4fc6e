"""Tables of text: aligned for a terminal, or as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

Rows = Sequence[Sequence[str]]


def aligned(rows: Rows, left: Sequence[int] = (0,)) -> str:
    """Columns two spaces apart; those in ``left`` start at their left edge, others end right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "".join(
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        + "\n"
        for row in rows
    )


def aligned_sections(headings: Sequence[str], sections: Mapping[str, Rows], n_left: int) -> str:
    """The same with the rows of each section, indented, below its title."""
    rows = [headings, *(row for section in sections.values() for row in section)]
    head, *lines = aligned(rows, range(n_left)).splitlines()
    text = [f"  {head}"]
    for title, section in sections.items():
        text += [title, *(f"  {lines.pop(0)}" for _ in section)]
    return "\n".join(text) + "\n"


def markdown(headings: Sequence[str], sections: Mapping[str, Rows], n_left: int = 1) -> str:
    """A Markdown table; the title of a section, where it has one, is a row with one cell."""
    rules = [":---" if i < n_left else "---:" for i in range(len(headings))]
    rows = [headings, rules]
    for title, section in sections.items():
        rows += [[f"**{title}**", *[""] * (len(rules) - 1)]] if title else []
        rows += section
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)
