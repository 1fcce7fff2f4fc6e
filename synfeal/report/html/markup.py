"""Pieces of HTML that several sections share: boxes around tables, sortable headings, rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape


@dataclass(frozen=True)
class Column:
    """A heading that sorts.

    Attributes:
        title: its text.
        numeric: set to the right, digits aligned.
    """

    title: str
    numeric: bool = False


def heading(column: Column, place: int, rows: int = 1) -> str:
    """A heading cell whose button sorts the table by column ``place``; ``rows`` it spans."""
    span = f' rowspan="{rows}"' if rows > 1 else ""
    kind = ' class="number"' if column.numeric else ""
    button = f'<button type="button">{escape(column.title)}</button>'
    return f'<th scope="col" data-column="{place}" aria-sort="none"{span}{kind}>{button}</th>'


def plain_table(name: str, caption: str, columns: Sequence[Column], rows: Sequence[str]) -> str:
    """A sortable table with one line of headings; ``rows`` and ``caption`` are HTML."""
    head = "".join(heading(column, place) for place, column in enumerate(columns))
    return boxed(name, caption, f"<tr>{head}</tr>", rows)


def boxed(name: str, caption: str, head: str, rows: Sequence[str], below: str = "") -> str:
    """A table that scrolls inside its box; all arguments but ``name`` are HTML."""
    body = "\n".join(rows)
    return (
        f'<figure class="table" id="{escape(name)}"><figcaption>{caption}</figcaption>'
        f'<div class="scroll" role="region" tabindex="0" aria-label="{escape(name)}">'
        f'<table class="sortable"><thead>{head}</thead><tbody>\n{body}\n</tbody></table></div>'
        f"{below}</figure>"
    )


def text_cell(text: str) -> str:
    """A cell of plain text."""
    return f"<td>{escape(text)}</td>"


def number_cell(value: float | None, text: str, beside: str = "") -> str:
    """A number as ``text``, sorted by its value; ``beside`` is HTML set after it."""
    key = "" if value is None else f"{value!r}"
    return f'<td class="number" data-sort="{key}">{escape(text)}{beside}</td>'


def bullets(sentences: Sequence[str]) -> str:
    """A list of sentences of plain text."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>"
