"""Tables as printed: LaTeX by pandas' Styler, Markdown by tabulate.

A sheet has lines: the regenerated errors of a data set, the same against the true poses, the
paper's. Text is Unicode; the writers translate it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from synfeal.records.files import write_text

PACKAGES = ("booktabs", "graphicx", "xcolor")
HEADER = f"% Needs \\usepackage{{{','.join(PACKAGES)}}}\n"
# Plain xcolor mixes, so that no package option is needed; both stay apart from black in grey print.
TONES = {"better": "green!45!black", "worse": "red!85!black"}
SPECIAL = str.maketrans(
    {
        **{character: f"\\{character}" for character in "&%#_${}"},
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "|": r"\textbar{}",
        "…": r"\ldots{}",
        "–": "--",
        "°": r"$^\circ$",
        "ᵀ": r"$^\top$",
        "²": "$^2$",
        "³": "$^3$",
        "−": "$-$",
        "±": r"$\pm$",
        "×": r"$\times$",
        "·": r"$\cdot$",
        "→": r"$\to$",
        "≥": r"$\ge$",
        "≤": r"$\le$",
        "√": r"$\surd$",
        "Σ": r"$\Sigma$",
        "τ": r"$\tau$",
        "β": r"$\beta$",
        "θ": r"$\theta$",
        "π": r"$\pi$",
        "✗": r"$\times$",
        "<": "$<$",
        ">": "$>$",
    }
)
PAPER = "paper"
PLAIN, MARKDOWN = "plain", "pipe"  # tables of text for a terminal, for a page


class Value(NamedTuple):
    """A printed number, or a text."""

    text: str
    bold: bool = False
    tone: str = ""  # ``better``, ``worse`` or none
    note: str = ""  # footnote; on paper that of the first value stands for the cell
    limits: str = ""  # 95 % limits, on the page alone
    sort: Any = ""  # what the page sorts by; empty comes last


class Line(NamedTuple):
    """A printed line; a rule stands between blocks, a thin gap between rows."""

    block: str
    row: Hashable
    kind: str  # lines whose kind begins with ``PAPER`` are grey
    cells: Sequence[Sequence[Value]]  # label, what errors are against, and every column


@dataclass(frozen=True)
class Sheet:
    """A table and what stands around it."""

    name: str  # file name without suffix; also the label references use
    caption: str  # one or two sentences
    headings: tuple[str, ...]  # one for each cell of a line
    lines: Sequence[Line]
    remarks: tuple[str, ...] = ()  # sentences below the table that belong to no single cell


@dataclass(frozen=True)
class _Format:
    """Notation of a language for numbers, marks of footnotes, and cells of a line."""

    value: Callable[[Value, str], str]
    mark: Callable[[str], str]
    cell: Callable[[str, str], str] = lambda text, kind: text


def footnotes(sheet: Sheet) -> dict[str, str]:
    """Assign marks (a, b, c, ...) to distinct footnotes in reading order.

    Returns:
        The mark of each footnote by its text.
    """
    notes = [value.note for line in sheet.lines for cell in line.cells for value in cell]
    return {note: chr(ord("a") + k) for k, note in enumerate(dict.fromkeys(filter(None, notes)))}


def write_latex(path: Path, sheet: Sheet) -> None:
    """Write one table environment, ready to be input by a document."""
    write_text(path, HEADER + sheet_latex(sheet))


def sheet_latex(sheet: Sheet) -> str:
    """Format a sheet as a LaTeX table environment, ending in a newline."""
    marks = footnotes(sheet)
    table = _table(sheet, _LATEX, marks)
    table.columns = pd.Index(map(_heading, sheet.headings, range(len(sheet.headings))))
    if any(line.block for line in sheet.lines):
        table.insert(0, "", _titles(sheet, upright=True), allow_duplicates=True)
    layout = "l" * table.shape[1]
    tabular = table.style.hide(axis="index").to_latex(hrules=True, column_format=layout)
    head, _, tail = tabular.partition("\\midrule\n")
    body, _, end = tail.partition("\\bottomrule\n")
    notes = [rf"$^{{{mark}}}$ {escape(note)}" for note, mark in marks.items()]
    below = r"\scriptsize " + r" \par ".join([*map(escape, sheet.remarks), *notes])
    lines = [
        r"\begin{table*}[tp]",
        r"\centering\footnotesize",
        rf"\caption{{{escape(sheet.caption)}}}",
        rf"\label{{tab:{sheet.name}}}\smallskip",
        r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%",
        f"{head}\\midrule",
        *_ruled(body.splitlines(), sheet.lines),
        f"\\bottomrule\n{end.rstrip()}}}",
        r"\par\smallskip",
        rf"\begin{{minipage}}{{\linewidth}}{below}\end{{minipage}}",
        r"\end{table*}",
    ]
    return "\n".join(lines) + "\n"


def _heading(heading: str, place: int) -> str:
    """Format a heading; what follows a comma stands below, except in the first column."""
    first, comma, rest = escape(heading).partition(", ")
    return rf"\shortstack[l]{{{first}\\{rest}}}" if place and comma else first + comma + rest


def escape(text: str) -> str:
    """Escape Unicode text for LaTeX; a sign before a number becomes a minus, not a hyphen."""
    return text.translate(SPECIAL)


def sheet_markdown(sheet: Sheet) -> str:
    """Format a table with its caption above and its footnotes below, ending in a newline."""
    marks = footnotes(sheet)
    table = _table(sheet, _MARKDOWN, marks)
    if any(line.block for line in sheet.lines):
        table.insert(0, "", _titles(sheet, upright=False), allow_duplicates=True)
    notes = "\n".join(f"({mark}) {note}  " for note, mark in marks.items())
    parts = (f"**{sheet.caption}**", markdown_table(table), notes)
    return "\n\n".join(part for part in parts if part) + "\n"


def markdown_table(table: pd.DataFrame) -> str:
    """Format a frame of texts as Markdown, its cells as wide as what they hold."""
    padded = table.to_markdown(index=False, disable_numparse=True)
    return re.sub(r":?-{3,}:?", "---", re.sub(r" {2,}(?=\|)", " ", padded))


def text_table(rows: Sequence[Sequence[str]], n_left: int = 1, form: str = PLAIN) -> str:
    """Format rows of text as a table with headings.

    Args:
        rows: Headings, then the rows, all of one length.
        n_left: Number of columns that are left-aligned, from the first; the others are
            right-aligned.
        form: Format of the package tabulate: ``PLAIN`` or ``MARKDOWN``.

    Returns:
        The table, ending in a newline.
    """
    sides = ["left" if i < n_left else "right" for i in range(len(rows[0]))]
    frame = pd.DataFrame(rows[1:], columns=list(rows[0]))
    text = frame.to_markdown(index=False, tablefmt=form, disable_numparse=True, colalign=sides)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def _table(sheet: Sheet, form: _Format, marks: Mapping[str, str]) -> pd.DataFrame:
    """Format lines by heading, as text of a language."""
    rows = []
    for line in sheet.lines:
        texts = [", ".join(form.value(value, line.kind) for value in cell) for cell in line.cells]
        notes = [cell[0].note if cell else "" for cell in line.cells]
        signs = [form.mark(marks[note]) if note else "" for note in notes]
        rows.append([form.cell(t + s, line.kind) for t, s in zip(texts, signs, strict=True)])
    return pd.DataFrame(rows, columns=list(sheet.headings))


def _latex_value(value: Value, kind: str) -> str:
    text = escape(value.text)
    if value.tone:
        sign = text.replace("-", "$-$").replace("+", "$+$")
        return rf"\textcolor{{{TONES[value.tone]}}}{{{sign}}}"
    return rf"\textbf{{{text}}}" if value.bold else text


def _markdown_value(value: Value, kind: str) -> str:
    # Each number is emphasised by itself: renderers disagree on emphasis inside emphasis.
    emphasis = ("*" if kind.startswith(PAPER) else "") + ("**" if value.bold else "")
    return f"{emphasis}{value.text}{emphasis}" if value.text else ""


_LATEX = _Format(
    _latex_value,
    lambda mark: rf"$^{{{mark}}}$",
    lambda text, kind: (
        rf"\textcolor{{gray}}{{{text}}}" if kind.startswith(PAPER) and text else text
    ),
)
_MARKDOWN = _Format(_markdown_value, lambda mark: f" ({mark})")


def _titles(sheet: Sheet, upright: bool) -> list[str]:
    """Return by line the title of its block: at the first, or upright at the middle if it fits."""
    titles: list[str] = []
    for block, lines in groupby(line.block for line in sheet.lines):
        n, title, place = len([*lines]), block, 0
        if upright:
            title, place = rf"\textbf{{{escape(block)}}}", n // 2
        if upright and len(block) <= 2 * n:
            # A box without height leaves the line spacing alone; no package for it is needed.
            title = rf"\smash{{\rotatebox[origin=c]{{90}}{{{title}}}}}"
        titles += [title if k == place else "" for k in range(n)]
    return titles


def _ruled(body: Sequence[str], lines: Sequence[Line]) -> list[str]:
    """Insert a rule before each new block, a thin gap before each new row."""
    ruled = list(body[:1])  # a table may have no lines
    for text, line, above in zip(body[1:], lines[1:], lines, strict=False):
        if (line.block, line.row) != (above.block, above.row):
            ruled.append(r"\midrule" if line.block != above.block else r"\addlinespace")
        ruled.append(text)
    return ruled
